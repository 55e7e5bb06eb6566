"""The likelihood of answers over random effects per participant, by adaptive quadrature.

Answers of participant g in a row (a condition): y of n felt, logit (or probit) of the probability x'b + z'Lu
with u standard normal and L a lower triangular factor of the random effects' covariance. The likelihood
integrates over u. With the nodes of the quadrature at the mode of each participant's posterior, scaled by its
curvature, the sums also give the exact score and information of the likelihood (Louis, 1982), because the
predictor is linear in b and L given u.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from autd_analysis.models.links import Link

Array = NDArray[np.float64]

DEFAULT_NODES = 9
"""Per random effect; more are taken until the likelihood rests."""

_LINES: dict[int, tuple[float, float]] = {
    15: (0.4, 4.5),
    25: (0.5, 5.0),
    41: (0.5, 5.0),
    61: (0.5, 6.0),
    101: (0.5, 6.0),
}
"""Larger numbers of nodes, and for each how strongly they spread outward and how far they reach."""

_NUMBERS = (DEFAULT_NODES, *_LINES)
_COARSER = 200.0
_MODE_STEPS = 200
_MODE_CLOSE = 1e-5
"""Close enough to a mode for quadrature about it; Laplace's approximation takes it as exact as can be."""

_MODE_EXACT = 1e-11


@dataclass(frozen=True, eq=False)
class BinomialRows:
    """Answers by participant and condition.

    Attributes
    ----------
    felt, trials
        Shape (rows,).
    fixed
        Design of the fixed effects, shape (rows, p).
    random
        Design of the random effects, shape (rows, q).
    participant
        Number of the participant of each row, 0 to g - 1.
    """

    felt: Array
    trials: Array
    fixed: Array
    random: Array
    participant: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Derivatives:
    """The marginal log likelihood without the binomial coefficients, its gradient, its observed information.

    The parameters are the fixed effects and then the entries of the factor, row by row.
    """

    value: float
    gradient: Array
    information: Array


