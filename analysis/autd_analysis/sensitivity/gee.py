"""Generalised estimating equations: population-averaged effects, with covariances for few participants.

Any two answers of a participant are taken to correlate alike (exchangeable), which need not be true: the
sandwich covariance holds all the same. K.-Y. Liang and S. L. Zeger (1986), Biometrika 73, 13-22. For few
participants it is too small, as residuals are smaller than errors. Residuals r of a participant with
leverage H are therefore enlarged: to (I - H)^(-1/2) r by G. Kauermann and R. J. Carroll (2001), J. Am. Stat.
Assoc. 96, 1387-1396, and to (I - H)^(-1) r by L. A. Mancl and T. A. DeRouen (2001), Biometrics 57, 126-134,
which is rather too much.

Degrees of freedom are Satterthwaite's under the working covariance: D. F. McCaffrey and R. M. Bell (2006),
Stat. Med. 25, 4081-4098. Where everybody has the same trials they are participants - 1, and with Kauermann
and Carroll's covariance the test is the paired t test of what each participant contributes. Participants
minus parameters would be far too few: the conditions are compared within participants.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval, t_quantile
from autd_analysis.models.glmm import BinomialRows
from autd_analysis.models.links import LOGIT

Array = NDArray[np.float64]
Correction = Literal["none", "kauermann_carroll", "mancl_derouen"]

CORRECTIONS: tuple[Correction, ...] = ("none", "kauermann_carroll", "mancl_derouen")

_POWERS: dict[Correction, float] = {"none": 0.0, "kauermann_carroll": -0.5, "mancl_derouen": -1.0}
_MOST_STEPS = 100
_CONVERGED = 1e-10
_LARGEST_LOGIT = 12.0
_LARGEST_LEVERAGE = 1 - 1e-9
_NO_VARIANCE = 1e-16


@dataclass(frozen=True)
class GeeEffect:
    """A population-averaged difference in logits, with Student's t interval and two-sided test."""

    logits: float
    standard_error: float
    df: float
    interval: Interval
    t: float
    p: float


@dataclass(frozen=True, eq=False)
class GeeFit:
    """A fitted marginal model.

    Attributes
    ----------
    coefficients
        In logits, shape (p,); population-averaged, so nearer to zero than those of a mixed model.
    correlation
        Of two answers of one participant, beyond what the conditions explain.
    information, scores
        What each participant adds to the information, shape (participants, p, p), and to the estimating
        equations, which is zero in sum, shape (participants, p).
    """

    coefficients: Array
    correlation: float
    information: Array
    scores: Array

    def covariance(self, correction: Correction) -> Array | None:
        """Return the coefficients' covariance; None if a participant determines one alone."""
        enlarged = self._enlarged(correction)
        if enlarged is None:
            return None
        bread = np.linalg.inv(self.information.sum(axis=0))
        parts = bread @ enlarged.transpose(0, 2, 1) @ self.scores[..., None]
        covariance: Array = np.einsum("gix,gjx->ij", parts, parts)
        return covariance

    def effect(self, weights: Array, correction: Correction) -> GeeEffect | None:
        """Return a weighted sum of the coefficients; None where its variance cannot be estimated."""
        from scipy.special import stdtr

        covariance, enlarged = self.covariance(correction), self._enlarged(correction)
        if covariance is None or enlarged is None or weights @ covariance @ weights < _NO_VARIANCE:
            return None
        logits = float(weights @ self.coefficients)
        standard_error = math.sqrt(weights @ covariance @ weights)
        df = self._degrees_of_freedom(weights, enlarged)
        half_width = t_quantile(df) * standard_error
        return GeeEffect(
            logits=logits,
            standard_error=standard_error,
            df=df,
            interval=Interval(logits - half_width, logits + half_width),
            t=logits / standard_error,
            p=float(2 * stdtr(df, -abs(logits / standard_error))),
        )

    def _enlarged(self, correction: Correction) -> Array | None:
        """Return for each participant the matrix K whose K's is the score with enlarged residuals.

        With A the whitened derivatives, M = A'A and B = LL' the inverse of the sum of M, the leverage is
        ABA', and its eigenvectors A L v come with those v of L'ML.
        """
        root = np.linalg.cholesky(np.linalg.inv(self.information.sum(axis=0)))
        leverage, vectors = np.linalg.eigh(root.T @ self.information @ root)
        power = _POWERS[correction]
        if power and leverage.max() > _LARGEST_LEVERAGE:
            return None
        factors = (vectors * ((1 - leverage) ** power)[:, None]) @ vectors.transpose(0, 2, 1)
        enlarged: Array = root @ factors @ np.linalg.inv(root)
        return enlarged

    def _degrees_of_freedom(self, weights: Array, enlarged: Array) -> float:
        """Return Satterthwaite's degrees of freedom of an effect's variance.

        The variance is a sum of squares g'g of normal g; its mean is tr G and its variance 2 tr GG, with G
        the covariance of the g, in which every residual holds a bit of everybody's error.
        """
        bread = np.linalg.inv(self.information.sum(axis=0))
        rows = enlarged @ (bread @ weights)
        carried = np.einsum("gij,gj->gi", self.information, rows)
        products = np.diag(np.einsum("gi,gi->g", rows, carried)) - carried @ bread @ carried.T
        return float(np.trace(products) ** 2 / (products**2).sum())


