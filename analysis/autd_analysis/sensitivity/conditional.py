"""Conditional logistic regression: how often a participant feels anything drops out of the likelihood.

Given the number of answers "felt" of a participant, how they fall on the conditions does not depend on the
participant's own level. D. R. Cox (1958), J. R. Stat. Soc. B 20, 215-232. The effects of the conditions are
taken for the same in all participants: where they are not, its errors are too small.

The sums over all ways to fall are coefficients of the generating function, a product of (1 + odds z)^trials
over the conditions. They are read off its values on a circle, which is exact for a polynomial; on the circle
through the saddle point nothing cancels.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MOST_STEPS = 50
_CONVERGED = 1e-10
_LARGEST_LOGIT = 12.0
_NO_INFORMATION = 1e-8


@dataclass(frozen=True, eq=False)
class ConditionalFit:
    """A fitted model.

    Attributes
    ----------
    coefficients, covariance
        Of the columns of the design, shape (k,) and (k, k).
    log_likelihood
        Conditional log likelihood without the binomial coefficients.
    participants
        Number of participants who felt some but not all: the others are uninformative.
    """

    coefficients: Array
    covariance: Array
    log_likelihood: float
    participants: int


def fit_conditional(felt: Array, trials: Array, design: Array) -> ConditionalFit | None:
    """Fit by maximum conditional likelihood.

    Parameters
    ----------
    felt, trials
        Counts, shape (participants, conditions); without trials both are 0.
    design
        Logits of the conditions are this times the coefficients, shape (conditions, k); columns that are the
        same in all conditions are uninformative and may not be there.

    Returns
    -------
    ConditionalFit or None
        None if the coefficients are not identified, or estimates are infinite.
    """
    totals = felt.sum(axis=1)
    informative = (totals > 0) & (totals < trials.sum(axis=1))
    felt, trials = felt[informative], trials[informative]
    coefficients = np.zeros(design.shape[1])
    for _ in range(_MOST_STEPS):
        logits = design @ coefficients
        value, scores, information = _derivatives(felt, trials, logits)
        score, information = design.T @ scores, design.T @ information @ design
        if np.linalg.matrix_rank(information, tol=_NO_INFORMATION, hermitian=True) < len(information):
            return None
        step = np.linalg.solve(information, score)
        if float(score @ step) < _CONVERGED:
            covariance = np.asarray(np.linalg.inv(information), float)
            return ConditionalFit(coefficients + step, covariance, value, int(informative.sum()))
        coefficients = coefficients + step * min(1.0, 2 / float(np.abs(step).max()))
        if np.ptp(design @ coefficients) > _LARGEST_LOGIT:
            return None
    return None


def _derivatives(felt: Array, trials: Array, logits: Array) -> tuple[float, Array, Array]:
    """Return log likelihood, and score and information of the logits."""
    value, score = float((felt @ logits).sum()), felt.sum(axis=0)
    information = np.zeros((len(logits), len(logits)))
    for mine, count in zip(felt, trials, strict=True):
        log_ways, mean, covariance = _given_total(count, float(mine.sum()), logits)
        value -= log_ways
        score = score - mean
        information += covariance
    return value, score, information


def _given_total(trials: Array, total: float, logits: Array) -> tuple[float, Array, Array]:
    """Return log of the summed weights of all ways to feel `total`, and mean and covariance of the counts."""
    level = _level(trials, total, logits)
    size = int(trials.sum()) + 1
    angles = 2 * np.pi * np.arange(size) / size
    odds = np.exp(level + logits[:, None] + 1j * angles)
    logs = trials @ np.log1p(odds) - 1j * angles * total
    largest = float(logs[0].real)  # at angle 0, where nothing turns
    weights = np.exp(logs - largest)
    ways = float(weights.real.sum())
    rates = odds / (1 + odds)
    mean = trials * (rates @ weights).real / ways
    products = ((rates * weights) @ rates.T).real / ways
    covariance = np.outer(trials, trials) * products - np.outer(mean, mean)
    covariance += np.diag(mean - trials * np.diag(products))
    return largest - level * total + math.log(ways / size), mean, covariance


def _level(trials: Array, total: float, logits: Array) -> float:
    """Return the logit which, added to all, makes the expected number of answers "felt" the total."""
    from scipy.optimize import brentq
    from scipy.special import expit

    own = math.log(total / (float(trials.sum()) - total))
    low, high = own - float(logits.max()), own - float(logits.min())

    def surplus(level: float) -> float:
        return float(trials @ expit(level + logits)) - total

    return float(brentq(surplus, low - 1e-6, high + 1e-6, xtol=1e-9))
