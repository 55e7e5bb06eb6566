"""Mixed models of answers: random effects per participant, by adaptive Gauss-Hermite quadrature or Laplace.

Answers of participant g in a row (a condition): y of n felt, logit (or probit) of the probability x'b + z'Lu
with u standard normal and L a lower triangular factor of the random effects' covariance. The likelihood
integrates over u. With the nodes of the quadrature at the mode of each participant's posterior, scaled by its
curvature, the sums also give the exact score and information of the likelihood (Louis, 1982), because the
predictor is linear in b and L given u. So plain Newton steps do.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from autd_analysis.models.links import LOGIT, Link

Array = NDArray[np.float64]

DEFAULT_NODES = 9
"""Per random effect; more are taken where people differ so much that 9 are too few."""

SINGULAR = 1e-3
"""A standard deviation of random effects below it is practically zero."""

_MOST_STEPS = 60
_CONVERGED = 1e-7
_NEARLY_CONVERGED = 1e-3
_SMALLEST_STEP = 1e-3
_MORE_NODES = {9: 21, 21: 41}
_MODE_STEPS = 30
_MODE_CONVERGED = 1e-9
_LARGEST_LOGIT = 15.0
_CORRELATED = 0.999


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
class GlmmFit:
    """A fitted model.

    Attributes
    ----------
    coefficients
        Fixed effects in units of the link (logits), shape (p,).
    parameter_covariance
        Of the fixed effects and then the entries of the factor, row by row, from the observed information.
    factor
        Lower triangular factor of the random effects' covariance, (q, q); its diagonal is not negative.
    log_likelihood
        Marginal log likelihood without the binomial coefficients.
    nodes
        Nodes per random effect; 1 is Laplace's approximation.
    converged
        Whether the steps came to rest, where the likelihood is curved in all fixed effects.
    singular
        Whether a variance is practically zero or a correlation practically 1.
    """

    coefficients: Array
    parameter_covariance: Array
    factor: Array
    log_likelihood: float
    nodes: int
    converged: bool
    singular: bool

    @property
    def covariance(self) -> Array:
        """Covariance of the fixed effects, shape (p, p)."""
        count = len(self.coefficients)
        return self.parameter_covariance[:count, :count]

    @property
    def standard_deviations(self) -> Array:
        """Standard deviations of the random effects in units of the link."""
        deviations: Array = np.sqrt(np.diag(self.factor @ self.factor.T))
        return deviations


def fit_glmm(rows: BinomialRows, nodes: int = DEFAULT_NODES, link: Link = LOGIT) -> GlmmFit:
    """Fit a mixed model by maximum likelihood.

    Parameters
    ----------
    rows
        The answers.
    nodes
        Nodes of the quadrature per random effect; 1 for Laplace's approximation.
    link
        Logit or probit.

    Returns
    -------
    GlmmFit
        The estimates. Where answers are separated estimates grow without bound: `converged` is then False.
    """
    model = _Model(rows, nodes, link)
    start = model.start()
    if nodes == 1:
        start, converged, information = _climb(_Model(rows, DEFAULT_NODES, link), start)
        if converged:
            start, converged, information = _climb_laplace(model, start, information)
        return _result(model, start, converged, information)
    return _result(model, *_climb(model, start))


def likelihood_ratio(full: GlmmFit, reduced: GlmmFit, df: int) -> tuple[float, float]:
    """Return statistic and p of the likelihood-ratio test of nested models, `df` parameters apart."""
    from scipy.special import chdtrc

    statistic = max(0.0, 2 * (full.log_likelihood - reduced.log_likelihood))
    return statistic, float(chdtrc(df, statistic))


@dataclass(frozen=True, eq=False)
class _Integrals:
    """Each participant's log likelihood, and of the nodes: posterior weights, places u, rows' predictors."""

    values: Array
    weights: Array
    places: Array
    predictors: Array


class _Model:
    """The rows by participant, padded with rows without trials, and the likelihood's derivatives."""

    def __init__(self, rows: BinomialRows, nodes: int, link: Link) -> None:
        self.link = link
        groups = int(rows.participant.max()) + 1
        counts = np.bincount(rows.participant, minlength=groups)
        longest = int(counts.max())
        place = np.zeros(len(rows.participant), dtype=np.intp)
        for group in range(groups):
            place[rows.participant == group] = np.arange(counts[group])
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
        self.nodes = nodes
        self.points, self.log_weights = _hermite(nodes, self.q)
        self._modes = np.zeros((groups, self.q))

    def start(self) -> Array:
        """Return least-squares coefficients of empirical predictors, and standard deviations of 0.7."""
        seen = self.trials > 0
        predictors = self.link.predictor((self.felt + 0.5) / (self.trials + 1))
        beta = np.linalg.lstsq(self.fixed[seen], predictors[seen], rcond=None)[0]
        return np.concatenate([beta, 0.7 * np.eye(self.q)[self.lower]])

    def refine(self) -> bool:
        """Take more nodes, for posteriors far from normal; return whether there were more to take."""
        if self.nodes not in _MORE_NODES:
            return False
        self.nodes = _MORE_NODES[self.nodes]
        self.points, self.log_weights = _hermite(self.nodes, self.q)
        return True

    def split(self, parameters: Array) -> tuple[Array, Array]:
        """Return fixed effects and the factor."""
        factor = np.zeros((self.q, self.q))
        factor[self.lower] = parameters[self.p :]
        return parameters[: self.p], factor

    def log_likelihood(self, parameters: Array) -> float:
        """Return the marginal log likelihood."""
        return float(self._integrate(parameters).values.sum())

    def derivatives(self, parameters: Array) -> tuple[float, Array, Array]:
        """Return the marginal log likelihood, its gradient, and the observed information."""
        at = self._integrate(parameters)
        slopes, curvatures = self.link.derivatives(self.felt[:, None], self.trials[:, None], at.predictors)
        scores = self._scores(slopes, at.places)
        weighted = at.weights[..., None] * scores
        gradient_of = weighted.sum(axis=1)
        information = self._curvature(at.weights[..., None] * curvatures, at.places)
        information -= np.tensordot(weighted, scores, axes=([0, 1], [0, 1]))
        information += gradient_of.T @ gradient_of
        return float(at.values.sum()), gradient_of.sum(axis=0), information

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
        outer = self.random[..., rows_of, None] * self.random[..., None, rows_of]
        return np.block(
            [
                [self._over_rows(spread.sum(axis=1)[..., None] * self.fixed), self._over_rows(first)],
                [self._over_rows(first).T, (second * outer).sum(axis=(0, 1))],
            ]
        )

    def _over_rows(self, values: Array) -> Array:
        """Return the sum over all rows of the fixed design times values."""
        found: Array = np.tensordot(self.fixed, values, axes=([0, 1], [0, 1]))
        return found

    def _integrate(self, parameters: Array) -> "_Integrals":
        beta, factor = self.split(parameters)
        effects = self.random @ factor
        base = self.fixed @ beta
        modes, curvature = self._find_modes(base, effects)
        scale = np.linalg.inv(np.linalg.cholesky(curvature)).transpose(0, 2, 1)
        places = modes[:, None] + (scale[:, None] @ self.points[..., None])[..., 0]
        predictors = base[:, None] + places @ effects.transpose(0, 2, 1)
        logs = self.link.log_likelihood(self.felt[:, None], self.trials[:, None], predictors).sum(axis=2)
        logs += self.log_weights + 0.5 * (self.points**2).sum(axis=1) - 0.5 * (places**2).sum(axis=2)
        largest = logs.max(axis=1, keepdims=True)
        shares = np.exp(logs - largest)
        totals = shares.sum(axis=1, keepdims=True)
        values = (largest + np.log(totals))[:, 0] + np.log(np.abs(np.linalg.det(scale)))
        return _Integrals(values, shares / totals, places, predictors)

    def _find_modes(self, base: Array, effects: Array) -> tuple[Array, Array]:
        """Return the modes of the participants' posteriors of u, and the curvature there."""
        modes = self._modes
        for _ in range(_MODE_STEPS):
            predictors = base + np.einsum("grq,gq->gr", effects, modes)
            slopes, spread = self.link.derivatives(self.felt, self.trials, predictors)
            slope = np.einsum("grq,gr->gq", effects, slopes) - modes
            curvature = np.einsum("gri,gr,grj->gij", effects, spread, effects) + np.eye(self.q)
            step = np.linalg.solve(curvature, slope[..., None])[..., 0]
            step *= np.minimum(1.0, 3.0 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-12))
            modes = modes + step
            if np.abs(step).max() < _MODE_CONVERGED:
                break
        self._modes = modes
        return modes, curvature


