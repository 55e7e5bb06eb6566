"""Detection and false-alarm rates, per participant and over participants."""

import dataclasses
import statistics
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from autd_analysis.basics.bootstrap import bootstrap_interval
from autd_analysis.basics.intervals import (
    Interval,
    clopper_pearson_interval,
    jeffreys_interval,
    t_interval,
    wilson_interval,
)
from autd_analysis.data.design import Condition, StudyFactor, conditions
from autd_analysis.data.trials import Trials
from autd_analysis.rates.beta_binomial import BetaBinomial, fit_beta_binomial
from autd_trials.protocol.schema import Level

PARTICIPANT_INTERVAL = "95 % Wilson score interval, trials taken as independent"
GROUP_INTERVAL = "95 % t interval over participants, ends kept within 0..1"


@dataclass(frozen=True)
class ParticipantRate:
    """One participant's rate in one condition.

    Attributes
    ----------
    participant
        The label.
    condition
        The factors' levels; factors that are not named are averaged over.
    felt, n
        Trials felt, and trials counted.
    rate
        The rate as an exact fraction, so that equal rates are equal; None without trials. Where factors are
        averaged over it is the mean of their cells' rates, and None if a cell has no trial.
    interval
        Wilson interval; None without trials or where cells were averaged.
    """

    participant: str
    condition: Condition
    felt: int
    n: int
    rate: Fraction | None
    interval: Interval | None

    @property
    def clopper_pearson(self) -> Interval | None:
        """The exact interval; None where there is no Wilson interval."""
        return clopper_pearson_interval(self.felt, self.n) if self.interval else None

    @property
    def jeffreys(self) -> Interval | None:
        """Jeffreys' interval; None where there is no Wilson interval."""
        return jeffreys_interval(self.felt, self.n) if self.interval else None


@dataclass(frozen=True)
class ConditionRate:
    """The rate in one condition over participants, each counting the same.

    Attributes
    ----------
    condition
        The factors' levels.
    mean
        Mean of the participants' rates; None without any.
    interval
        t interval over participants; None with one participant or if all have the same rate.
    bootstrap
        Interval by the participant bootstrap; None likewise.
    beta_binomial
        The beta-binomial model of the counts; None where it cannot be fitted or cells were averaged.
    participants
        Number of participants who have a rate there.
    felt, n
        Trials felt, and trials counted, of these participants.
    """

    condition: Condition
    mean: float | None
    interval: Interval | None
    bootstrap: Interval | None
    beta_binomial: BetaBinomial | None
    participants: int
    felt: int
    n: int


@dataclass(frozen=True)
class Rates:
    """A study's rates.

    Attributes
    ----------
    participants, conditions
        Detection rates in every condition, of each participant and over participants.
    block_false_alarms
        Each participant's false alarms in every kind of block; None without catch trials: the false-alarm
        rate is then undefined.
    participant_false_alarms, false_alarms
        Likewise, and over all kinds of blocks; of each participant and over participants.
    """

    participants: tuple[ParticipantRate, ...]
    conditions: tuple[ConditionRate, ...]
    block_false_alarms: tuple[ParticipantRate, ...] | None
    participant_false_alarms: tuple[ParticipantRate, ...] | None
    false_alarms: tuple[ConditionRate, ...] | None


def all_rates(trials: Trials) -> Rates:
    """Return detection and false-alarm rates, of each participant and over participants."""
    rates = detection_rates(trials)
    by_block = false_alarm_rates(trials)
    false_alarms = None if by_block is None else _with_all_blocks(by_block)
    return Rates(
        participants=rates,
        conditions=over_participants(rates),
        block_false_alarms=by_block,
        participant_false_alarms=false_alarms,
        false_alarms=None if false_alarms is None else over_participants(false_alarms),
    )


def detection_rates(trials: Trials) -> tuple[ParticipantRate, ...]:
    """Return how often each participant felt the stimulus, for every condition of the study.

    Parameters
    ----------
    trials
        The study's trials.

    Returns
    -------
    tuple of ParticipantRate
        For every participant and every combination of levels, also those without a trial.
    """
    return _count(trials, "stimulus", trials.design.factors)


def false_alarm_rates(trials: Trials) -> tuple[ParticipantRate, ...] | None:
    """Return how often each participant answered "felt" on catch trials, for every kind of block.

    Parameters
    ----------
    trials
        The study's trials.

    Returns
    -------
    tuple of ParticipantRate or None
        None if no catch trial was counted: the false-alarm rate is then undefined, not 0.
    """
    table = trials.table
    if not (table["used"] & (table["trial_type"] == "catch")).any():
        return None
    return _count(trials, "catch", trials.design.between_blocks)


