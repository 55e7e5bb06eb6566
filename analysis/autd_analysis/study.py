"""The analysis of a study: from its folder to all results."""

from dataclasses import dataclass
from pathlib import Path

from autd_analysis.comparisons import ComparisonResult, planned_comparisons
from autd_analysis.detectability import Detectability, GroupDetectability, detectability
from autd_analysis.detectability import over_participants as mean_detectability
from autd_analysis.interaction import Interaction, Trend, interactions, trends
from autd_analysis.models.cell_model import CellModel, cell_models
from autd_analysis.models.conditions import ConditionLogit, condition_logits
from autd_analysis.models.other_models import OtherEstimate, other_estimates
from autd_analysis.order_effects import OrderEffect, order_effects
from autd_analysis.pooled import WARNING as POOLED_WARNING
from autd_analysis.pooled import PooledTests, pooled_tests
from autd_analysis.psychometric.misfit import misfits
from autd_analysis.psychometric.options import DEFAULT, PsychometricOptions
from autd_analysis.psychometric.results import PsychometricResults, all_psychometric_results
from autd_analysis.rates import (
    ConditionRate,
    ParticipantRate,
    detection_rates,
    false_alarm_rates,
    marginal_rates,
    over_participants,
)
from autd_analysis.threshold_comparisons import ThresholdComparison, compared_thresholds
from autd_analysis.thresholds import GroupThreshold, Threshold, thresholds
from autd_analysis.thresholds import over_participants as mean_thresholds
from autd_analysis.trials import Trials, read_trials


@dataclass(frozen=True, eq=False)
class Results:
    """What the analysis of a study gives.

    Attributes
    ----------
    trials
        The trials, the design, the warnings, and whether the study is simulated.
    participant_rates, rates
        Detection rates in every condition, per participant and over participants.
    participant_false_alarms, false_alarms
        The same of false alarms, in every kind of block and over all of them; None without catch trials: the
        false-alarm rate is then undefined.
    comparisons
        The planned comparisons.
    detectability
        d' per participant; None without catch trials.
    interactions, trends
        Whether and how the compared differences depend on the other factor.
    order_effects
        Whether answers depend on when they were given.
    cell_models
        Mixed models of all answers: conditions' means and simple effects, by logit and probit.
    other_estimates
        The planned comparisons by GEE, conditional logistic regression and Firth's penalty.
    condition_logits
        Every condition's logit with Firth's penalty.
    psychometric
        Psychometric functions along every factor of three or more numbers.
    pooled
        Tests that take people for alike; None if they were not asked for.
    thresholds, threshold_comparisons
        Thresholds per participant and the planned comparisons of them, where an adaptive method chose the
        levels. Rates are then not compared: the method steers towards the same rate everywhere.
    """

    trials: Trials
    participant_rates: tuple[ParticipantRate, ...]
    rates: tuple[ConditionRate, ...]
    participant_false_alarms: tuple[ParticipantRate, ...] | None
    false_alarms: tuple[ConditionRate, ...] | None
    comparisons: tuple[ComparisonResult, ...]
    detectability: tuple[Detectability, ...] | None
    interactions: tuple[Interaction, ...]
    trends: tuple[Trend, ...]
    order_effects: tuple[OrderEffect, ...]
    cell_models: tuple[CellModel, ...]
    other_estimates: tuple[OtherEstimate, ...]
    condition_logits: tuple[ConditionLogit, ...]
    psychometric: tuple[PsychometricResults, ...]
    pooled: tuple[PooledTests, ...] | None
    thresholds: tuple[Threshold, ...]
    threshold_comparisons: tuple[ThresholdComparison, ...]

    @property
    def group_detectability(self) -> tuple[GroupDetectability, ...]:
        """D' over participants; empty without catch trials."""
        return mean_detectability(self.detectability or ())

    @property
    def group_thresholds(self) -> tuple[GroupThreshold, ...]:
        """Thresholds over participants; empty without an adaptive method."""
        return mean_thresholds(self.thresholds)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader should know about the data and the results."""
        return (
            *self.trials.warnings,
            *misfits(self.psychometric),
            *((POOLED_WARNING,) if self.pooled else ()),
        )

    @property
    def simulated(self) -> bool:
        """Whether any session was made by a simulated participant."""
        return self.trials.simulated


def analyse(study: Path, *, pooled: bool = False, psychometric: PsychometricOptions = DEFAULT) -> Results:
    """Analyse a study.

    Parameters
    ----------
    study
        The study's folder.
    pooled
        Whether to make the pooled tests too, which are wrong where people differ.
    psychometric
        The form of psychometric functions, and how their guess and lapse rates are found.

    Returns
    -------
    Results
        Rates, comparisons and warnings; the same files give the same results.

    Raises
    ------
    UsageError
        As `autd_analysis.trials.read_trials`.
    """
    return results_of(read_trials(study), pooled=pooled, psychometric=psychometric)


def results_of(
    trials: Trials, *, pooled: bool = False, psychometric: PsychometricOptions = DEFAULT
) -> Results:
    """Return all results of trials that were read."""
    rates = detection_rates(trials)
    conditions = over_participants(rates)
    steered = trials.design.method is not None  # by an adaptive method: rates tell nothing of conditions
    comparisons = () if steered else planned_comparisons(rates, trials.design)
    found = thresholds(trials)
    false_alarms_by_block = false_alarm_rates(trials)
    false_alarms = _with_all_blocks(false_alarms_by_block)
    return Results(
        trials=trials,
        participant_rates=rates,
        rates=conditions,
        participant_false_alarms=false_alarms,
        false_alarms=None if false_alarms is None else over_participants(false_alarms),
        comparisons=comparisons,
        detectability=None if steered else detectability(rates, false_alarms_by_block),
        interactions=interactions(comparisons),
        trends=trends(comparisons),
        order_effects=() if steered else order_effects(trials),
        cell_models=() if steered else cell_models(rates, trials.design),
        other_estimates=() if steered else other_estimates(rates, trials.design),
        condition_logits=() if steered else condition_logits(conditions),
        psychometric=all_psychometric_results(trials, psychometric),
        pooled=pooled_tests(rates, comparisons) if pooled else None,
        thresholds=found,
        threshold_comparisons=compared_thresholds(found, trials.design),
    )


def _with_all_blocks(rates: tuple[ParticipantRate, ...] | None) -> tuple[ParticipantRate, ...] | None:
    """Add the rates over all kinds of blocks, where there is more than one kind."""
    if rates is None or not any(rate.condition for rate in rates):
        return rates
    return rates + marginal_rates(rates, [])
