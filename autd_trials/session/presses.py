"""Which trial a press belongs to."""

import itertools
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from autd_trials.errors import DeviceError
from autd_trials.responses.responder import Input, Press, Unreadable
from autd_trials.session.events import Fault, ResponseMade
from autd_trials.session.recorder import Recorder

Phase = Literal["outside", "before_onset", "window", "late"]

MOST_INPUTS, IN_S = 50, 1.0
"""More than that comes from no person: a key held down repeats some 30 times a second."""

_REPEAT_S = 0.15
"""The same button so soon again is no second answer: keys that are held down repeat every 20 to 100 ms."""

_REPEAT_DELAY_S = 1.1
"""A key that is held down repeats for the first time within this; keyboards wait 0.2 to 1 s."""


@dataclass(frozen=True)
class TrialWindow:
    """When a trial listens, on the host's clock."""

    trial: int
    attempt: int
    start_s: float
    onset_s: float
    end_s: float

    def phase(self, time_s: float) -> Phase:
        """Return where something not before the trial's start falls."""
        if time_s < self.onset_s:
            return "before_onset"
        return "window" if time_s <= self.end_s else "late"


@dataclass
class _Answer:
    """What is known of the answer in the newest window: the response time, and what makes it doubtful."""

    response_time_s: float | None = None
    doubt: str | None = None


@dataclass(frozen=True)
class _Seen:
    """A button's newest press; `delayed` if it came after the one before as a first repeat does."""

    time_s: float
    delayed: bool


class PressBook:
    """Records every press with its trial and its response time, in bounded work a call.

    A device that sends more than `MOST_INPUTS` in `IN_S` has failed: what came until then is recorded, what
    came with it is counted in the fault. What is no press is recorded as a fault.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._windows: list[TrialWindow] = []
        self._answer = _Answer()
        self._newest: deque[float] = deque(maxlen=MOST_INPUTS)
        self._seen: dict[str, _Seen] = {}
        self._strange: set[str] = set()

    @property
    def response_time_s(self) -> float | None:
        """Response time in s of the first press that counts in the newest trial's window, if there is one."""
        return self._answer.response_time_s

    def open_window(self, window: TrialWindow) -> None:
        """Begin a trial; the one before stays known, for presses that are read late."""
        self._windows = [*self._windows[-1:], window]
        self._answer = _Answer()

    def refuse_doubtful(self) -> None:
        """See that the newest trial's answer is known.

        Raises
        ------
        DeviceError
            Something came within its window that may have been an answer.
        """
        if self._answer.response_time_s is None and self._answer.doubt is not None:
            raise DeviceError(
                f"it is not known whether this was felt: {self._answer.doubt}",
                where="responder",
                do="see that nothing holds the button down and that the rig file knows what the box sends; "
                "then go on, and the trial is run again",
            )

    def take(self, inputs: Sequence[Input]) -> None:
        """Record what came, oldest first, with one wait for the disk for all presses in a row.

        Raises
        ------
        DeviceError
            It comes too fast to be a person's.
        """
        kept = list(self._until_they_flood(inputs))
        for kind, group in itertools.groupby(kept, type):
            facts = [
                self._press(each) if isinstance(each, Press) else self._unreadable(each) for each in group
            ]
            self._recorder.record_all(ResponseMade if kind is Press else Fault, facts)
        self._tell_strange_buttons(kept)
        if len(kept) < len(inputs):
            raise DeviceError(
                f"more than {MOST_INPUTS} inputs in {IN_S:g} s; "
                f"{len(inputs) - len(kept)} of them were not recorded",
                where="responder",
                do="look for a button or a key that sticks, and check the box's protocol; then go on",
            )

    def _until_they_flood(self, inputs: Sequence[Input]) -> Iterator[Input]:
        for each in inputs:
            if len(self._newest) == MOST_INPUTS and each.time_s - self._newest[0] < IN_S:
                self._newest.clear()
                return
            self._newest.append(each.time_s)
            yield each

    def _facts(self, found: Input) -> dict[str, Any]:
        return self._press(found) if isinstance(found, Press) else self._unreadable(found)

    def _press(self, press: Press) -> dict[str, Any]:
        window, phase = self._place(press.time_s)
        response_time_s = round(press.time_s - window.onset_s, 6) if window else None
        meaning = self._meaning(press)
        if phase == "window" and window is self._windows[-1]:
            if meaning == "felt" and self._answer.response_time_s is None:
                self._answer.response_time_s = response_time_s
            elif meaning == "repeat":
                self._answer.doubt = self._answer.doubt or f"{press.button!r} is held down"
        return {
            "trial": window.trial if window else None,
            "attempt": window.attempt if window else None,
            "phase": phase,
            "press_t_s": self._recorder.session_time(press.time_s),
            "button": press.button,
            "response_time_s": response_time_s,
            "device_time_s": press.device_time_s,
            "meaning": meaning,
        }

    def _meaning(self, press: Press) -> Literal["felt", "other", "repeat"]:
        """Return what a press means; the first repeat of a key held down is known only by the second."""
        before = self._seen.get(press.button)
        gap_s = float("inf") if before is None else press.time_s - before.time_s
        self._seen[press.button] = _Seen(press.time_s, delayed=_REPEAT_S <= gap_s < _REPEAT_DELAY_S)
        if not press.felt:
            return "other"
        if gap_s >= _REPEAT_S:
            return "felt"
        if before is not None and before.delayed:
            self._take_back(before.time_s)
        return "repeat"

    def _take_back(self, time_s: float) -> None:
        """Take the press at a time for no answer: it was the first repeat of a key pressed before."""
        if self._windows and self._answer.response_time_s == round(time_s - self._windows[-1].onset_s, 6):
            self._answer.response_time_s = None

    def _unreadable(self, found: Unreadable) -> dict[str, Any]:
        window, phase = self._place(found.time_s)
        if found.may_be_answer and phase == "window" and window is self._windows[-1]:
            self._answer.doubt = self._answer.doubt or found.what
        happened_t_s = self._recorder.session_time(found.time_s)
        return {"device": "responder", "what": found.what, "happened_t_s": happened_t_s}

    def _place(self, time_s: float) -> tuple[TrialWindow | None, Phase]:
        window = next((w for w in reversed(self._windows) if time_s >= w.start_s), None)
        return window, window.phase(time_s) if window else "outside"

    def _tell_strange_buttons(self, inputs: Sequence[Input]) -> None:
        """Record as a fault, once for each button, that a button was pressed that does not mean felt."""
        for each in inputs:
            if isinstance(each, Press) and not each.felt and each.button not in self._strange:
                self._strange.add(each.button)
                what = f"button {each.button!r} was pressed, which does not mean felt; it does not count"
                happened_t_s = self._recorder.session_time(each.time_s)
                self._recorder.record(Fault, device="responder", what=what, happened_t_s=happened_t_s)
