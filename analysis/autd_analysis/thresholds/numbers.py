"""Thresholds of adaptive studies, as the method itself estimates them: of each participant and over them.

An adaptive run (the trials of one condition in one session) gives a threshold by its method: the mean of a
staircase's reversals, or the mean of QUEST+'s posterior. Thresholds are averaged and compared in dB (20 log10
of the level), where people's differences do not depend on how sensitive they are.
"""

import math
import statistics
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from autd_analysis.basics.intervals import Interval, t_interval
from autd_analysis.data.design import Condition, Design, conditions
from autd_analysis.data.trials import Trials
from autd_trials.adaptive.answers import Answer, Estimate
from autd_trials.adaptive.rule import rule_of
from autd_trials.protocol.method import Method
from autd_trials.protocol.schema import Level

THRESHOLD_INTERVAL = "95 % t interval over participants' thresholds in dB"


@dataclass(frozen=True)
class Threshold:
    """One participant's threshold in a condition.

    Attributes
    ----------
    participant, condition
        Whose, and where.
    threshold
        The level felt at `rate`, a geometric mean over the sessions that determine it, weighted by their
        trials; None if none does, or if it lies beyond the levels in one.
    rate
        The rate of "felt" that the threshold is for.
    spread_db
        Standard deviation in dB: of the posterior, or over the reversals; the largest of the sessions.
    trials
        Number of trials.
    beyond
        1 or -1 where there is none because it lies over the largest or under the smallest level, else 0.
    note
        Why there is none, or what to know about it.
    """

    participant: str
    condition: Condition
    threshold: float | None
    rate: float
    spread_db: float | None
    trials: int
    beyond: int
    note: str | None

    @property
    def db(self) -> float | None:
        """The threshold in dB."""
        return None if self.threshold is None else 20 * math.log10(self.threshold)


@dataclass(frozen=True)
class GroupThreshold:
    """Geometric mean of participants' thresholds in a condition, with its interval; None where undefined.

    `undetermined` counts participants whose adaptive runs there determine no threshold; `over` and `under`
    those of them whose threshold lies over the largest or under the smallest level. They are not in the mean,
    which is too low or too high by that.
    """

    condition: Condition
    threshold: float | None
    interval: Interval | None
    participants: int
    undetermined: int
    over: int
    under: int


def thresholds(trials: Trials, method: Method) -> tuple[Threshold, ...]:
    """Return each participant's threshold in each condition."""
    design = trials.design
    runs = _runs(trials, design, method)
    return tuple(
        _threshold(participant, condition, method, runs[participant, frozenset(condition)])
        for participant in trials.participants
        for condition in conditions(design.factors)
    )


def over_participants(found: Sequence[Threshold]) -> tuple[GroupThreshold, ...]:
    """Return the means over participants in each condition."""
    groups = []
    for condition in dict.fromkeys(each.condition for each in found):
        there = [each for each in found if each.condition == condition]
        db = [each.db for each in there if each.db is not None]
        interval_db = t_interval(db)
        groups.append(
            GroupThreshold(
                condition=condition,
                threshold=_level(statistics.fmean(db)) if db else None,
                interval=interval_db and Interval(_level(interval_db.low), _level(interval_db.high)),
                participants=len(db),
                undetermined=sum(each.threshold is None and each.trials > 0 for each in there),
                over=sum(each.beyond == 1 for each in there),
                under=sum(each.beyond == -1 for each in there),
            )
        )
    return tuple(groups)


def _runs(
    trials: Trials, design: Design, method: Method
) -> defaultdict[tuple[str, frozenset[tuple[str, Level]]], dict[str, list[Answer]]]:
    """Return the answers by participant and condition, and by session within."""
    table = trials.table
    kept = table[table["used"] & (table["trial_type"] == "stimulus")].sort_values(["session", "trial"])
    names = [factor.name for factor in design.factors]
    found: defaultdict[tuple[str, frozenset[tuple[str, Level]]], dict[str, list[Answer]]] = defaultdict(dict)
    columns = (kept[name] for name in ("participant", "session", "felt", method.varies, *names))
    for participant, session, felt, level, *levels in zip(*columns, strict=True):
        key = (participant, frozenset(zip(names, levels, strict=True)))
        found[key].setdefault(session, []).append(Answer(float(level), bool(felt)))
    return found


def _threshold(
    participant: str, condition: Condition, method: Method, sessions: dict[str, list[Answer]]
) -> Threshold:
    rule = rule_of(method)
    estimates = [(rule.estimate(answers), len(answers)) for answers in sessions.values()]
    estimates = estimates or [(rule.estimate([]), 0)]
    beyond = [estimate.beyond for estimate, _ in estimates if estimate.beyond]
    told = [] if beyond else [pair for pair in estimates if pair[0].threshold is not None]
    notes = dict.fromkeys(estimate.note for estimate, _ in estimates if estimate.note)
    if told and len(told) < len(estimates):
        notes[f"{len(estimates) - len(told)} session(s) that determine no threshold are excluded"] = None
    spreads = [estimate.spread_db for estimate, _ in told if estimate.spread_db is not None]
    return Threshold(
        participant=participant,
        condition=condition,
        threshold=_weighted_mean(told),
        rate=estimates[0][0].rate,
        spread_db=max(spreads, default=None),
        trials=sum(map(len, sessions.values())),
        beyond=common_sign(beyond) if beyond else 0,
        note="; ".join(notes) or None,
    )


def _weighted_mean(told: Sequence[tuple[Estimate, int]]) -> float | None:
    """Return the geometric mean of sessions' thresholds, each weighted by its trials; None without any."""
    logs = [math.log(estimate.threshold) for estimate, _ in told if estimate.threshold is not None]
    trials = [number for _, number in told]
    return math.exp(statistics.fmean(logs, weights=trials)) if logs else None


def common_sign(values: Sequence[int]) -> int:
    """Return the sign that all share, or 0."""
    return values[0] if len(set(values)) == 1 else 0


def _level(db: float) -> float:
    return float(10 ** (db / 20))
