"""Whether a session may be run, judged over rig and protocol before anything is recorded."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

from autd_trials.array.driver import ArrayDriver
from autd_trials.errors import UnsafeError
from autd_trials.protocol.plan import Plan, PlannedTrial
from autd_trials.protocol.schema import Protocol, Timing
from autd_trials.session.adaptive_runs import possible_stimuli, run_of
from autd_trials.session.devices import array_stimulus
from autd_trials.stimulus import Excess, Limits, duty_of_equal_bursts, exposure_s, total_exposure_s

_FEW_TRIALS = 10
"""An adaptive run with fewer trials hardly gets away from where it began."""


@dataclass(frozen=True)
class Used:
    """What was emitted before the session begins or goes on.

    Parameters
    ----------
    session_s, today_s
        Exposure in s at full drive: of this session, and of its participant in the last 24 h (this session's
        is part of it).
    bursts
        When bursts of the participant began and ended, by the wall clock; the newest last.
    """

    session_s: float = 0.0
    today_s: float = 0.0
    bursts: tuple[tuple[datetime, datetime], ...] = ()


@dataclass(frozen=True)
class Preflight:
    """What a session would be.

    Parameters
    ----------
    trials, blocks
        How many there are to do.
    shortest_s
        How long that takes at least.
    exposure_s, largest_exposure_s
        Of all stimuli together and of the largest one, in s at full drive.
    duty
        The largest share of on-time in any 60 s, if the longest bursts follow each other after the shortest
        pauses.
    limits, used
        What holds, and what was used before.
    adaptive_trials
        The trials of the shortest adaptive run; None for constant stimuli.
    """

    trials: int
    blocks: int
    shortest_s: float
    exposure_s: float
    largest_exposure_s: float
    duty: float
    limits: Limits
    used: Used
    adaptive_trials: int | None

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is allowed and should still be known."""
        left_s = min(
            self.limits.session_exposure_s - self.used.session_s,
            self.limits.daily_exposure_s - self.used.today_s,
        )
        remarks = []
        if left_s - self.exposure_s < self.largest_exposure_s:
            remarks.append(
                f"the exposure limits leave {left_s - self.exposure_s:g} s, not enough to run a trial again "
                "that was interrupted: such a session could not be finished"
            )
        if self.adaptive_trials is not None and self.adaptive_trials < _FEW_TRIALS:
            remarks.append(
                f"the shortest adaptive run has {self.adaptive_trials} trials: few for a threshold"
            )
        return tuple(remarks)


def preflight(
    protocol: Protocol,
    plan: Plan,
    array: ArrayDriver,
    limits: Limits,
    used: Used,
    trials: Iterable[PlannedTrial],
) -> Preflight:
    """Judge the trials of a session that are to be run.

    What is judged depends on the protocol and not on the order that was drawn for this session: what may be
    run once may always be run.

    Parameters
    ----------
    protocol, plan
        What is to be done.
    array
        The array, which need not be open; it knows its reach, its ears and its devices.
    limits
        The limits under which both rig and protocol hold.
    used
        What was emitted before.
    trials
        The plan's trials that are to be run.

    Raises
    ------
    UnsafeError, UsageError
        The session could not be run to its end.
    """
    to_do = tuple(trials)
    array.check([array_stimulus(protocol, trial) for trial in to_do])
    for stimulus in possible_stimuli(protocol, to_do):
        array.check([stimulus])
    stimuli = [trial.stimulus for trial in to_do]
    found = Preflight(
        trials=len(to_do),
        blocks=len({trial.block for trial in to_do}),
        shortest_s=shortest_s(to_do, protocol.timing),
        exposure_s=total_exposure_s(stimuli),
        largest_exposure_s=max(map(exposure_s, stimuli), default=0.0),
        duty=largest_duty_of(to_do, protocol.timing),
        limits=limits,
        used=used,
        adaptive_trials=_shortest_run(protocol, plan),
    )
    _refuse(limits.excess("largest_duty", found.duty))
    _refuse(limits.excess("session_exposure_s", used.session_s + found.exposure_s))
    _refuse(limits.excess("daily_exposure_s", used.today_s + found.exposure_s))
    return found


def shortest_s(trials: Iterable[PlannedTrial], timing: Timing) -> float:
    """Return how long trials take at least, in s; breaks count with their shortest length."""
    listed = list(trials)
    blocks = len({trial.block for trial in listed})
    trials_s = sum(trial.pause_before_s + timing.response_window_s for trial in listed)
    return trials_s + blocks * timing.lead_in_s + max(0, blocks - 1) * timing.break_s


def largest_duty_of(trials: Iterable[PlannedTrial], timing: Timing) -> float:
    """Return the largest share of on-time in any 60 s that some order of the trials and pauses could have."""
    burst_s = max((t.stimulus.duration_s for t in trials if t.stimulus.drive > 0), default=0.0)
    return duty_of_equal_bursts(burst_s, max(burst_s, timing.response_window_s) + timing.pause_min_s)


def _shortest_run(protocol: Protocol, plan: Plan) -> int | None:
    method = protocol.method
    if method is None:
        return None
    runs = Counter(run_of(trial, method) for trial in plan.trials if trial.trial_type == "stimulus")
    return min(runs.values(), default=0)


def _refuse(excess: Excess | None) -> None:
    if excess is not None:
        raise UnsafeError(
            str(excess),
            do="change the protocol; a limit is changed only by whoever answers for the participants' safety",
        )