def marginal_rates(
    rates: Sequence[ParticipantRate], factors: Sequence[StudyFactor]
) -> tuple[ParticipantRate, ...]:
    """Average each participant's rates over all factors but the given ones.

    Cells count the same whatever their number of trials, so that a lost trial does not shift the mean
    towards the other cells.

    Parameters
    ----------
    rates
        Rates in the single cells.
    factors
        The factors to keep.

    Returns
    -------
    tuple of ParticipantRate
        For every participant and every combination of the kept factors' levels.
    """
    kept = {factor.name for factor in factors}
    cells: dict[tuple[str, frozenset[tuple[str, Level]]], list[ParticipantRate]] = defaultdict(list)
    for rate in rates:
        cells[rate.participant, frozenset(pair for pair in rate.condition if pair[0] in kept)].append(rate)
    return tuple(
        _mean_of_cells(participant, condition, cells[participant, frozenset(condition)])
        for participant in dict.fromkeys(rate.participant for rate in rates)
        for condition in conditions(factors)
    )


def over_participants(rates: Sequence[ParticipantRate]) -> tuple[ConditionRate, ...]:
    """Summarise participants' rates, condition by condition.

    Parameters
    ----------
    rates
        Participants' rates, each condition of each participant once.

    Returns
    -------
    tuple of ConditionRate
        In the conditions' order.
    """
    return tuple(
        _over_participants(condition, [rate for rate in rates if rate.condition == condition])
        for condition in dict.fromkeys(rate.condition for rate in rates)
    )


def _with_all_blocks(rates: tuple[ParticipantRate, ...]) -> tuple[ParticipantRate, ...]:
    """Add the rates over all kinds of blocks, where there is more than one kind."""
    return rates + marginal_rates(rates, []) if any(rate.condition for rate in rates) else rates


def _count(trials: Trials, trial_type: str, factors: Sequence[StudyFactor]) -> tuple[ParticipantRate, ...]:
    table = trials.table
    counted = table[table["used"] & (table["trial_type"] == trial_type)]
    keys = ["participant", *(factor.name for factor in factors)]
    answers = counted.groupby(keys, observed=True)["felt"].agg(["sum", "count"])
    counts = {_as_tuple(key): (int(felt), int(n)) for key, felt, n in answers.itertuples()}
    return tuple(
        _participant_rate(
            participant, condition, *counts.get((participant, *(level for _, level in condition)), (0, 0))
        )
        for participant in trials.participants
        for condition in conditions(factors)
    )


def _as_tuple(key: object) -> tuple[object, ...]:
    """Return a group's key as a tuple; pandas gives the bare value for a single column."""
    return key if isinstance(key, tuple) else (key,)


def _participant_rate(participant: str, condition: Condition, felt: int, n: int) -> ParticipantRate:
    rate = Fraction(felt, n) if n else None
    return ParticipantRate(participant, condition, felt, n, rate, wilson_interval(felt, n))


def _mean_of_cells(
    participant: str, condition: Condition, cells: Sequence[ParticipantRate]
) -> ParticipantRate:
    if len(cells) == 1:
        return dataclasses.replace(cells[0], condition=condition)
    known = [cell.rate for cell in cells if cell.rate is not None]
    return ParticipantRate(
        participant,
        condition,
        felt=sum(cell.felt for cell in cells),
        n=sum(cell.n for cell in cells),
        rate=Fraction(sum(known), len(known)) if known and len(known) == len(cells) else None,
        interval=None,
    )


def _over_participants(condition: Condition, rates: Sequence[ParticipantRate]) -> ConditionRate:
    present = [rate for rate in rates if rate.rate is not None]
    exact = [rate.rate for rate in present if rate.rate is not None]
    values = [float(rate) for rate in exact]
    averaged = any(rate.interval is None for rate in present)
    return ConditionRate(
        condition=condition,
        mean=statistics.fmean(values) if values else None,
        interval=t_interval(values, bounds=(0.0, 1.0)),
        bootstrap=bootstrap_interval(exact),
        beta_binomial=None if averaged else fit_beta_binomial([(rate.felt, rate.n) for rate in present]),
        participants=len(present),
        felt=sum(rate.felt for rate in present),
        n=sum(rate.n for rate in present),
    )
