"""What the experimenter wants to know, folded from the session's events."""

from dataclasses import dataclass, field, replace
from typing import Literal

from autd_trials.protocol.plan import Plan, PlannedTrial
from autd_trials.protocol.schema import Level, Timing
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

Phase = Literal[
    "waiting", "lead-in", "ready", "stimulus", "response window", "pause between", "paused", "ended"
]


@dataclass(frozen=True)
class Status:
    """A session at a glance.

    `felt_in_block`, `trials_in_block` and what `exposure_s` has over `exposure_before_block_s` are for
    showing once a block has ended; before, they would tell the experimenter who scores a raised hand how the
    participant is doing, and what is presented.
    """

    start: SessionStart | None = None
    emulated: bool = True
    array: str = ""
    masker: str = "none"
    block: int = 0
    block_ended: bool = False
    trial: int = 0
    trial_type: str = ""
    conditions: dict[str, Level | None] = field(default_factory=dict)
    completed: int = 0
    felt_in_block: int = 0
    trials_in_block: int = 0
    false_alarms: int = 0
    onset_t_s: float | None = None
    stimulus_s: float = 0.0
    window_s: float = 0.0
    last_response_time_s: float | None = None
    answered: bool = False
    margin_s: float | None = None
    devices_ready: int | None = None
    devices: int = 0
    thermal: bool = False
    checked_t_s: float | None = None
    exposure_s: float = 0.0
    exposure_before_block_s: float = 0.0
    exposure_budget_s: float = 0.0
    underruns: int = 0
    last_fault: str | None = None
    paused: str | None = None
    ended: str | None = None

    def phase_at(self, t_s: float) -> Phase:
        """Return the phase at session time `t_s` in s."""
        if self.ended is not None:
            return "ended"
        if self.paused is not None:
            return "paused"
        if self.block == 0:
            return "waiting"
        if self.trial == 0:
            return "lead-in"
        if self.onset_t_s is None or t_s < self.onset_t_s:
            return "ready"
        if t_s < self.onset_t_s + self.stimulus_s:
            return "stimulus"
        if t_s < self.onset_t_s + self.window_s:
            return "response window"
        return "pause between"

    def time_left_s(self) -> float:
        """Return the planned time from here to the end in s; breaks count with their shortest length."""
        if self.start is None:
            return 0.0
        return time_left_s(self.start.plan, self.start.protocol.timing, self.completed)


def time_left_s(plan: Plan, timing: Timing, completed: int) -> float:
    """Return the planned duration in s of the trials after the first `completed` ones."""
    left = plan.trials[completed:]
    blocks_ahead = len({trial.block for trial in left})
    trials_s = sum(trial.pause_before_s + timing.response_window_s for trial in left)
    return trials_s + blocks_ahead * timing.lead_in_s + max(0, blocks_ahead - 1) * timing.break_s


def fold(status: Status, event: Event) -> Status:
    """Return the status after an event."""
    match event:
        case SessionStart():
            return _started(event)
        case BlockStart():
            return replace(
                status,
                block=event.block,
                block_ended=False,
                trial=0,
                felt_in_block=0,
                trials_in_block=0,
                exposure_before_block_s=status.exposure_s,
            )
        case TrialStart():
            return replace(
                status,
                trial=event.trial,
                trial_type=event.trial_type,
                conditions=dict(event.conditions),
                onset_t_s=None,
                answered=False,
            )
        case StimulusStart():
            return replace(
                status,
                onset_t_s=event.onset_t_s,
                stimulus_s=event.duration_s,
                margin_s=event.margin_s,
                exposure_s=status.exposure_s + event.exposure_s,
            )
        case ResponseMade():
            if event.phase != "window":
                return status
            return replace(status, answered=True, last_response_time_s=event.response_time_s)
        case TrialEnd():
            return _trial_ended(status, event)
        case Pause():
            return replace(status, paused=event.reason)
        case Resume():
            return replace(status, paused=None, ended=None, trial=0)
        case Fault():
            underrun = event.device == "masker" and event.what.startswith("underrun")
            return replace(status, last_fault=event.what, underruns=status.underruns + underrun)
        case SessionEnd():
            return replace(status, ended=f"{event.status}: {event.why}")
        case _:
            return status


def _started(event: SessionStart) -> Status:
    array, masker = event.devices["array"], event.devices["masker"]
    return Status(
        start=event,
        emulated=bool(array["emulated"]),
        array=f"{array['driver']} on {array['link']}",
        devices=int(array["devices"]),
        masker=f"{masker['kind']} {masker['level_dbfs']:g} dBFS" if masker else "none",
        window_s=event.protocol.timing.response_window_s,
        exposure_budget_s=event.protocol.safety.session_exposure_s,
    )


def _trial_ended(status: Status, event: TrialEnd) -> Status:
    if event.status != "complete" or status.start is None:
        return status
    planned = _planned(status.start.plan, event.trial)
    felt = event.response == "felt"
    catch = planned.trial_type == "catch"
    last_of_block = max(t.trial for t in status.start.plan.trials if t.block == planned.block)
    return replace(
        status,
        completed=status.completed + 1,
        trials_in_block=status.trials_in_block + (not catch),
        felt_in_block=status.felt_in_block + (felt and not catch),
        false_alarms=status.false_alarms + (felt and catch),
        devices_ready=event.devices_ready,
        thermal=bool(event.thermal),
        checked_t_s=event.t_s,
        block_ended=event.trial == last_of_block,
    )


def _planned(plan: Plan, trial: int) -> PlannedTrial:
    return plan.trials[trial - 1]
