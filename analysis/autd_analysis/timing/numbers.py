"""Whether stimuli came when they were planned, what disturbed trials, and how fast people answered."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from autd_analysis.basics.intervals import Interval, t_interval
from autd_analysis.data.design import Condition, StudyFactor, conditions
from autd_analysis.data.trials import Trials

if TYPE_CHECKING:
    import pandas as pd

LATE_S = 0.001
"""An onset that is later than this is counted as late."""

VIRTUAL_TIME = "not measured: the sessions ran in virtual time"
NOT_KNOWN = "not known: participants were simulated, and a table does not say whether in real time"
NOT_RECORDED = "not recorded"

_TIMES = {
    "onset_lateness_s": "actual minus planned onset",
    "start_margin_s": "left between the accepted start command and the onset",
    "silent_before_s": "how long before the onset the array was last read back as silent",
    "emitting_after_s": "how long after the onset the array was first read back as emitting",
}
_COUNTS = {
    "presses_before_onset": "presses between a trial's beginning and its onset",
    "presses_late": "presses after the response window",
    "underruns": "gaps in the masking noise",
}


@dataclass(frozen=True)
class TimeSummary:
    """Times of one kind over complete stimulus trials that ran in real time.

    Attributes
    ----------
    name, about
        Which time, without its unit, and what it is.
    values_s
        The times in ascending order.
    note
        Why there is none, or what was left out.
    """

    name: str
    about: str
    values_s: tuple[float, ...]
    note: str | None

    @property
    def trials(self) -> int:
        """Number of trials that have it."""
        return len(self.values_s)

    @property
    def median_s(self) -> float | None:
        """The median; None without any."""
        return statistics.median(self.values_s) if self.values_s else None

    @property
    def late(self) -> int:
        """Number of times over `LATE_S`."""
        return sum(value > LATE_S for value in self.values_s)


@dataclass(frozen=True)
class CountSummary:
    """Events of one kind over all complete trials, catch trials included; `total` None if not recorded."""

    name: str
    about: str
    trials: int
    trials_with: int
    total: int | None


@dataclass(frozen=True)
class ParticipantResponseTime:
    """One participant's response times to felt stimuli of one condition; quartiles None without any."""

    participant: str
    condition: Condition
    values_s: tuple[float, ...]

    @property
    def quartiles_s(self) -> tuple[float, float, float] | None:
        """Lower quartile, median and upper quartile, interpolated linearly (Hyndman and Fan's type 7)."""
        if not self.values_s:
            return None
        low, median, high = np.quantile(self.values_s, (0.25, 0.5, 0.75))
        return float(low), float(median), float(high)


@dataclass(frozen=True)
class ConditionResponseTime:
    """Mean of participants' medians in one condition, with Student's t interval."""

    condition: Condition
    mean_s: float | None
    interval_s: Interval | None
    participants: int
    trials: int


@dataclass(frozen=True)
class Timing:
    """All that is known of the times of a study.

    Attributes
    ----------
    onsets, disturbances
        How well onsets were timed, and what disturbed trials.
    people
        Response times of every participant, over all conditions.
    participants, conditions
        Response times in every condition, of each participant and over participants.
    """

    onsets: tuple[TimeSummary, ...]
    disturbances: tuple[CountSummary, ...]
    people: tuple[ParticipantResponseTime, ...]
    participants: tuple[ParticipantResponseTime, ...]
    conditions: tuple[ConditionResponseTime, ...]

    @property
    def lateness(self) -> TimeSummary:
        """How late onsets were."""
        return next(times for times in self.onsets if times.name == "onset_lateness")


def timing(trials: Trials) -> Timing:
    """Return all that is known of the times of a study."""
    times = response_times(trials, trials.design.factors)
    return Timing(
        onsets=onset_times(trials),
        disturbances=disturbances(trials),
        people=tuple(time for time in response_times(trials, ()) if time.values_s),
        participants=times,
        conditions=response_times_over_participants(times),
    )