class Marginal:
    """The rows by participant, padded with rows without trials, and the likelihood's derivatives.

    Parameters
    ----------
    rows
        The answers.
    nodes
        Nodes per random effect: 9, 15, 25, 41, 61 or 101; 1 is Laplace's approximation.
    link
        Logit or probit.
    """

    def __init__(self, rows: BinomialRows, nodes: int, link: Link) -> None:
        self.link = link
        groups = int(rows.participant.max()) + 1
        counts = np.bincount(rows.participant, minlength=groups)
        order = np.argsort(rows.participant, kind="stable")
        place = np.empty(len(order), dtype=np.intp)
        place[order] = np.arange(len(order)) - np.repeat(np.cumsum(counts) - counts, counts)
        longest = int(counts.max())
        self.p, self.q = rows.fixed.shape[1], rows.random.shape[1]
        self.felt, self.trials = np.zeros((groups, longest)), np.zeros((groups, longest))
        self.fixed = np.zeros((groups, longest, self.p))
        self.random = np.zeros((groups, longest, self.q))
        for target, source in (
            (self.felt, rows.felt),
            (self.trials, rows.trials),
            (self.fixed, rows.fixed),
            (self.random, rows.random),
        ):
            target[rows.participant, place] = source
        self.lower = np.tril_indices(self.q)
        self._outer = self.random[..., self.lower[0], None] * self.random[..., None, self.lower[0]]
        self._modes = np.zeros((groups, self.q))
        self._take(nodes)

    def _take(self, nodes: int) -> None:
        self.nodes = nodes
        self._points, self._log_weights = _nodes(nodes, self.q)

    def refine(self) -> bool:
        """Take the next larger number of nodes; return whether there is one."""
        if self.nodes == max(_LINES):
            return False
        self._take(_finer(self.nodes))
        return True

    def rests(self, parameters: Array, value: float, tolerance: float) -> bool:
        """Return whether the log likelihood stays what it is with the next number of nodes.

        The largest number is compared with the one before, which may be off by more.
        """
        largest = self.nodes == max(_LINES)
        other = _NUMBERS[-2] if largest else _finer(self.nodes)
        at = self._integrate(parameters, *_nodes(other, self.q))
        return abs(float(at.values.sum()) - value) < tolerance * (_COARSER if largest else 1)

    def start(self) -> Array:
        """Return least-squares coefficients of empirical predictors, and standard deviations of 0.7."""
        seen = self.trials > 0
        predictors = self.link.predictor((self.felt + 0.5) / (self.trials + 1))
        beta = np.linalg.lstsq(self.fixed[seen], predictors[seen], rcond=None)[0]
        return np.concatenate([beta, 0.7 * np.eye(self.q)[self.lower]])

    def split(self, parameters: Array) -> tuple[Array, Array]:
        """Return fixed effects and the factor."""
        factor = np.zeros((self.q, self.q))
        factor[self.lower] = parameters[self.p :]
        return parameters[: self.p], factor

    def log_likelihood(self, parameters: Array) -> float:
        """Return the marginal log likelihood."""
        return float(self._integrate(parameters, self._points, self._log_weights).values.sum())

    def derivatives(self, parameters: Array) -> Derivatives:
        """Return the marginal log likelihood and its derivatives."""
        at = self._integrate(parameters, self._points, self._log_weights)
        slopes, curvatures = self.link.derivatives(self.felt[:, None], self.trials[:, None], at.predictors)
        scores = self._scores(slopes, at.places)
        weighted = at.weights[..., None] * scores
        gradient_of = weighted.sum(axis=1)
        information = self._curvature(at.weights[..., None] * curvatures, at.places)
        count = scores.shape[2]
        information -= weighted.reshape(-1, count).T @ scores.reshape(-1, count)
        information += gradient_of.T @ gradient_of
        return Derivatives(float(at.values.sum()), gradient_of.sum(axis=0), information)

    def _scores(self, slopes: Array, places: Array) -> Array:
        """Return the log likelihood's slopes at each node, shape (groups, nodes, parameters).

        A predictor moves with b as x does, and with each entry of the factor as z times u.
        """
        rows_of, columns_of = self.lower
        of_factor = (slopes @ self.random)[..., rows_of] * places[..., columns_of]
        return np.concatenate([slopes @ self.fixed, of_factor], axis=2)

    def _curvature(self, spread: Array, places: Array) -> Array:
        """Return the nodes' mean curvature by the parameters, from the rows' moments of u over the nodes."""
        rows_of, columns_of = self.lower
        groups, _, q = places.shape
        over_nodes = spread.transpose(0, 2, 1)
        first = (over_nodes @ places)[..., columns_of] * self.random[..., rows_of]
        squares = (places[..., None] * places[..., None, :]).reshape(groups, -1, q * q)
        second = (over_nodes @ squares).reshape(groups, -1, q, q)
        second = second[..., columns_of[:, None], columns_of]
        flat = self.fixed.reshape(-1, self.p)
        crossed = flat.T @ first.reshape(len(flat), -1)
        found = np.empty((self.p + len(rows_of), self.p + len(rows_of)))
        found[: self.p, : self.p] = (flat.T * spread.sum(axis=1).ravel()) @ flat
        found[: self.p, self.p :], found[self.p :, : self.p] = crossed, crossed.T
        found[self.p :, self.p :] = (second * self._outer).sum(axis=(0, 1))
        return found

    def _integrate(self, parameters: Array, points: Array, log_weights: Array) -> "_Integrals":
        beta, factor = self.split(parameters)
        effects = self.random @ factor
        base = self.fixed @ beta
        modes, curvature = self._find_modes(base, effects)
        scale = np.linalg.inv(np.linalg.cholesky(curvature)).transpose(0, 2, 1)
        places = modes[:, None] + points @ scale.transpose(0, 2, 1)
        predictors = base[:, None] + places @ effects.transpose(0, 2, 1)
        logs = self.link.log_likelihood(self.felt[:, None], self.trials[:, None], predictors).sum(axis=2)
        logs += log_weights - 0.5 * (places**2).sum(axis=2)
        largest = logs.max(axis=1, keepdims=True)
        shares = np.exp(logs - largest)
        totals = shares.sum(axis=1, keepdims=True)
        scales = np.log(np.abs(np.diagonal(scale, axis1=1, axis2=2))).sum(axis=1)
        return _Integrals((largest + np.log(totals))[:, 0] + scales, shares / totals, places, predictors)

    def _find_modes(self, base: Array, effects: Array) -> tuple[Array, Array]:
        """Return the modes of the participants' posteriors of u, and the curvature there.

        Newton's steps are shortened to log(1 + d) / d where they move a predictor by d: so short, they always
        climb (T. Sun and Q. Tran-Dinh, 2019, Math. Program. 178, 145-213, for the logistic function), while
        full steps may swing to and fro for ever where people differ by several logits.
        """
        modes, turned = self._modes, effects.transpose(0, 2, 1)
        identity = np.eye(self.q)
        for _ in range(_MODE_STEPS):
            predictors = base + (effects @ modes[..., None])[..., 0]
            slopes, spread = self.link.scoring(self.felt, self.trials, predictors)
            slope = (turned @ slopes[..., None])[..., 0] - modes
            curvature = turned @ (effects * spread[..., None]) + identity
            step = np.linalg.solve(curvature, slope[..., None])
            moved = np.abs(effects @ step).max(axis=(1, 2))
            shortened = np.where(moved > _MODE_CLOSE, np.log1p(moved) / np.maximum(moved, _MODE_CLOSE), 1.0)
            modes = modes + shortened[:, None] * step[..., 0]
            if moved.max() < (_MODE_EXACT if self.nodes == 1 else _MODE_CLOSE):
                break
        self._modes = modes
        return modes, curvature


@dataclass(frozen=True, eq=False)
class _Integrals:
    """Each participant's log likelihood, and of the nodes: posterior weights, places u, rows' predictors."""

    values: Array
    weights: Array
    places: Array
    predictors: Array


def _finer(nodes: int) -> int:
    """Return the next larger number of nodes."""
    return next(each for each in _NUMBERS if each > nodes)


@lru_cache(maxsize=16)
def _nodes(count: int, dimensions: int) -> tuple[Array, Array]:
    """Return nodes of shape (k, q), and log weights of shape (k,) for integrals of functions of them.

    Few nodes are those of Gauss and Hermite, whose weights hold the inverse of the normal density that they
    were made for. Where people differ by several logits a posterior is steep on one side of its mode and as
    wide as the prior on the other. Then even steps of x with the nodes at sinh(a x) / a do better: they
    lie close at the mode and reach far.
    """
    if count in _LINES:
        spread, reach = _LINES[count]
        even = np.linspace(-reach, reach, count)
        x, logs = np.sinh(spread * even) / spread, np.log((even[1] - even[0]) * np.cosh(spread * even))
    else:
        x, weights = np.polynomial.hermite_e.hermegauss(count)
        logs = np.log(weights) + 0.5 * x**2
    grids = np.meshgrid(*[x] * dimensions, indexing="ij")
    log_grids: Sequence[Array] = np.meshgrid(
        *[logs - 0.5 * math.log(2 * math.pi)] * dimensions, indexing="ij"
    )
    return np.stack([g.ravel() for g in grids], axis=1), np.sum([w.ravel() for w in log_grids], axis=0)
