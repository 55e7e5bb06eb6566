"""The planned contrasts of rates, within participants."""

import dataclasses
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from autd_analysis.basics.adjustment import holm
from autd_analysis.basics.exact import Wilcoxon, bayes_factor, dz_interval, wilcoxon_test
from autd_analysis.basics.intervals import Interval, newcombe_interval, t_interval
from autd_analysis.basics.paired import PairedT, SignFlip, paired_t_test, sign_flip_test
from autd_analysis.data.contrasts import Contrast, planned_contrasts
from autd_analysis.data.design import Design
from autd_analysis.models.planned import MixedModelTest, mixed_model_test
from autd_analysis.rates.numbers import ParticipantRate, marginal_rates

DIFFERENCE_INTERVAL = "95 % t interval over participants' paired differences"
NEWCOMBE_INTERVAL = "95 % Newcombe interval, trials taken as independent"


@dataclass(frozen=True)
class Difference:
    """A participant's difference of rates.

    Attributes
    ----------
    contrast, participant, value
        What was compared, whose it is, and the difference.
    interval
        Newcombe's; None where several conditions are taken together.
    """

    contrast: Contrast
    participant: str
    value: Fraction
    interval: Interval | None


@dataclass(frozen=True)
class ComparisonResult:
    """One planned contrast of rates.

    Attributes
    ----------
    contrast
        What was compared, and where.
    differences
        Participants' differences of the rates, first minus second; who lacks a rate is missing.
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
        Their p after Holm's adjustment over all planned comparisons that could be tested that way.
    sign_flip_tests, paired_t_tests, mixed_model_tests
        How many tests these adjustments were for.
    notes
        What could not be done, and why.
    """

    contrast: Contrast
    differences: tuple[Difference, ...]
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
    sign_flip_tests: int = 0
    paired_t_tests: int = 0
    mixed_model_tests: int = 0

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
    results = [_compare(rates, design, contrast) for contrast in planned_contrasts(design)]
    sign_flip_p = [result.sign_flip.p if result.sign_flip else None for result in results]
    paired_t_p = [result.paired_t.p if result.paired_t else None for result in results]
    mixed_model_p = [result.mixed_model.p if result.mixed_model else None for result in results]
    return tuple(
        dataclasses.replace(
            result,
            sign_flip_holm=sign_flip_holm,
            paired_t_holm=paired_t_holm,
            mixed_model_holm=mixed_model_holm,
            sign_flip_tests=len(sign_flip_p) - sign_flip_p.count(None),
            paired_t_tests=len(paired_t_p) - paired_t_p.count(None),
            mixed_model_tests=len(mixed_model_p) - mixed_model_p.count(None),
        )
        for result, sign_flip_holm, paired_t_holm, mixed_model_holm in zip(
            results, holm(sign_flip_p), holm(paired_t_p), holm(mixed_model_p), strict=True
        )
    )


def _compare(rates: Sequence[ParticipantRate], design: Design, contrast: Contrast) -> ComparisonResult:
    differences = _differences(rates, design, contrast)
    values = [difference.value for difference in differences]
    floats = [float(value) for value in values]
    sign_flip, paired_t = sign_flip_test(values), paired_t_test(values)
    mixed_model = mixed_model_test(rates, contrast)
    lacking = sorted(
        {rate.participant for rate in rates} - {difference.participant for difference in differences}
    )
    return ComparisonResult(
        contrast=contrast,
        differences=differences,
        mean=float(statistics.mean(values)) if values else None,
        sd=statistics.stdev(floats) if len(floats) > 1 else None,
        interval=t_interval(floats),
        sign_flip=sign_flip,
        paired_t=paired_t,
        mixed_model=mixed_model,
        wilcoxon=wilcoxon_test(values),
        dz_interval=dz_interval(paired_t.t, len(values)) if paired_t else None,
        bayes_factor=bayes_factor(paired_t.t, len(values)) if paired_t else None,
        notes=tuple(_notes(values, lacking, sign_flip, mixed_model)),
    )


def _differences(
    rates: Sequence[ParticipantRate], design: Design, contrast: Contrast
) -> tuple[Difference, ...]:
    """Return each participant's rate at the first level minus that at the second, where both are known."""
    kept = [factor for factor in design.factors if factor.name in (contrast.factor, contrast.over)]
    marginal = {(rate.participant, frozenset(rate.condition)): rate for rate in marginal_rates(rates, kept)}
    people = dict.fromkeys(rate.participant for rate in rates)
    pairs = (
        (
            marginal[participant, contrast.side(contrast.first)],
            marginal[participant, contrast.side(contrast.second)],
        )
        for participant in people
    )
    return tuple(
        Difference(contrast, first.participant, first.rate - second.rate, _newcombe(first, second))
        for first, second in pairs
        if first.rate is not None and second.rate is not None
    )


def _newcombe(first: ParticipantRate, second: ParticipantRate) -> Interval | None:
    single = first.interval is not None and second.interval is not None  # conditions
    return newcombe_interval((first.felt, first.n), (second.felt, second.n)) if single else None


def _notes(
    values: Sequence[Fraction],
    lacking: Sequence[str],
    sign_flip: SignFlip | None,
    mixed_model: MixedModelTest | None,
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
    if mixed_model is None:
        notes.append("no mixed model: fewer than 4 participants, an empty cell, or no convergence")
    elif mixed_model.penalised:
        notes.append(
            "answers are separated (all or none felt in a cell): the mixed model is penalised (Firth)"
        )
    if mixed_model is not None and mixed_model.singular:
        notes.append("the mixed model is singular: a variance is 0 or a correlation 1")
    return notes
