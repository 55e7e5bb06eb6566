"""A planned comparison by a logistic mixed model: fixed effects of cells, a random slope of the contrast.

Where two levels are compared at a level of another factor, only the trials there are taken: a slope shared
with the other levels would be estimated too small where people differ from level to level, and there would be
more false positives than 5 % (docs/statistics.md has the table).

Where all or none were felt in a cell its logit is infinite. Then half a felt and half an unfelt answer are
added to every cell, spread over the participants: Firth's penalty, which for cell means alone is just that.
D. Firth (1993), Biometrika 80, 27-38.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.design import Condition
from analysis.intervals import Interval
from analysis.models.glmm import BinomialRows, fit_glmm, likelihood_ratio
from analysis.rates import ParticipantRate
from autd_trials.protocol.schema import Level

FEWEST_PARTICIPANTS = 4
PENALTY = 0.5
"""Answers of each kind that are added to every cell where answers are separated."""

_NORMAL_975 = 1.959963984540054

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MixedModelTest:
    """A difference of two levels in logits.

    Attributes
    ----------
    logits
        Estimated difference of the logits, first minus second, for a participant with average random effects.
    interval
        Wald 95 % interval.
    statistic, p
        Likelihood-ratio test with one degree of freedom.
    slope_sd
        Standard deviation over participants of the difference, in logits.
    penalised
        Whether answers are separated, so that Firth's penalty keeps the estimates finite.
    singular
        Whether a variance was estimated as zero or a correlation as 1.
    """

    logits: float
    interval: Interval
    statistic: float
    p: float
    slope_sd: float
    penalised: bool
    singular: bool


def mixed_model_test(
    rates: Sequence[ParticipantRate], factor: str, first: Level, second: Level, at: Condition
) -> MixedModelTest | None:
    """Test the difference of two levels of a factor.

    Parameters
    ----------
    rates
        Rates in the single cells.
    factor, first, second
        What is compared.
    at
        The level of another factor at which it is compared, by the trials there alone; over all cells if
        empty.

    Returns
    -------
    MixedModelTest | None
        None with fewer than 4 participants, without trials in a cell that is compared, or if nothing
        converged.
    """
    there = [rate for rate in rates if set(at) <= set(rate.condition)]
    counted = [rate for rate in there if rate.n > 0]
    participants = list(dict.fromkeys(rate.participant for rate in counted))
    cells = list(dict.fromkeys(rate.condition for rate in there))
    contrast = _contrast(cells, factor, first, second)
    seen = {rate.condition for rate in counted}
    needed = {cell for cell, weight in zip(cells, contrast, strict=True) if weight}
    if len(participants) < FEWEST_PARTICIPANTS or not needed <= seen:
        return None
    kept = [cell in seen for cell in cells]
    rows = _rows(counted, [cell for cell in cells if cell in seen], participants, factor, first, second)
    weights = contrast[kept]
    separated = _is_separated(rows)
    if separated:
        rows = _penalised(rows)
    full, reduced = fit_glmm(rows), fit_glmm(_without(rows, weights))
    if not (full.converged and reduced.converged):
        return None
    statistic, p = likelihood_ratio(full, reduced, df=1)
    logits = float(weights @ full.coefficients)
    return MixedModelTest(
        logits=logits,
        interval=_wald(logits, float(weights @ full.covariance @ weights)),
        statistic=statistic,
        p=p,
        slope_sd=float(full.standard_deviations[1]),
        penalised=separated,
        singular=full.singular,
    )


def _contrast(cells: Sequence[Condition], factor: str, first: Level, second: Level) -> Array:
    """Return weights of the cells: mean of those with the first level minus mean of those with the second."""
    weights = np.zeros(len(cells))
    for level, sign in ((first, 1.0), (second, -1.0)):
        chosen = [dict(cell).get(factor) == level for cell in cells]
        weights[chosen] = sign / max(1, sum(chosen))
    return weights


def _rows(
    rates: Sequence[ParticipantRate],
    cells: Sequence[Condition],
    participants: Sequence[str],
    factor: str,
    first: Level,
    second: Level,
) -> BinomialRows:
    sides = {first: 0.5, second: -0.5}
    slopes = [sides.get(dict(rate.condition)[factor], 0.0) for rate in rates]
    return BinomialRows(
        felt=np.array([float(rate.felt) for rate in rates]),
        trials=np.array([float(rate.n) for rate in rates]),
        fixed=np.eye(len(cells))[[cells.index(rate.condition) for rate in rates]],
        random=np.column_stack([np.ones(len(rates)), slopes]),
        participant=np.array([participants.index(rate.participant) for rate in rates]),
    )


def _is_separated(rows: BinomialRows) -> bool:
    """Return whether a cell's answers are all the same: with cells as fixed effects there is no other way."""
    felt, trials = rows.fixed.T @ rows.felt, rows.fixed.T @ rows.trials
    return bool(((felt == 0) | (felt == trials)).any())


def _penalised(rows: BinomialRows) -> BinomialRows:
    share = PENALTY / (rows.fixed @ rows.fixed.sum(axis=0))  # of a cell's penalty, for each of its rows
    return BinomialRows(rows.felt + share, rows.trials + 2 * share, rows.fixed, rows.random, rows.participant)


def _without(rows: BinomialRows, weights: Array) -> BinomialRows:
    """Return the model in which the contrast is zero."""
    others = np.linalg.svd(weights[None])[2][1:].T
    return BinomialRows(rows.felt, rows.trials, rows.fixed @ others, rows.random, rows.participant)


def _wald(estimate: float, variance: float) -> Interval:
    half_width = _NORMAL_975 * float(np.sqrt(variance))
    return Interval(estimate - half_width, estimate + half_width)