def _climb(model: _Model, start: Array) -> tuple[Array, bool, Array]:
    """Return the maximum by Newton steps, whether they came to rest, and the information there."""
    parameters = start
    value, gradient, information = model.derivatives(parameters)
    for _ in range(_MOST_STEPS):
        step = _ascent(information, gradient)
        gain = float(gradient @ step)
        if abs(gain) < _CONVERGED:
            return parameters + step, True, information
        size = 1.0
        tried = model.derivatives(parameters + step)
        while tried[0] < value + 1e-4 * size * gain - 1e-12 and size > _SMALLEST_STEP:
            size /= 2
            tried = model.derivatives(parameters + size * step)
        if size <= _SMALLEST_STEP:  # the sums' value and slope disagree: too few nodes
            if not model.refine():
                return parameters, gain < _NEARLY_CONVERGED, information
            value, gradient, information = model.derivatives(parameters)
            continue
        parameters = parameters + size * step
        value, gradient, information = tried
        if np.abs(parameters[: model.p]).max() > _LARGEST_LOGIT:
            return parameters, False, information
    return parameters, False, information


def _ascent(information: Array, gradient: Array) -> Array:
    """Return a Newton step that goes uphill, of at most 2 in each parameter."""
    values, vectors = np.linalg.eigh(information)
    bounded = np.maximum(np.abs(values), 1e-6 * max(1.0, float(np.abs(values).max())))
    step: Array = vectors @ ((vectors.T @ gradient) / bounded)
    return step * min(1.0, 2.0 / max(float(np.abs(step).max()), 1e-12))