def fit_gee(rows: BinomialRows) -> GeeFit | None:
    """Fit the fixed effects of rows of answers.

    Parameters
    ----------
    rows
        The answers; their random effects are not used.

    Returns
    -------
    GeeFit or None
        None if the iterations do not come to rest, as where answers are separated.
    """
    coefficients = np.zeros(rows.fixed.shape[1])
    for _ in range(_MOST_STEPS):
        correlation = _correlation(rows, coefficients)
        information, scores = _equations(rows, coefficients, correlation)
        total = information.sum(axis=0)
        if np.linalg.matrix_rank(total, hermitian=True) < len(total):
            return None
        step = np.linalg.solve(total, scores.sum(axis=0))
        if np.abs(step).max() < _CONVERGED:
            return GeeFit(coefficients, correlation, information, scores)
        coefficients = coefficients + step * min(1.0, 2 / float(np.abs(step).max()))
        if np.abs(coefficients).max() > _LARGEST_LOGIT:
            return None
    return None


def _correlation(rows: BinomialRows, coefficients: Array) -> float:
    """Return the mean product of two residuals of a participant, over the mean square of one."""
    means = LOGIT.probability(rows.fixed @ coefficients)
    odds = means / (1 - means)
    squares = rows.felt / odds + (rows.trials - rows.felt) * odds
    sums = (rows.felt - rows.trials * means) / np.sqrt(means * (1 - means))
    trials = np.bincount(rows.participant, rows.trials)
    pairs = float((trials * (trials - 1)).sum()) / 2
    spare = len(coefficients)
    if pairs <= spare or trials.sum() <= spare:
        return 0.0
    products = float((np.bincount(rows.participant, sums) ** 2).sum() - squares.sum()) / 2
    found = (products / (pairs - spare)) / (float(squares.sum()) / (float(trials.sum()) - spare))
    lowest = -1 / (float(trials.max()) - 1)  # beyond it there is no such covariance
    return max(0.99 * lowest, min(0.99, found))


def _equations(rows: BinomialRows, coefficients: Array, correlation: float) -> tuple[Array, Array]:
    """Return each participant's information and score.

    The correlation matrix (1 - r) I + r J of N answers has the inverse (I - r / (1 + (N - 1) r) J) / (1 - r).
    """
    people = np.eye(int(rows.participant.max()) + 1)[rows.participant]
    means = LOGIT.probability(rows.fixed @ coefficients)
    spread = means * (1 - means)
    residuals = rows.felt - rows.trials * means
    trials = people.T @ rows.trials
    shared = correlation / (1 + (trials - 1) * correlation)
    slopes = people.T @ ((rows.trials * np.sqrt(spread))[:, None] * rows.fixed)
    sums = people.T @ (residuals / np.sqrt(spread))
    information = np.einsum(
        "rg,r,ri,rj->gij", people, rows.trials * spread, rows.fixed, rows.fixed, optimize=True
    )
    information -= shared[:, None, None] * slopes[:, :, None] * slopes[:, None, :]
    scores = people.T @ (residuals[:, None] * rows.fixed) - (shared * sums)[:, None] * slopes
    return information / (1 - correlation), scores / (1 - correlation)
