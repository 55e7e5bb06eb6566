"""Mixed models of answers: random effects per participant, by maximum likelihood.

The likelihood and its derivatives are those of `models.marginal`, so that plain Newton steps climb it. The
random effects enter by a factor L of their covariance LL', in which nothing is special about a variance of 0
or a correlation of 1: there an entry of L is 0, and the likelihood is even in it.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.models.contrasts import null_space
from autd_analysis.models.links import LOGIT, Link
from autd_analysis.models.marginal import DEFAULT_NODES, BinomialRows, Derivatives, Marginal

Array = NDArray[np.float64]
Trouble = Literal["unbounded", "undetermined", "not at rest"]

TROUBLES: dict[Trouble, str] = {
    "unbounded": "estimates grow without bound, as where in a condition every participant felt all or none",
    "undetermined": "the model's parameters are not identified",
    "not at rest": "the fit did not come to rest",
}
"""Why there is no fit, in words."""

SINGULAR = 1e-3
"""A standard deviation of random effects below it is practically zero."""

_MOST_STEPS = 100
_SMALLEST_STEP = 1e-3
_CONVERGED, _NEARLY_CONVERGED = 1e-7, 1e-3  # what the next step promises to gain in log likelihood
_RESTING = 5e-5  # what the next number of nodes may change in it
_LITTLE = 5e-3  # what may be left to gain where estimates grow without bound
_DOWNWARD, _OFF_A_SADDLE = 1e-4, 0.1
_LARGEST_DEVIATION, _FARTHEST = 20.0, 40.0  # logits: that are estimates, and that are climbed to
_FAR_LOGIT, _UNCERTAIN = 10.0, 30.0
_FLAT, _INVOLVED = 1e-5, 1e-3
_CORRELATED = 0.999
_LEAST_START = 0.3
_MATTERS = 1.0  # chi-squared for a contrast
_AT_ITS_WORST = 0.3  # how far the log likelihood by 9 nodes is off where more are needed


@dataclass(frozen=True, eq=False)
class GlmmFit:
    """A fitted model.

    Attributes
    ----------
    coefficients
        Fixed effects in units of the link (logits), shape (p,).
    parameter_covariance
        Of the fixed effects and then the entries of the factor, row by row, from the observed information;
        zero where the likelihood is flat, as in an entry that does not matter at a variance of 0.
    factor
        Lower triangular factor of the random effects' covariance, (q, q); its diagonal is not negative.
    log_likelihood
        Marginal log likelihood without the binomial coefficients.
    nodes
        Nodes per random effect; 1 is Laplace's approximation.
    trouble
        Why these are no estimates; None if they are.
    rested
        Whether the log likelihood is as good as the highest, also where estimates grow without bound.
    singular
        Whether a variance is practically zero or a correlation practically 1.
    """

    coefficients: Array
    parameter_covariance: Array
    factor: Array
    log_likelihood: float
    nodes: int
    trouble: Trouble | None
    rested: bool
    singular: bool

    @property
    def converged(self) -> bool:
        """Whether these are estimates."""
        return self.trouble is None

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


@dataclass(frozen=True, eq=False)
class Nested:
    """A model, the same without some of its contrasts, and the likelihood-ratio test of the two.

    Attributes
    ----------
    full, reduced
        The fits, by the same nodes.
    statistic, p
        Of the likelihood-ratio test.
    """

    full: GlmmFit
    reduced: GlmmFit
    statistic: float
    p: float


def fit_glmm(
    rows: BinomialRows, nodes: int = DEFAULT_NODES, link: Link = LOGIT, start: Array | None = None
) -> GlmmFit:
    """Fit a mixed model by maximum likelihood.

    Parameters
    ----------
    rows
        The answers.
    nodes
        Nodes of the quadrature per random effect to begin with: 9, 15, 25, 41, 61 or 101; more are taken
        until the log likelihood rests. 1 for Laplace's approximation.
    link
        Logit or probit.
    start
        Where to begin: fixed effects, and the entries of the factor row by row.

    Returns
    -------
    GlmmFit
        The estimates, or in what trouble they are.
    """
    model = Marginal(rows, nodes, link)
    begin = model.start() if start is None else start
    if nodes == 1:
        return _result(model, _climb_laplace(model, _newton(Marginal(rows, DEFAULT_NODES, link), begin)))
    return _result(model, _climb(model, begin))


def fit_nested(
    rows: BinomialRows,
    contrasts: Array,
    nodes: int = DEFAULT_NODES,
    link: Link = LOGIT,
    full: GlmmFit | None = None,
) -> Nested | Trouble:
    """Test by the likelihood ratio whether contrasts of the fixed effects are zero.

    Parameters
    ----------
    rows
        The answers.
    contrasts
        Of full rank, shape (k, p).
    nodes, link
        As in `fit_glmm`.
    full
        The fit of these rows, where it is known already.

    Returns
    -------
    Nested or Trouble
        Both fits by the same nodes: those with which both likelihoods rest. In what trouble the full model
        is, or that the other did not come to rest; its likelihood may do so where its estimates do not.
    """
    full = full or fit_glmm(rows, nodes, link)
    if full.trouble:
        return full.trouble
    basis = null_space(contrasts)
    fewer = BinomialRows(rows.felt, rows.trials, rows.fixed @ basis, rows.random, rows.participant)
    reduced = _fit_reduced(fewer, basis.T @ full.coefficients, contrasts @ full.coefficients, full, link)
    if not reduced.rested:
        return "not at rest"
    if full.nodes < reduced.nodes:
        full = fit_glmm(rows, reduced.nodes, link, np.concatenate([full.coefficients, _entries(full.factor)]))
    if full.trouble:
        return full.trouble
    statistic = max(0.0, 2 * (full.log_likelihood - reduced.log_likelihood))
    return Nested(full, reduced, statistic, _upper_chi2(statistic, len(contrasts)))


def _fit_reduced(rows: BinomialRows, beta: Array, effects: Array, full: GlmmFit, link: Link) -> GlmmFit:
    """Fit the model without the effects, from where the full one is.

    The people's slopes must then hold the effect, which they may do with a correlation near 1 or near -1:
    there may be a maximum at either, and it is looked for where the effect matters.
    """
    floor = np.diag(
        np.maximum(0.0, _LEAST_START - np.diag(full.factor))
    )  # off the ridge of correlations of 1
    best = fit_glmm(rows, full.nodes, link, np.concatenate([beta, _entries(full.factor + floor)]))
    matters = 2 * (full.log_likelihood - best.log_likelihood) > _MATTERS * len(effects)
    if len(full.factor) != 2 or not matters:
        return best
    intercept = max(_LEAST_START, float(full.factor[0, 0]))
    margin = 2 * _NEARLY_CONVERGED if best.nodes == DEFAULT_NODES else -_AT_ITS_WORST
    slope = math.hypot(*full.factor[1], float(np.abs(effects).max()), _LEAST_START)
    for correlation in (-0.9, 0.9):
        entries = [intercept, correlation * slope, math.sqrt(1 - correlation**2) * slope]
        other = _newton(
            Marginal(rows, DEFAULT_NODES, link), np.concatenate([beta, entries]), _NEARLY_CONVERGED
        )
        if other.at.value < best.log_likelihood + margin:
            continue
        found = fit_glmm(rows, full.nodes, link, other.parameters)
        if found.rested and found.log_likelihood > best.log_likelihood + _RESTING:
            best = found
    return best


def _entries(factor: Array) -> Array:
    return factor[np.tril_indices(len(factor))]


@dataclass(frozen=True, eq=False)
class _Rest:
    """Where steps ended, the derivatives there, and what was gained no more."""

    parameters: Array
    at: Derivatives
    trouble: Trouble | None
    rested: bool


def _climb(model: Marginal, start: Array) -> _Rest:
    """Return the maximum by as many nodes as the likelihood needs to rest."""
    rest = _newton(model, start)
    while not (rest.rested and model.rests(rest.parameters, rest.at.value, _RESTING)):
        if not model.refine():
            return dataclasses.replace(rest, trouble=rest.trouble or "not at rest", rested=False)
        rest = _newton(model, rest.parameters)
    return rest


def _newton(model: Marginal, parameters: Array, enough: float = _CONVERGED) -> _Rest:
    """Climb by Newton's steps; they may fail near the maximum, where nodes are too few."""
    at = model.derivatives(parameters)
    for _ in range(_MOST_STEPS):
        step = _ascent(at)
        gain = float(at.gradient @ step)
        if gain < enough:
            upward = _off_a_saddle(at)
            if upward is None:
                return _Rest(parameters + step, at, None, rested=True)
            step = upward
        size = 1.0
        tried = model.derivatives(parameters + step)
        while not _better(at, tried, size * gain) and size > _SMALLEST_STEP:
            size /= 2
            tried = model.derivatives(parameters + size * step)
        if size <= _SMALLEST_STEP:  # the sums' value and slope disagree: too few nodes
            near = gain < _NEARLY_CONVERGED
            return _Rest(parameters, at, None if near else "not at rest", rested=near)
        parameters, at = parameters + size * step, tried
        if _deviation(model, parameters) > _FARTHEST:
            return _Rest(parameters, at, "unbounded", rested=gain < _LITTLE)
    return _Rest(parameters, at, "not at rest", rested=False)


