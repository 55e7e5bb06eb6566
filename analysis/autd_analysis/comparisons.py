"""The planned comparisons: two levels of a factor, within participants, at each level of another factor."""

import dataclasses
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from autd_analysis.adjustment import holm
from autd_analysis.design import Condition, Design, conditions
from autd_analysis.exact import Wilcoxon, bayes_factor, dz_interval, wilcoxon_test
from autd_analysis.intervals import Interval, t_interval
from autd_analysis.models.cells import NoModel
from autd_analysis.models.planned import MixedModelTest, mixed_model_test
from autd_analysis.paired import PairedT, SignFlip, paired_t_test, sign_flip_test
from autd_analysis.rates import ParticipantRate, marginal_rates
from autd_trials.protocol.schema import Comparison, Level

DIFFERENCE_INTERVAL = "95 % t interval over participants' paired differences"


@dataclass(frozen=True)
class ComparisonResult:
    """One planned comparison at one level of the other factor.

    Attributes
    ----------
    factor, first, second
        What was compared.
    at
        The level of the other factor; empty if the comparison is over all trials.
    differences
        Participant and difference of the rates, first minus second; participants who lack a rate are missing.
    mean, sd
        Mean and standard deviation (n - 1) of the differences; None where undefined.
    interval
        t interval of the mean; None with fewer than two participants or if all differences are equal.
    sign_flip, paired_t, mixed_model
        The three tests, two-sided; None where one cannot be made.
    wilcoxon
        The exact signed-rank test; not adjusted, as it is no planned test.
    dz_interval, bayes_factor
        Of the paired t test; None without it.
    sign_flip_holm, paired_t_holm, mixed_model_holm
        Their p after Holm's adjustment over all planned comparisons, for each kind of test by itself.
    family
        How many tests each of these adjustments is for: all that were planned, also those that could not be
        made.
    notes
        What could not be done, and why.
    """

    factor: str
    first: Level
    second: Level
    at: Condition
    differences: tuple[tuple[str, Fraction], ...]
    mean: float | None
    sd: float | None
    interval: Interval | None
    sign_flip: SignFlip | None
    paired_t: PairedT | None
    mixed_model: MixedModelTest | None
    wilcoxon: Wilcoxon | None
    dz_interval: Interval | None
    bayes_factor: float | None
    notes: tuple[str, ...]
    sign_flip_holm: float | None = None
    paired_t_holm: float | None = None
    mixed_model_holm: float | None = None
    family: int = 0

    @property
    def participants(self) -> int:
        """Number of participants with both rates."""
        return len(self.differences)


def planned_comparisons(rates: Sequence[ParticipantRate], design: Design) -> tuple[ComparisonResult, ...]:
    """Make all comparisons that the protocol planned.

    Parameters
    ----------
    rates
        Detection rates in the single cells of the design.
    design
        The study's factors and comparisons.

    Returns
    -------
    tuple of ComparisonResult
        In the protocol's order, adjusted by Holm's method over all of them, for each kind of test by itself.
    """
    results = [
        _compare(rates, design, comparison, at)
        for comparison in design.comparisons
        for at in conditions([design.factor(comparison.at_each)] if comparison.at_each else [])
    ]
    sign_flip_p = [result.sign_flip.p if result.sign_flip else None for result in results]
    paired_t_p = [result.paired_t.p if result.paired_t else None for result in results]
    mixed_model_p = [result.mixed_model.p if result.mixed_model else None for result in results]
    return tuple(
        dataclasses.replace(
            result,
            sign_flip_holm=sign_flip_holm,
            paired_t_holm=paired_t_holm,
            mixed_model_holm=mixed_model_holm,
            family=len(results),
        )
        for result, sign_flip_holm, paired_t_holm, mixed_model_holm in zip(
            results, holm(sign_flip_p), holm(paired_t_p), holm(mixed_model_p), strict=True
        )
    )


def _compare(
    rates: Sequence[ParticipantRate], design: Design, comparison: Comparison, at: Condition
) -> ComparisonResult:
    differences = _differences(rates, design, comparison, at)
    values = [difference for _, difference in differences]
    floats = [float(value) for value in values]
    sign_flip, paired_t = sign_flip_test(values), paired_t_test(values)
    mixed_model = mixed_model_test(rates, comparison.factor, comparison.first, comparison.second, at)
    lacking = sorted({rate.participant for rate in rates} - {participant for participant, _ in differences})
    return ComparisonResult(
        factor=comparison.factor,
        first=comparison.first,
        second=comparison.second,
        at=at,
        differences=differences,
        mean=float(statistics.mean(values)) if values else None,
        sd=statistics.stdev(floats) if len(floats) > 1 else None,
        interval=t_interval(floats),
        sign_flip=sign_flip,
        paired_t=paired_t,
        mixed_model=mixed_model if isinstance(mixed_model, MixedModelTest) else None,
        wilcoxon=wilcoxon_test(values),
        dz_interval=dz_interval(paired_t.t, len(values)) if paired_t else None,
        bayes_factor=bayes_factor(paired_t.t, len(values)) if paired_t else None,
        notes=tuple(_notes(values, lacking, sign_flip, mixed_model)),
    )


def _differences(
    rates: Sequence[ParticipantRate], design: Design, comparison: Comparison, at: Condition
) -> tuple[tuple[str, Fraction], ...]:
    """Return each participant's rate at the first level minus that at the second, where both are known."""
    kept = [factor for factor in design.factors if factor.name in (comparison.factor, comparison.at_each)]
    marginal = {
        (rate.participant, frozenset(rate.condition)): rate.rate for rate in marginal_rates(rates, kept)
    }

    def rate_at(participant: str, level: Level) -> Fraction | None:
        return marginal[participant, frozenset({(comparison.factor, level), *at})]

    pairs = (
        (participant, rate_at(participant, comparison.first), rate_at(participant, comparison.second))
        for participant in dict.fromkeys(rate.participant for rate in rates)
    )
    return tuple(
        (participant, first - second)
        for participant, first, second in pairs
        if first is not None and second is not None
    )


def _notes(
    values: Sequence[Fraction],
    lacking: Sequence[str],
    sign_flip: SignFlip | None,
    mixed_model: MixedModelTest | NoModel,
) -> list[str]:
    notes = []
    if lacking:
        notes.append(f"without a rate in both conditions: {', '.join(f'sub-{label}' for label in lacking)}")
    if len(values) < 2:
        notes.append(f"not testable with {len(values)} participant(s)")
        return notes
    if len(set(values)) == 1:
        notes.append("all differences are equal, so the t test and the t interval are not defined")
    if sign_flip is None:
        notes.append("the differences take too many distinct sums for the exact sign-flip test")
    if isinstance(mixed_model, NoModel):
        notes.append(f"no mixed model: {mixed_model.cause}")
        return notes
    if mixed_model.penalised:
        notes.append(
            "answers are separated (all or none felt in a cell): the mixed model is penalised (Firth)"
        )
    if mixed_model.singular:
        notes.append("the mixed model is singular: a variance is 0 or a correlation 1")
    return notes
