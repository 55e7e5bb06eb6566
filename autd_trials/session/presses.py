"""Which trial a press belongs to."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from autd_trials.errors import DeviceError
from autd_trials.responses.responder import Press
from autd_trials.session.events import ResponseMade
from autd_trials.session.recorder import Recorder

Phase = Literal["outside", "before_onset", "window", "late"]

MOST_PRESSES, IN_S = 50, 1.0
"""More presses than that come from no person: a key held down repeats some 30 times a second."""


@dataclass(frozen=True)
class TrialWindow:
    """When a trial listens, on the host's clock."""

    trial: int
    attempt: int
    start_s: float
    onset_s: float
    end_s: float

    def phase(self, press: Press) -> Phase:
        """Return where a press not before the trial's start falls."""
        if press.time_s < self.onset_s:
            return "before_onset"
        return "window" if press.time_s <= self.end_s else "late"


class PressBook:
    """Records every press with its trial and its response time, in bounded work a call.

    A device that sends more than `MOST_PRESSES` in `IN_S` has failed: what came until then is recorded, what
    came with it is counted in the fault.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._windows: list[TrialWindow] = []
        self._response_time_s: float | None = None
        self._newest: deque[float] = deque(maxlen=MOST_PRESSES)

    @property
    def response_time_s(self) -> float | None:
        """Response time in s of the first press in the newest trial's window; None if there was none."""
        return self._response_time_s

    def open_window(self, window: TrialWindow) -> None:
        """Begin a trial; the one before stays known, for presses that are read late."""
        self._windows = [*self._windows[-1:], window]
        self._response_time_s = None

    def take(self, presses: Sequence[Press]) -> None:
        """Record presses, oldest first, with one wait for the disk.

        Raises
        ------
        DeviceError
            They come too fast to be a person's.
        """
        kept = list(self._until_they_flood(presses))
        self._recorder.record_all(ResponseMade, [self._fields(press) for press in kept])
        if len(kept) < len(presses):
            raise DeviceError(
                f"more than {MOST_PRESSES} presses in {IN_S:g} s; "
                f"{len(presses) - len(kept)} of them were not recorded",
                where="responder",
                do="look for a button or a key that sticks, and check the box's protocol; then go on",
            )

    def _until_they_flood(self, presses: Sequence[Press]) -> Iterator[Press]:
        for press in presses:
            if len(self._newest) == MOST_PRESSES and press.time_s - self._newest[0] < IN_S:
                self._newest.clear()
                return
            self._newest.append(press.time_s)
            yield press

    def _fields(self, press: Press) -> dict[str, Any]:
        window = next((w for w in reversed(self._windows) if press.time_s >= w.start_s), None)
        phase: Phase = window.phase(press) if window else "outside"
        response_time_s = round(press.time_s - window.onset_s, 6) if window else None
        if (
            window is not None
            and window is self._windows[-1]
            and phase == "window"
            and self._response_time_s is None
        ):
            self._response_time_s = response_time_s
        return {
            "trial": window.trial if window else None,
            "attempt": window.attempt if window else None,
            "phase": phase,
            "press_t_s": self._recorder.session_time(press.time_s),
            "button": press.button,
            "response_time_s": response_time_s,
            "device_time_s": press.device_time_s,
        }
