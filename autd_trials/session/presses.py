"""Which trial a press belongs to."""

from dataclasses import dataclass
from typing import Literal

from autd_trials.responses.responder import Press
from autd_trials.session.events import ResponseMade
from autd_trials.session.recorder import Recorder

Phase = Literal["outside", "before_onset", "window", "late"]


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
    """Records every press with its trial and its response time; none is dropped."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._windows: list[TrialWindow] = []
        self._response_time_s: float | None = None

    @property
    def response_time_s(self) -> float | None:
        """Response time in s of the first press in the newest trial's window; None if there was none."""
        return self._response_time_s

    def open_window(self, window: TrialWindow) -> None:
        """Begin a trial; the one before stays known, for presses that are read late."""
        self._windows = [*self._windows[-1:], window]
        self._response_time_s = None

    def take(self, presses: list[Press]) -> None:
        """Record presses, oldest first."""
        for press in presses:
            self._record(press)

    def _record(self, press: Press) -> None:
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
        self._recorder.record(
            ResponseMade,
            trial=window.trial if window else None,
            attempt=window.attempt if window else None,
            phase=phase,
            press_t_s=self._recorder.session_time(press.time_s),
            button=press.button,
            response_time_s=response_time_s,
            device_time_s=press.device_time_s,
        )
