"""Which trial a press belongs to, and which press answers it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from autd_trials.errors import DeviceError
from autd_trials.responses.rate import IN_S, MOST_INPUTS, STUCK_ADVICE, Rate
from autd_trials.responses.responder import Press, Unreadable
from autd_trials.session.events import Phase, ResponseMade, UnreadableInput
from autd_trials.session.recorder import Recorder

_Input = TypeVar("_Input", Press, Unreadable)

_NEXT_REPEAT_S = 0.12
"""A key that is held down comes again within this."""


def answer_of(presses: Sequence[ResponseMade], window_s: float) -> ResponseMade | None:
    """Return the press that answers a trial: the first in its window that means something.

    The first repeat of a key that was held down since before is known by those that follow it. So close to
    the window's end that none could, it answers nothing.

    Parameters
    ----------
    presses
        The presses of an attempt at a trial, in order.
    window_s
        Length of the response window in s.
    """
    for number, press in enumerate(presses):
        if not press.answers:
            continue
        if press.repeat == "perhaps":
            following = (later for later in presses[number + 1 :] if later.button == press.button)
            after = next(following, None)
            held = after is not None and after.repeat == "yes"
            if held or (press.response_time_s or 0.0) > window_s - _NEXT_REPEAT_S:
                continue
        return press
    return None


@dataclass(frozen=True)
class TrialWindow:
    """When a trial listens, on the host's clock."""

    trial: int
    attempt: int
    start_s: float
    onset_s: float
    end_s: float

    def phase(self, time_s: float) -> Phase:
        """Return where an input not before the trial's start falls."""
        if time_s < self.onset_s:
            return "before_onset"
        return "window" if time_s <= self.end_s else "late"


class PressBook:
    """Records all that comes from a response device, in bounded work a call.

    A device that sends more than a person can has failed: what came until then is recorded, what came with it
    is counted in the fault.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._windows: list[TrialWindow] = []
        self._presses: list[ResponseMade] = []
        self._unclear: str | None = None
        self._rate = Rate()

    @property
    def answer(self) -> ResponseMade | None:
        """The press that answers the newest trial, as far as is known by now (see `answer_of`)."""
        if not self._windows:
            return None
        return answer_of(self._presses, self._windows[-1].end_s - self._windows[-1].onset_s)

    def open_window(self, window: TrialWindow) -> None:
        """Begin a trial; the one before stays known, for presses that are read late."""
        self._windows = [*self._windows[-1:], window]
        self._presses, self._unclear = [], None

    def take(self, presses: Sequence[Press], unreadable: Sequence[Unreadable] = ()) -> None:
        """Record what came, each kind oldest first, with one wait for the disk a kind.

        Raises
        ------
        DeviceError
            It comes too fast to be a person's.
        """
        known = list(self._until_they_flood(presses))
        for made in self._recorder.record_all(ResponseMade, [self._press_fields(press) for press in known]):
            self._judge(made)
        others = list(self._until_they_flood(unreadable))
        for found in self._recorder.record_all(
            UnreadableInput, [self._other_fields(each) for each in others]
        ):
            self._suspect(found, found.what)
        left = len(presses) + len(unreadable) - len(known) - len(others)
        if left:
            raise DeviceError(
                f"more than {MOST_INPUTS} inputs in {IN_S:g} s; {left} of them were not recorded",
                where="responder",
                do=STUCK_ADVICE,
            )

    def refuse_unclear(self) -> None:
        """Refuse to call the newest trial not felt where something came that may have been an answer.

        Raises
        ------
        DeviceError
            The trial cannot count.
        """
        if self.answer is None and self._unclear is not None:
            raise DeviceError(
                f"it is not clear whether trial {self._windows[-1].trial} was answered: {self._unclear}",
                where="responder",
                do="see that the response device and the rig's description of it are right; the trial is run "
                "again",
            )

    def _until_they_flood(self, inputs: Sequence[_Input]) -> Iterator[_Input]:
        for each in inputs:
            if not self._rate.allows(each.time_s):
                return
            yield each

    def _judge(self, made: ResponseMade) -> None:
        if self._is_newest(made):
            self._presses.append(made)
        if made.means == "undeclared":
            self._suspect(made, f"the rig does not say what button {made.button} means")
        elif made.repeat != "no":
            self._suspect(made, f"{made.button} was held down")

    def _suspect(self, event: ResponseMade | UnreadableInput, what: str) -> None:
        if event.phase == "window" and self._is_newest(event):
            self._unclear = self._unclear or what

    def _is_newest(self, event: ResponseMade | UnreadableInput) -> bool:
        newest = self._windows[-1] if self._windows else None
        return newest is not None and (event.trial, event.attempt) == (newest.trial, newest.attempt)

    def _press_fields(self, press: Press) -> dict[str, Any]:
        window, place = self._place(press.time_s)
        return {
            **place,
            "press_t_s": self._recorder.session_time(press.time_s),
            "button": press.button,
            "response_time_s": round(press.time_s - window.onset_s, 6) if window else None,
            "device_time_s": press.device_time_s,
            "means": press.means,
            "repeat": press.repeat,
        }

    def _other_fields(self, other: Unreadable) -> dict[str, Any]:
        happened_t_s = self._recorder.session_time(other.time_s)
        return {**self._place(other.time_s)[1], "what": other.what, "happened_t_s": happened_t_s}

    def _place(self, time_s: float) -> tuple[TrialWindow | None, dict[str, Any]]:
        """Return the trial in which something came, and the fields that say so."""
        window = next((w for w in reversed(self._windows) if time_s >= w.start_s), None)
        if window is None:
            return None, {"trial": None, "attempt": None, "phase": "outside"}
        return window, {"trial": window.trial, "attempt": window.attempt, "phase": window.phase(time_s)}
