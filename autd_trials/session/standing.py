"""Where a session stands: the one fold over its events, for records, resume, console and analysis."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Literal

from autd_trials.adaptive.answers import Answer
from autd_trials.protocol.plan import PlannedTrial, TrialType
from autd_trials.protocol.schema import Level, StimulusSpec
from autd_trials.session.events import (
    BlockStart,
    DeviceDescriptions,
    Event,
    Fault,
    Json,
    Pause,
    ResponseMade,
    Resume,
    SessionEnd,
    SessionStart,
    StimulusStart,
    TrialEnd,
    TrialStart,
)
from autd_trials.stimulus import Limits, exposure_s

Status = Literal["success", "aborted", "failed", "interrupted"]
"""How a session ended; interrupted: its log just stops (a crash), or it is still running."""

_LATEST_ONSET = timedelta(seconds=1.5)
"""A start command that was never logged had its onset at most this long after the trial began."""


@dataclass(frozen=True)
class Charge:
    """What an attempt at a trial counts for: its exposure in s at full drive, and when it emitted."""

    exposure_s: float
    onset: datetime
    duration_s: float

    @property
    def end(self) -> datetime:
        """When the burst ended."""
        return self.onset + timedelta(seconds=self.duration_s)


@dataclass
class BlockNow:
    """The block that runs, or ran last; `felt` and `stimuli` are for showing once it has ended."""

    block: int
    exposure_before_s: float
    ended: bool = False
    stimuli: int = 0
    felt: int = 0


@dataclass
class TrialNow:
    """The trial that runs, or ran last."""

    trial: int
    attempt: int
    trial_type: TrialType
    conditions: Mapping[str, Level | None]
    onset_t_s: float | None = None
    duration_s: float = 0.0
    felt: bool = False


@dataclass
class HealthNow:
    """The devices as they were seen last."""

    devices_ready: int | None = None
    thermal: bool = False
    checked_t_s: float | None = None
    margin_s: float | None = None
    underruns: int = 0
    last_fault: str | None = None


@dataclass
class Standing:
    """Where a session stands after the events that were taken in; read it, and only `take` changes it.

    Attributes
    ----------
    start
        The session's start.
    status, why
        How the session ended, and why.
    devices, rig, calibration_sha256
        What it runs on since it was last taken up.
    limits
        The limits under which both that rig and the protocol hold.
    complete
        Numbers of the trials that are complete.
    attempts
        Highest attempt so far of each trial that was started.
    answers
        By trial, the answers to stimuli whose level an adaptive method chose.
    charges
        By trial and attempt, what was charged: every attempt whose start command may have been given.
    exposure_s
        Exposure used so far, in s at full drive. It is computed from the plan, never read from a line.
    open_trial
        Trial and attempt that were started and never ended: the crash came in it.
    false_alarms
        Catch trials that were felt.
    last_response_time_s
        The last response time in s.
    block, trial, health, paused
        What goes on now; None before it does.
    last_t_s, last_utc
        When the last event was logged: session time in s, and wall-clock time.
    """

    start: SessionStart
    status: Status = "interrupted"
    why: str = "the log stops without a session's end"
    complete: set[int] = field(default_factory=set)
    attempts: dict[int, int] = field(default_factory=dict)
    answers: dict[int, Answer] = field(default_factory=dict)
    charges: dict[tuple[int, int], Charge] = field(default_factory=dict)
    exposure_s: float = 0.0
    open_trial: tuple[int, int] | None = None
    false_alarms: int = 0
    last_response_time_s: float | None = None
    block: BlockNow | None = None
    trial: TrialNow | None = None
    health: HealthNow = field(default_factory=HealthNow)
    paused: str | None = None

    def __post_init__(self) -> None:
        self.devices: DeviceDescriptions = self.start.devices
        self.rig: Json = self.start.rig
        self.calibration_sha256 = self.start.calibration_sha256
        self.limits = self.start.limits or _limits_of_version_1(self.start)
        self.last_t_s, self.last_utc = self.start.t_s, self.start.utc
        self._planned = {trial.trial: trial for trial in self.start.plan.trials}
        self._last_of_block = {trial.block: trial.trial for trial in self.start.plan.trials}
        self._levels: dict[tuple[int, int], Level | None] = {}

    @property
    def remaining(self) -> tuple[PlannedTrial, ...]:
        """The planned trials that are not complete, in the plan's order."""
        return tuple(trial for trial in self.start.plan.trials if trial.trial not in self.complete)

    @property
    def attempts_interrupted(self) -> int:
        """How many attempts at a trial do not count."""
        return sum(self.attempts.values()) - len(self.complete)

    @property
    def finished(self) -> bool:
        """Whether the session came to an end, good or bad."""
        return self.status != "interrupted"

    def take(self, event: Event) -> None:
        """Take in the next event; in time that does not depend on how many there were."""
        self.last_t_s, self.last_utc = event.t_s, event.utc
        match event:
            case BlockStart():
                self.block = BlockNow(event.block, self.exposure_s)
                self.trial = None
            case TrialStart():
                self._begin(event)
            case StimulusStart():
                self._stimulate(event)
            case ResponseMade() if event.phase == "window" and event.counts:
                self.last_response_time_s = event.response_time_s
                if self.trial is not None:
                    self.trial.felt = True
            case TrialEnd():
                self._finish(event)
            case Pause():
                self.paused = event.reason
            case Resume():
                self._go_on(event)
            case Fault():
                self.health.last_fault = event.what
                self.health.underruns += event.device == "masker" and event.what.startswith("underrun")
            case SessionEnd():
                self.status, self.why = event.status, event.why

    def _begin(self, event: TrialStart) -> None:
        self._run_on()
        key = event.trial, event.attempt
        self.open_trial = key
        self.attempts[event.trial] = max(event.attempt, self.attempts.get(event.trial, 0))
        method = self.start.protocol.method
        self._levels[key] = None if method is None else event.conditions.get(method.varies)
        self.trial = TrialNow(event.trial, event.attempt, event.trial_type, event.conditions)
        self._charge(key, datetime.fromisoformat(event.utc) + _LATEST_ONSET)

    def _stimulate(self, event: StimulusStart) -> None:
        self._run_on()
        key = event.trial, event.attempt
        self.attempts[event.trial] = max(event.attempt, self.attempts.get(event.trial, 0))
        self.health.margin_s = event.margin_s
        if self.trial is not None:
            self.trial.onset_t_s, self.trial.duration_s = event.onset_t_s, event.duration_s
        until_onset = timedelta(seconds=max(event.onset_t_s - event.t_s, 0.0))
        self._charge(key, datetime.fromisoformat(event.utc) + min(until_onset, _LATEST_ONSET))

    def _finish(self, event: TrialEnd) -> None:
        key = event.trial, event.attempt
        self.open_trial = None
        self.attempts[event.trial] = max(event.attempt, self.attempts.get(event.trial, 0))
        if event.started is False and key in self.charges:
            self.exposure_s -= self.charges.pop(key).exposure_s
        if event.status == "complete" and (planned := self._planned.get(event.trial)) is not None:
            self._complete(event, planned)

    def _complete(self, event: TrialEnd, planned: PlannedTrial) -> None:
        felt, catch = event.response == "felt", planned.trial_type == "catch"
        first_time = planned.trial not in self.complete
        self.complete.add(planned.trial)
        level = self._levels.get((event.trial, event.attempt))
        if isinstance(level, float):
            self.answers[event.trial] = Answer(level, felt)
        self.false_alarms += first_time and felt and catch
        if self.block is not None:
            self.block.stimuli += first_time and not catch
            self.block.felt += first_time and felt and not catch
            self.block.ended = event.trial == self._last_of_block[planned.block]
        self.health.devices_ready, self.health.thermal = event.devices_ready, bool(event.thermal)
        self.health.checked_t_s = event.t_s

    def _go_on(self, event: Resume) -> None:
        self._run_on()
        self.paused = self.trial = None
        if isinstance(event.devices, DeviceDescriptions):
            self.devices = event.devices
        self.rig = self.rig if event.rig is None else event.rig
        self.calibration_sha256 = event.calibration_sha256 or self.calibration_sha256
        self.limits = event.limits or self.limits

    def _run_on(self) -> None:
        """Forget an end after which the session was taken up again."""
        self.status, self.why = Standing.status, Standing.why

    def _charge(self, key: tuple[int, int], onset: datetime) -> None:
        planned = self._planned.get(key[0])
        if planned is None:
            return
        stimulus = self._presented(planned, self._levels.get(key))
        if key not in self.charges:
            self.exposure_s += exposure_s(stimulus)
        self.charges[key] = Charge(
            exposure_s(stimulus), onset, stimulus.duration_s if stimulus.drive > 0 else 0.0
        )

    def _presented(self, planned: PlannedTrial, level: Level | None) -> StimulusSpec:
        """Return a trial's stimulus at its level; at the largest, as planned, if the level is unknown."""
        method = self.start.protocol.method
        if method is None or planned.trial_type == "catch" or level not in method.levels:
            return planned.stimulus
        return planned.stimulus.model_copy(update={method.varies: level})


def standing(events: Iterable[Event]) -> Standing:
    """Return where a session stands after its events, of which the first is its start."""
    others = iter(events)
    start = next(others)
    assert isinstance(start, SessionStart)
    found = Standing(start)
    for event in others:
        found.take(event)
    return found


def _limits_of_version_1(start: SessionStart) -> Limits:
    """Return the limits of both, from what a log of version 1 has of its rig; a limit it lacks is not one."""
    limits = start.protocol.safety
    array = start.rig.get("array")
    rig = array.get("limits") if isinstance(array, dict) else None
    known = {
        name: min(getattr(limits, name), float(value))
        for name, value in (rig if isinstance(rig, dict) else {}).items()
        if name in Limits.model_fields and isinstance(value, int | float) and value > 0
    }
    return Limits(**{name: known.get(name, getattr(limits, name)) for name in Limits.model_fields})