def _better(at: Derivatives, tried: Derivatives, gain: float) -> bool:
    return tried.value >= at.value + 1e-4 * gain - 1e-12


def _ascent(at: Derivatives) -> Array:
    """Return a Newton step that goes uphill, of at most 2 in each parameter."""
    values, vectors = np.linalg.eigh(at.information)
    bounded = np.maximum(np.abs(values), 1e-6 * max(1.0, float(np.abs(values).max())))
    step: Array = vectors @ ((vectors.T @ at.gradient) / bounded)
    return step * min(1.0, 2.0 / max(float(np.abs(step).max()), 1e-12))


def _off_a_saddle(at: Derivatives) -> Array | None:
    """Return a step along which the likelihood curves upward where its slope is zero; None at a maximum."""
    values, vectors = np.linalg.eigh(at.information)
    return _OFF_A_SADDLE * vectors[:, 0] if values[0] < -_DOWNWARD * max(1.0, float(values[-1])) else None


def _deviation(model: Marginal, parameters: Array) -> float:
    """Return the largest standard deviation of a random effect."""
    return math.sqrt((model.split(parameters)[1] ** 2).sum(axis=1).max())


def _climb_laplace(model: Marginal, near: _Rest) -> _Rest:
    """Maximise Laplace's approximation, whose slopes are taken by differences, as `_newton` does.

    It starts where the quadrature has its maximum, which is close by and has nearly the same information.
    """
    function, parameters = model.log_likelihood, near.parameters
    trouble: Trouble | None = "not at rest"
    for _ in range(_MOST_STEPS):
        at = Derivatives(function(parameters), _gradient(function, parameters), near.at.information)
        step = _ascent(at)
        gain, size = float(at.gradient @ step), 1.0
        while function(parameters + size * step) < at.value and size > _SMALLEST_STEP:
            size /= 2
        if gain < _CONVERGED or size <= _SMALLEST_STEP:  # as high as rounding lets it get
            trouble = None if gain < _NEARLY_CONVERGED else trouble
            break
        parameters = parameters + size * step
    at = Derivatives(function(parameters), at.gradient, -_hessian(function, parameters))
    return _Rest(parameters, at, trouble, rested=trouble is None)


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