def _climb_laplace(model: _Model, start: Array, information: Array) -> tuple[Array, bool, Array]:
    """Maximise Laplace's approximation, whose slopes are taken by differences, as `_climb` does.

    It starts where the quadrature has its maximum, which is close by and has nearly the same information.
    """
    parameters, value = start, model.log_likelihood(start)
    for _ in range(_MOST_STEPS):
        gradient = _gradient(model.log_likelihood, parameters)
        step = _ascent(information, gradient)
        gain = float(gradient @ step)
        if abs(gain) < _CONVERGED:
            return parameters, True, -_hessian(model.log_likelihood, parameters)
        size = 1.0
        while (tried := model.log_likelihood(parameters + size * step)) < value and size > _SMALLEST_STEP:
            size /= 2
        if size <= _SMALLEST_STEP:  # as high as rounding lets it get
            return parameters, gain < _NEARLY_CONVERGED, -_hessian(model.log_likelihood, parameters)
        parameters, value = parameters + size * step, tried
    return parameters, False, information


def _gradient(function: Callable[[Array], float], at: Array, step: float = 1e-4) -> Array:
    moves = step * np.eye(len(at))
    return np.array([function(at + move) - function(at - move) for move in moves]) / (2 * step)


def _hessian(function: Callable[[Array], float], at: Array, step: float = 1e-3) -> Array:
    size = len(at)
    moves = step * np.eye(size)
    hessian = np.empty((size, size))
    for i in range(size):
        for j in range(i + 1):
            corners = [
                function(at + a * moves[i] + b * moves[j]) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))
            ]
            hessian[i, j] = hessian[j, i] = (corners[0] - corners[1] - corners[2] + corners[3]) / (
                4 * step**2
            )
    return hessian


def _result(model: _Model, parameters: Array, converged: bool, information: Array) -> GlmmFit:
    beta, factor = model.split(parameters)
    signs = np.where(np.diag(factor) < 0, -1.0, 1.0)  # the sign of a column means nothing
    turned = np.concatenate([np.ones(model.p), signs[model.lower[1]]])
    covariance = np.asarray(np.linalg.pinv(information, hermitian=True), float)
    factor = factor * signs
    return GlmmFit(
        coefficients=beta,
        parameter_covariance=covariance * np.outer(turned, turned),
        factor=factor,
        log_likelihood=model.log_likelihood(parameters),
        nodes=model.nodes,
        converged=converged and bool((np.linalg.eigvalsh(covariance[: model.p, : model.p]) > 0).all()),
        singular=_is_singular(factor),
    )


def _is_singular(factor: Array) -> bool:
    deviations = np.sqrt((factor**2).sum(axis=1))
    if deviations.min() < SINGULAR:
        return True
    correlations = (factor @ factor.T) / np.outer(deviations, deviations)
    return bool((np.abs(correlations[np.tril_indices(len(factor), -1)]) > _CORRELATED).any())


@lru_cache(maxsize=16)
def _hermite(nodes: int, dimensions: int) -> tuple[Array, Array]:
    """Return nodes and log weights for integrals over a standard normal density, shape (k, q) and (k,)."""
    x, w = np.polynomial.hermite_e.hermegauss(nodes)
    grids = np.meshgrid(*[x] * dimensions, indexing="ij")
    weights: Sequence[Array] = np.meshgrid(
        *[np.log(w) - 0.5 * math.log(2 * math.pi)] * dimensions, indexing="ij"
    )
    return np.stack([g.ravel() for g in grids], axis=1), np.sum([w.ravel() for w in weights], axis=0)
