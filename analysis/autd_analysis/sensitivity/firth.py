"""Logistic regression with Firth's penalty: finite also where answers are separated.

Half the logarithm of the information's determinant (Jeffreys' prior) is added to the log likelihood; this
also takes the first-order bias off the estimates. D. Firth (1993), Biometrika 80, 27-38. Intervals and tests
are by the profile of the penalised likelihood: G. Heinze and M. Schemper (2002), Stat. Med. 21, 2409-2419.
Answers are taken as independent given the model's columns.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval
from autd_analysis.models.contrasts import null_space
from autd_analysis.models.links import LOGIT

Array = NDArray[np.float64]

_HALF_CHI2_95 = 1.9207294103470618
"""Half the 95 % point of chi-squared with one degree of freedom: what the profile may lose."""

_MOST_STEPS = 200
_CONVERGED = 1e-12
_SMALLEST_STEP = 1e-6


@dataclass(frozen=True)
class FirthEffect:
    """A weighted sum of coefficients.

    Attributes
    ----------
    logits, standard_error
        The penalised estimate, and its standard error from the information there.
    interval
        95 % interval by the profile of the penalised likelihood.
    statistic, p
        Penalised likelihood-ratio test that the sum is zero, with one degree of freedom.
    """

    logits: float
    standard_error: float
    interval: Interval
    statistic: float
    p: float


def firth_effect(felt: Array, trials: Array, design: Array, weights: Array) -> FirthEffect | None:
    """Fit the model and return a weighted sum of its coefficients.

    Parameters
    ----------
    felt, trials
        Counts, shape (rows,).
    design
        Shape (rows, k).
    weights
        Shape (k,), not all zero.

    Returns
    -------
    FirthEffect or None
        None if the coefficients are not identified, or the iterations do not come to rest.
    """
    penalised = _Penalised(felt, trials, design)
    if np.linalg.matrix_rank(penalised.information(np.zeros(len(weights))), hermitian=True) < len(weights):
        return None
    try:
        return _effect(penalised, weights)
    except _AtNoRestError:
        return None


class _AtNoRestError(Exception):
    """The iterations did not come to rest."""


class _Penalised:
    """The penalised likelihood of coefficients."""

    def __init__(self, felt: Array, trials: Array, design: Array) -> None:
        self.felt, self.trials, self.design = felt, trials, design

    def information(self, coefficients: Array) -> Array:
        """Return the expected information."""
        means = LOGIT.probability(self.design @ coefficients)
        found: Array = self.design.T @ ((self.trials * means * (1 - means))[:, None] * self.design)
        return found

    def log_likelihood(self, coefficients: Array) -> float:
        """Return the penalised log likelihood."""
        plain = LOGIT.log_likelihood(self.felt, self.trials, self.design @ coefficients).sum()
        return float(plain + 0.5 * np.linalg.slogdet(self.information(coefficients))[1])

    def derivatives(self, coefficients: Array) -> tuple[Array, Array]:
        """Return the score, and the information of its answers.

        The penalty adds h / 2 felt and h / 2 unfelt answers to a row of leverage h.
        """
        means = LOGIT.probability(self.design @ coefficients)
        spread = means * (1 - means)
        solved = np.linalg.solve(self.information(coefficients), self.design.T).T
        leverage = self.trials * spread * (self.design * solved).sum(axis=1)
        trials = self.trials + leverage
        score = self.design.T @ (self.felt + leverage / 2 - trials * means)
        return score, self.design.T @ ((trials * spread)[:, None] * self.design)

    def maximum(self, start: Array, free: Array) -> tuple[Array, float]:
        """Climb from a start along the columns of `free`; return where the maximum is, and its value."""
        place, value = start, self.log_likelihood(start)
        for _ in range(_MOST_STEPS):
            score, information = self.derivatives(place)
            gradient = free.T @ score
            step = np.linalg.solve(free.T @ information @ free, gradient)
            gain = float(gradient @ step)
            if gain < _CONVERGED:
                return place, value
            size = min(1.0, 2 / float(np.abs(step).max()))
            tried = self.log_likelihood(place + size * free @ step)
            while tried < value and size > _SMALLEST_STEP:
                size /= 2
                tried = self.log_likelihood(place + size * free @ step)
            place, value = place + size * free @ step, tried
        raise _AtNoRestError


def _effect(penalised: _Penalised, weights: Array) -> FirthEffect:
    from scipy.special import chdtrc

    everything = np.eye(len(weights))
    best, highest = penalised.maximum(np.zeros(len(weights)), everything)
    logits = float(weights @ best)
    standard_error = math.sqrt(weights @ np.linalg.solve(penalised.information(best), weights))
    others = null_space(weights[None])

    def loss(value: float) -> float:
        moved = best + (value - logits) / (weights @ weights) * weights
        return highest - penalised.maximum(moved, others)[1]

    statistic = max(0.0, 2 * loss(0.0))
    low, high = (_crossing(loss, logits, side * standard_error) for side in (-1, 1))
    return FirthEffect(logits, standard_error, Interval(low, high), statistic, float(chdtrc(1, statistic)))


def _crossing(loss: Callable[[float], float], best: float, stride: float) -> float:
    """Return where the profile has lost what makes a 95 % interval, on the side where the stride goes."""
    from scipy.optimize import brentq

    far = best + 2 * stride
    while loss(far) < _HALF_CHI2_95:  # the penalty pulls back without bound, so there is an end
        far += stride
    return float(brentq(lambda value: loss(value) - _HALF_CHI2_95, best, far, xtol=1e-8))