def onset_times(trials: Trials) -> tuple[TimeSummary, ...]:
    """Return how well onsets were timed.

    Only complete stimulus trials of sessions in real time count: in virtual time nothing can be late, so that
    a lateness there would say nothing of any machine.

    Parameters
    ----------
    trials
        The study's trials.
    """
    table = trials.table
    complete = table[(table["trial_status"] == "complete") & (table["trial_type"] == "stimulus")]
    virtual = {
        (session.start.participant, session.start.session)
        for session in trials.logged
        if session.start.virtual_time
    }
    unknown = trials.simulated and not trials.logged  # a table alone does not show whether time was real
    ran_virtually = [
        unknown or key in virtual for key in zip(complete["participant"], complete["session"], strict=True)
    ]
    measured = complete[~np.array(ran_virtually, dtype=bool)]
    why = NOT_KNOWN if unknown else VIRTUAL_TIME
    return tuple(_summary(name, about, complete, measured, why) for name, about in _TIMES.items())


def disturbances(trials: Trials) -> tuple[CountSummary, ...]:
    """Return how often someone pressed outside the response window, and gaps in the masking noise."""
    table = trials.table
    complete = table[(table["trial_status"] == "complete") & (table["trial_type"] != "practice")]
    return tuple(_count(name, about, complete) for name, about in _COUNTS.items())


def response_times(trials: Trials, factors: Sequence[StudyFactor]) -> tuple[ParticipantResponseTime, ...]:
    """Return response times to stimuli that were felt, for every participant and condition.

    Parameters
    ----------
    trials
        The study's trials.
    factors
        The factors that make the conditions; trials are pooled over others.
    """
    table = trials.table
    felt = table[table["used"] & (table["trial_type"] == "stimulus") & table["response_time_s"].notna()]
    felt = felt[felt["felt"].astype(bool)]
    found: dict[tuple[object, ...], list[float]] = {}
    keys = (felt[column] for column in ("participant", *(factor.name for factor in factors)))
    for *key, time_s in zip(*keys, felt["response_time_s"], strict=True):
        found.setdefault(tuple(key), []).append(time_s)
    return tuple(
        ParticipantResponseTime(
            participant,
            condition,
            tuple(sorted(found.get((participant, *(level for _, level in condition)), ()))),
        )
        for participant in trials.participants
        for condition in conditions(factors)
    )


def response_times_over_participants(
    times: Sequence[ParticipantResponseTime],
) -> tuple[ConditionResponseTime, ...]:
    """Summarise participants' medians, condition by condition, each participant counting the same."""
    by_condition: dict[Condition, list[ParticipantResponseTime]] = {}
    for each in times:
        by_condition.setdefault(each.condition, []).append(each)
    return tuple(_over_participants(condition, mine) for condition, mine in by_condition.items())


def _summary(
    name: str, about: str, complete: "pd.DataFrame", measured: "pd.DataFrame", why_none: str
) -> TimeSummary:
    values = tuple(sorted(measured[name].dropna().tolist()))
    recorded = int(complete[name].notna().sum())
    note = None
    if not recorded:
        note = NOT_RECORDED
    elif not values:
        note = why_none
    elif recorded > len(values):
        note = f"{recorded - len(values)} trial(s) in virtual time left out"
    return TimeSummary(name.removesuffix("_s"), about, values, note)


def _count(name: str, about: str, complete: "pd.DataFrame") -> CountSummary:
    counts = complete[name].dropna()
    return CountSummary(
        name,
        about,
        trials=len(counts),
        trials_with=int((counts > 0).sum()),
        total=int(counts.sum()) if len(counts) else None,
    )


def _over_participants(
    condition: Condition, times: Sequence[ParticipantResponseTime]
) -> ConditionResponseTime:
    medians = [each.quartiles_s[1] for each in times if each.quartiles_s]
    return ConditionResponseTime(
        condition,
        mean_s=statistics.fmean(medians) if medians else None,
        interval_s=t_interval(medians, bounds=(0.0, math.inf)),
        participants=len(medians),
        trials=sum(len(each.values_s) for each in times),
    )