def _result(model: Marginal, rest: _Rest) -> GlmmFit:
    beta, factor = model.split(rest.parameters)
    signs = np.where(np.diag(factor) < 0, -1.0, 1.0)  # the sign of a column means nothing
    turned = np.concatenate([np.ones(model.p), signs[model.lower[1]]])
    covariance, flat = _covariance(rest.at.information, model.p)
    trouble = rest.trouble
    if trouble is None and (flat or np.diag(covariance)[: model.p].max() > _UNCERTAIN**2):
        trouble = "unbounded" if np.abs(beta).max() > _FAR_LOGIT else "undetermined"
    elif trouble is None and _deviation(model, rest.parameters) > _LARGEST_DEVIATION:
        trouble = "unbounded"
    factor = factor * signs
    return GlmmFit(
        coefficients=beta,
        parameter_covariance=covariance * np.outer(turned, turned),
        factor=factor,
        log_likelihood=model.log_likelihood(rest.parameters),
        nodes=model.nodes,
        trouble=trouble,
        rested=rest.rested,
        singular=_is_singular(factor),
    )


def _covariance(information: Array, fixed: int) -> tuple[Array, bool]:
    """Return the inverse of the information where it is curved, and whether it is flat in a fixed effect."""
    values, vectors = np.linalg.eigh(information)
    curved = values > _FLAT
    inverse: Array = (vectors[:, curved] / values[curved]) @ vectors[:, curved].T
    return inverse, bool(np.abs(vectors[:fixed, ~curved]).max(initial=0.0) > _INVOLVED)


def _is_singular(factor: Array) -> bool:
    deviations = np.sqrt((factor**2).sum(axis=1))
    if deviations.min() < SINGULAR:
        return True
    correlations = (factor @ factor.T) / np.outer(deviations, deviations)
    return bool((np.abs(correlations[np.tril_indices(len(factor), -1)]) > _CORRELATED).any())


def _upper_chi2(statistic: float, df: int) -> float:
    from scipy.special import chdtrc

    return float(chdtrc(df, statistic))
