"""The planned comparisons by other models of single answers, to see whether the choice of model matters.

They differ in what they take for granted: GEE averages over people, conditional logistic regression takes
people for alike in the effect but not in their level, and so does logistic regression with Firth's penalty,
which alone stays finite where answers are separated.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval, wald_interval
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.data.contrasts import Contrast, planned_contrasts
from autd_analysis.data.design import Design
from autd_analysis.models.cells import NoModel, compared_rows, participants
from autd_analysis.models.contrasts import null_space
from autd_analysis.models.marginal import BinomialRows
from autd_analysis.rates.numbers import ParticipantRate, Rates
from autd_analysis.sensitivity.adjusted import AdjustedP, adjusted_p
from autd_analysis.sensitivity.conditional import fit_conditional
from autd_analysis.sensitivity.firth import firth_effect
from autd_analysis.sensitivity.firth_logits import ConditionLogit, condition_logits
from autd_analysis.sensitivity.gee import CORRECTIONS, Correction, fit_gee
from autd_analysis.sensitivity.pooled import PooledTests, pooled_tests

Array = NDArray[np.float64]

GEE_METHODS: dict[Correction, str] = {
    "none": "GEE, uncorrected",
    "kauermann_carroll": "GEE, Kauermann-Carroll",
    "mancl_derouen": "GEE, Mancl-DeRouen",
}
CONDITIONAL = "conditional logistic"
FIRTH = "Firth logistic"

_NO_GEE = "the equations have no finite solution, as where all or none were felt in a condition"
_NO_VARIANCE = "participants are exactly alike, or one stands alone in a condition: no standard error"
_NO_CONDITIONAL = "no finite estimate: within participants, answers are separated or too few differ"
_NO_FIRTH = "the effects of participants and conditions are confounded"


@dataclass(frozen=True)
class OtherEstimate:
    """A planned comparison by one of the other models.

    Attributes
    ----------
    contrast
        What is compared, and where.
    method
        The model and the kind of its standard error.
    participants, trials
        How many are informative: for conditional logistic, only who felt some but not all.
    logits, standard_error, interval
        First minus second; None where undefined.
    wald, df, wald_p
        Estimate over standard error and its two-sided p, by Student's t where there are degrees of freedom,
        else normal; None if there is no such test.
    ratio, ratio_p
        Likelihood-ratio test with one degree of freedom; None if there is none.
    note
        Why there is no estimate.
    """

    contrast: Contrast
    method: str
    participants: int
    trials: int
    logits: float | None = None
    standard_error: float | None = None
    interval: Interval | None = None
    wald: float | None = None
    df: float | None = None
    wald_p: float | None = None
    ratio: float | None = None
    ratio_p: float | None = None
    note: str | None = None


@dataclass(frozen=True)
class Sensitivity:
    """What other choices of tests and models would have given; none of it was planned.

    Attributes
    ----------
    adjusted
        The planned tests with further adjustments.
    other_estimates
        The planned contrasts by GEE, conditional logistic regression and Firth's penalty.
    pooled
        The planned contrasts by tests that take people for alike.
    condition_logits
        Every condition's logit with Firth's penalty.
    """

    adjusted: tuple[AdjustedP, ...]
    other_estimates: tuple[OtherEstimate, ...]
    pooled: tuple[PooledTests, ...]
    condition_logits: tuple[ConditionLogit, ...]


def sensitivity(rates: Rates, comparisons: Sequence[ComparisonResult], design: Design) -> Sensitivity:
    """Return what other choices of tests and models would have given."""
    return Sensitivity(
        adjusted=tuple(adjusted_p(comparisons)),
        other_estimates=other_estimates(rates.participants, design),
        pooled=pooled_tests(rates.participants, planned_contrasts(design)),
        condition_logits=condition_logits(rates.conditions),
    )


def other_estimates(rates: Sequence[ParticipantRate], design: Design) -> tuple[OtherEstimate, ...]:
    """Make the planned comparisons by GEE, conditional logistic regression and Firth's penalty.

    Parameters
    ----------
    rates
        Detection rates in the single cells of the design.
    design
        The study's factors and comparisons.

    Returns
    -------
    tuple of OtherEstimate
        All methods for each comparison; not adjusted, as they are no further tests but the same ones again.
    """
    return tuple(
        estimate for contrast in planned_contrasts(design) for estimate in _estimates(rates, contrast)
    )


def _estimates(rates: Sequence[ParticipantRate], contrast: Contrast) -> Iterator[OtherEstimate]:
    found = compared_rows(rates, contrast)
    if isinstance(found, NoModel):
        there = [rate for rate in rates if contrast.takes(rate.condition) and rate.n > 0]
        counts = len({rate.participant for rate in there}), sum(rate.n for rate in there)
        for method in (*GEE_METHODS.values(), CONDITIONAL, FIRTH):
            yield OtherEstimate(contrast, method, *counts, note=found.cause)
        return
    rows, weights = found
    yield from _gee(rows, weights, contrast)
    yield _conditional(rows, weights, contrast)
    yield _firth(rows, weights, contrast)


def _gee(rows: BinomialRows, weights: Array, contrast: Contrast) -> Iterator[OtherEstimate]:
    fit = fit_gee(rows)
    people, trials = participants(rows), int(rows.trials.sum())
    for correction in CORRECTIONS:
        method = GEE_METHODS[correction]
        effect = fit.effect(weights, correction) if fit else None
        if effect is None:
            note = _NO_VARIANCE if fit else _NO_GEE
            yield OtherEstimate(contrast, method, people, trials, note=note)
            continue
        yield OtherEstimate(
            contrast,
            method,
            people,
            trials,
            logits=effect.logits,
            standard_error=effect.standard_error,
            interval=effect.interval,
            wald=effect.t,
            df=effect.df,
            wald_p=effect.p,
        )


def _conditional(rows: BinomialRows, weights: Array, contrast: Contrast) -> OtherEstimate:
    from scipy.special import chdtrc, ndtr

    cells = rows.fixed.argmax(axis=1)
    felt, trials = np.zeros((2, int(rows.participant.max()) + 1, len(weights)))
    felt[rows.participant, cells], trials[rows.participant, cells] = rows.felt, rows.trials
    alike = np.ones((1, len(weights)))
    design = null_space(alike)
    full = fit_conditional(felt, trials, design)
    reduced = fit_conditional(felt, trials, null_space(np.vstack([alike, weights])))
    totals, all_trials = felt.sum(axis=1), trials.sum(axis=1)
    informative = (totals > 0) & (totals < all_trials)
    people, counted = int(informative.sum()), int(all_trials[informative].sum())
    if full is None or reduced is None:
        return OtherEstimate(contrast, CONDITIONAL, people, counted, note=_NO_CONDITIONAL)
    own = weights @ design
    logits, error = float(own @ full.coefficients), math.sqrt(own @ full.covariance @ own)
    ratio = max(0.0, 2 * (full.log_likelihood - reduced.log_likelihood))
    return OtherEstimate(
        contrast,
        CONDITIONAL,
        people,
        counted,
        logits=logits,
        standard_error=error,
        interval=wald_interval(logits, error),
        wald=logits / error,
        wald_p=float(2 * ndtr(-abs(logits / error))),
        ratio=ratio,
        ratio_p=float(chdtrc(1, ratio)),
    )


def _firth(rows: BinomialRows, weights: Array, contrast: Contrast) -> OtherEstimate:
    """Compare with a level for each participant; one participant's is that of the cells."""
    people = np.eye(int(rows.participant.max()) + 1)[rows.participant][:, 1:]
    padded = np.concatenate([np.zeros(people.shape[1]), weights])
    effect = firth_effect(rows.felt, rows.trials, np.column_stack([people, rows.fixed]), padded)
    counts = participants(rows), int(rows.trials.sum())
    if effect is None:
        return OtherEstimate(contrast, FIRTH, *counts, note=_NO_FIRTH)
    return OtherEstimate(
        contrast,
        FIRTH,
        *counts,
        logits=effect.logits,
        standard_error=effect.standard_error,
        interval=effect.interval,
        ratio=effect.statistic,
        ratio_p=effect.p,
    )
