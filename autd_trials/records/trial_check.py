"""Whether what a log says of its trials agrees with its plan, its protocol and itself."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from autd_trials.protocol.plan import PlannedTrial
from autd_trials.protocol.schema import StimulusSpec
from autd_trials.session.adaptive_runs import AdaptiveRuns
from autd_trials.session.events import (
    BlockStart,
    Event,
    Fault,
    Pause,
    ResponseMade,
    Resume,
    SessionEnd,
    SessionStart,
    StimulusStart,
    TrialEnd,
    TrialStart,
)

Found = Iterator[tuple[int, str]]
_ROUNDING_S = 2.5e-6
"""Times are logged to 1 us; a difference of three may be off by this."""

_EARLY_S = 0.02
"""A trial listens from a moment before its first line is stamped."""

_DEVICE_CLOCK_S, _DEVICE_CLOCK_DRIFT = 0.02, 1e-4
"""How far the devices' clock and the host's may run apart from one stimulus to the next."""


def untrue(events: Iterable[tuple[int, Event]], start: SessionStart) -> Found:
    """Yield the line and what is wrong with it, for each statement about a trial that cannot be true."""
    trials = _Trials(start)
    for line, event in events:
        for what in trials.take(event):
            yield line, what


@dataclass
class _Attempt:
    """What was said so far of an attempt at a trial."""

    planned: PlannedTrial
    start: TrialStart
    stimulus: StimulusStart | None = None
    presses: list[ResponseMade] = field(default_factory=list)
    masker_faults: int = 0


class _Trials:
    """Follows the trials of a session through its events."""

    def __init__(self, start: SessionStart) -> None:
        self._protocol = start.protocol
        self._window_s = start.protocol.timing.response_window_s
        self._plan = {trial.trial: trial for trial in start.plan.trials}
        self._adaptive_runs = AdaptiveRuns(start.protocol.method, start.plan, {})
        self._attempts: dict[tuple[int, int], _Attempt] = {}
        self._running: _Attempt | None = None
        self._ready_t_s: float | None = None
        self._clocks: tuple[float, int] | None = None
        self._ear_levels: dict[tuple[str, float], float | None] = {}

    def take(self, event: Event) -> Iterator[str]:
        """Go one event on; yield what is wrong with it."""
        match event:
            case TrialStart():
                yield from self._take_start(event)
            case StimulusStart():
                yield from self._take_stimulus(event)
            case ResponseMade():
                yield from self._take_response(event)
            case TrialEnd():
                yield from self._take_end(event)
            case Fault():
                if self._running is not None and event.device == "masker":
                    self._running.masker_faults += 1
            case Resume():
                self._ready_t_s = None
                if event.after_crash or event.devices or self._running is None:
                    self._clocks = None
                    self._ear_levels.clear()
            case BlockStart() | Pause() | SessionEnd():
                self._ready_t_s = None
            case _:
                pass

    def _take_start(self, event: TrialStart) -> Iterator[str]:
        planned = self._adaptive_runs.at_its_level(self._plan[event.trial])
        if event.conditions != planned.conditions:
            yield f"the conditions of trial {event.trial} are not those of the plan and the answers before"
        self._running = _Attempt(planned, event)
        self._attempts[event.trial, event.attempt] = self._running

    def _take_stimulus(self, event: StimulusStart) -> Iterator[str]:
        attempt = self._attempts.get((event.trial, event.attempt))
        if attempt is None:
            return
        attempt.stimulus = event
        spec = attempt.planned.stimulus
        if (event.drive, event.duration_s) != (spec.drive, spec.duration_s):
            yield f"drive or duration of trial {event.trial} are not those of the plan"
        exposure_s = spec.drive**2 * spec.duration_s
        if abs(event.exposure_s - exposure_s) > 1e-9 * max(1.0, exposure_s):
            yield f"the exposure of trial {event.trial} is {event.exposure_s:g} s, not {exposure_s:g} s"
        yield from self._onset(event, attempt)
        yield from self._ear_level(event, spec)

    def _onset(self, event: StimulusStart, attempt: _Attempt) -> Iterator[str]:
        if event.onset_t_s < event.planned_onset_t_s - _ROUNDING_S:
            yield "the onset lies before the planned one"
        accepted_t_s = event.onset_t_s - event.margin_s
        if not attempt.start.t_s - _EARLY_S <= accepted_t_s <= event.t_s + _ROUNDING_S:
            yield "the start command was not given between the trial's start and this line"
        if self._ready_t_s is not None:
            due_t_s = self._ready_t_s + attempt.planned.pause_before_s
            if abs(event.planned_onset_t_s - due_t_s) > 2 * _ROUNDING_S:
                yield (
                    f"the planned onset is {event.planned_onset_t_s:.6f} s, but the window before and the "
                    f"pause come to {due_t_s:.6f} s"
                )
        if self._clocks is not None:
            host_s = event.onset_t_s - self._clocks[0]
            device_s = (event.device_ns - self._clocks[1]) / 1e9
            if abs(host_s - device_s) > _DEVICE_CLOCK_S + _DEVICE_CLOCK_DRIFT * abs(host_s):
                yield (
                    f"since the stimulus before, the devices' clock went on by {device_s:.6g} s and the "
                    f"host's by {host_s:.6g} s"
                )
        self._clocks = (event.onset_t_s, event.device_ns)

    def _ear_level(self, event: StimulusStart, spec: StimulusSpec) -> Iterator[str]:
        if event.drive == 0:
            if event.ear_level_db is not None:
                yield "a level at the ears, where nothing was emitted"
            return
        known = self._ear_levels.setdefault((spec.target, event.drive), event.ear_level_db)
        if known != event.ear_level_db:
            yield "the level at the ears is not the one predicted for the same stimulus before"

    def _take_response(self, event: ResponseMade) -> Iterator[str]:
        if event.trial is None or event.attempt is None:
            if (event.phase, event.response_time_s) != ("outside", None):
                yield "a press outside the trials has a response time"
            return
        attempt = self._attempts.get((event.trial, event.attempt))
        if attempt is None or attempt.stimulus is None:
            return
        attempt.presses.append(event)
        onset_t_s = attempt.stimulus.onset_t_s
        since_s = event.press_t_s - onset_t_s
        if event.response_time_s is None or abs(event.response_time_s - since_s) > _ROUNDING_S:
            yield f"the response time is {event.response_time_s} s, not {since_s:.6f} s as the press says"
        if event.phase not in self._phases(since_s):
            yield f"a press {since_s:.6f} s after the onset is called {event.phase}"
        if event.press_t_s < attempt.start.t_s - _EARLY_S:
            yield "a press before the trial to which it is counted"
        newer = [a for a in self._attempts.values() if a.stimulus and a.start.t_s > attempt.start.t_s]
        if any(event.press_t_s > other.start.t_s for other in newer):
            yield "a press in a later trial than the one to which it is counted"

    def _phases(self, since_s: float) -> set[str]:
        """Return what a press may be called; two at a border, because of rounding."""
        return {
            "before_onset" if moment_s < 0 else "window" if moment_s <= self._window_s else "late"
            for moment_s in (since_s - _ROUNDING_S, since_s, since_s + _ROUNDING_S)
        }

    def _take_end(self, event: TrialEnd) -> Iterator[str]:
        attempt = self._attempts.get((event.trial, event.attempt))
        self._running, self._ready_t_s = None, None
        if attempt is None:
            return
        if event.underruns < 0 or event.underruns > attempt.masker_faults:
            yield f"{event.underruns} gaps in the masking noise, but {attempt.masker_faults} were logged"
        if event.status == "interrupted":
            if event.response is not None or event.response_time_s is not None:
                yield "an interrupted trial has an answer"
            return
        first = next((press for press in attempt.presses if press.phase == "window"), None)
        response_time_s = first.response_time_s if first else None
        if (event.response, event.response_time_s) != ("felt" if first else "not_felt", response_time_s):
            yield (
                f"the answer to trial {event.trial} is {event.response} ({event.response_time_s}), but its "
                f"presses say {'felt' if first else 'not_felt'} ({response_time_s})"
            )
        self._adaptive_runs.take_in(attempt.planned, felt=event.response == "felt")
        if attempt.stimulus is None:
            return
        end_t_s = attempt.stimulus.onset_t_s + self._window_s
        self._ready_t_s = end_t_s
        if event.t_s < end_t_s - _ROUNDING_S:
            yield f"trial {event.trial} ends before its response window"
        if event.silent_before_s is not None and event.silent_before_s < 0:
            yield "the array was silent after the onset"
        if event.emitting_after_s is not None and event.emitting_after_s < -_DEVICE_CLOCK_S:
            yield "the array emitted before the onset"
