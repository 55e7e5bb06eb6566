"""Estimated means of all conditions and simple effects by one mixed model of all answers.

Every condition has a fixed effect; the intercept and the slope of the compared factor vary over participants.
A mean comes in two kinds. That of the average participant has random effects of zero. That of the population
is the average of all participants' probabilities, over the normal distribution of random effects; it is nearer
to 1/2. Standard errors of functions of the parameters are by the delta method.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.adjustment import holm
from analysis.design import Condition, Design
from analysis.intervals import Interval, wald_interval
from analysis.models.cells import (
    FEWEST_PARTICIPANTS,
    Compared,
    cell_rows,
    contrast,
    is_separated,
    participants,
    penalised,
    planned,
    without,
)
from analysis.models.glmm import DEFAULT_NODES, BinomialRows, GlmmFit, fit_glmm, likelihood_ratio
from analysis.models.links import LOGIT, PROBIT, Link
from analysis.rates import ParticipantRate

LinkName = Literal["logit", "probit"]
LINKS: dict[LinkName, Link] = {"logit": LOGIT, "probit": PROBIT}

Array = NDArray[np.float64]

_NORMAL_GRID = np.linspace(-8.0, 8.0, 257)
_NORMAL_WEIGHTS = np.exp(-0.5 * _NORMAL_GRID**2) / np.exp(-0.5 * _NORMAL_GRID**2).sum()
_DIFFERENCE = 1e-5


@dataclass(frozen=True)
class ModelMean:
    """The estimated mean of a condition.

    Attributes
    ----------
    condition
        The factors' levels.
    predictor, standard_error
        In units of the link (logits), of the average participant.
    average, average_interval
        Probability that the average participant feels it; the interval is Wald's in units of the link.
    population, population_interval
        Probability over all people; the interval is Wald's likewise.
    """

    condition: Condition
    predictor: float
    standard_error: float
    average: float
    average_interval: Interval
    population: float
    population_interval: Interval


@dataclass(frozen=True)
class SimpleEffect:
    """The compared factor's effect at a level of another factor, for the average participant.

    Attributes
    ----------
    at
        The level of the other factor; empty if it is the mean effect over all.
    difference, standard_error, interval
        First minus second in units of the link, with Wald's 95 % interval.
    z, p, p_holm
        Wald's test, and its p after Holm's adjustment over the model's simple effects.
    """

    at: Condition
    difference: float
    standard_error: float
    interval: Interval
    z: float
    p: float
    p_holm: float


@dataclass(frozen=True)
class ModelInteraction:
    """Likelihood-ratio test that an effect is the same at all levels of another factor."""

    over: str
    statistic: float
    df: int
    p: float


@dataclass(frozen=True, eq=False)
class CellModel:
    """A mixed model of all answers.

    Attributes
    ----------
    link
        What the predictor is in: logits, or standard deviations of noise (probit).
    compared
        What has a random slope; None if nothing is compared.
    participants, trials
        How many there are.
    fit
        The fitted model; None where none could be fitted.
    penalised
        Whether answers are separated, so that half an answer of each kind was added to every condition.
    means, effects, interaction
        Empty or None where undefined.
    notes
        What could not be done, and why.
    """

    link: LinkName
    compared: Compared | None
    participants: int
    trials: int
    fit: GlmmFit | None
    penalised: bool
    means: tuple[ModelMean, ...]
    effects: tuple[SimpleEffect, ...]
    interaction: ModelInteraction | None
    notes: tuple[str, ...]

    @property
    def correlation(self) -> float | None:
        """Correlation of intercept and slope over participants; None without either."""
        if self.fit is None or len(self.fit.factor) < 2 or self.fit.standard_deviations.min() == 0:
            return None
        return float((self.fit.factor @ self.fit.factor.T)[0, 1] / self.fit.standard_deviations.prod())


def cell_models(rates: Sequence[ParticipantRate], design: Design) -> tuple[CellModel, ...]:
    """Fit a model of all answers for everything that is compared, by either link.

    Parameters
    ----------
    rates
        Detection rates in the single cells of the design.
    design
        The study's factors and comparisons.

    Returns
    -------
    tuple of CellModel
        Without planned comparisons, the models have a random intercept alone.
    """
    compared = dict.fromkeys(each for each, _ in planned(design)) or {None: None}
    return tuple(
        cell_model(rates, each, [at for other, at in planned(design) if other == each], link)
        for each in compared
        for link in LINKS
    )


def cell_model(
    rates: Sequence[ParticipantRate],
    compared: Compared | None,
    levels: Sequence[Condition],
    link: LinkName = "logit",
    nodes: int = DEFAULT_NODES,
) -> CellModel:
    """Fit one model.

    Parameters
    ----------
    rates
        Detection rates in the single cells of the design.
    compared
        What is compared, and has a random slope.
    levels
        Where simple effects are wanted: levels of another factor; empty for the mean over all.
    link, nodes
        As in `fit_glmm`.

    Returns
    -------
    CellModel
        With notes and without results where there are fewer than 4 participants or nothing converged.
    """
    rows, cells = cell_rows(rates, compared)
    people, trials = participants(rows), int(rows.trials.sum())
    separated = is_separated(rows)
    used = penalised(rows) if separated else rows
    fit = fit_glmm(used, nodes, LINKS[link]) if people >= FEWEST_PARTICIPANTS else None
    notes = _notes(fit, separated)
    if fit is None or not fit.converged:
        return CellModel(link, compared, people, trials, fit, separated, (), (), None, notes)
    every_cell = list(dict.fromkeys(rate.condition for rate in rates))
    contrasts = _contrasts(every_cell, cells, compared, levels) if compared else {}
    return CellModel(
        link=link,
        compared=compared,
        participants=people,
        trials=trials,
        fit=fit,
        penalised=separated,
        means=tuple(_mean(fit, used, place, cell, LINKS[link]) for place, cell in enumerate(cells)),
        effects=_effects(fit, contrasts),
        interaction=_interaction(fit, used, contrasts, LINKS[link]),
        notes=notes,
    )


def _notes(fit: GlmmFit | None, separated: bool) -> tuple[str, ...]:
    if fit is None:
        return (f"no mixed model with fewer than {FEWEST_PARTICIPANTS} participants",)
    notes = []
    if separated:
        notes.append(
            "answers are separated (all or none felt in a condition): half an answer of each kind is added to "
            "every condition, which for the logit is Firth's penalty"
        )
    if not fit.converged:
        notes.append("the mixed model did not converge")
    elif fit.singular:
        notes.append("the mixed model is singular: a variance is 0 or a correlation 1")
    return tuple(notes)


def _contrasts(
    every_cell: Sequence[Condition], cells: Sequence[Condition], compared: Compared, levels: Sequence[Condition]
) -> dict[Condition, Array]:
    """Return the cells' weights in each simple effect of which no cell lacks trials."""
    seen = np.array([cell in cells for cell in every_cell])
    weights = {at: contrast(every_cell, compared, at) for at in levels}
    return {at: each[seen] for at, each in weights.items() if each.any() and not each[~seen].any()}


def _mean(fit: GlmmFit, rows: BinomialRows, place: int, cell: Condition, link: Link) -> ModelMean:
    predictor, variance = float(fit.coefficients[place]), float(fit.covariance[place, place])
    sides = rows.random[rows.fixed[:, place] > 0][0]
    spread = fit.factor.T @ sides
    population = _over_people(predictor, math.hypot(*spread), link)
    gradient = _gradient(fit, place, sides, spread, link)
    error = math.sqrt(max(0.0, gradient @ fit.parameter_covariance @ gradient))
    return ModelMean(
        condition=cell,
        predictor=predictor,
        standard_error=math.sqrt(variance),
        average=_probability(predictor, link),
        average_interval=_back(wald_interval(predictor, math.sqrt(variance)), link),
        population=_probability(population, link),
        population_interval=_back(wald_interval(population, error), link),
    )


def _over_people(predictor: float, deviation: float, link: Link) -> float:
    """Return the population's probability in units of the link.

    The sum over an even grid is exact to many digits: the function is analytic and ends at nothing.
    """
    probability = _NORMAL_WEIGHTS @ link.probability(predictor + deviation * _NORMAL_GRID)
    return float(link.predictor(np.asarray(probability)))


def _gradient(fit: GlmmFit, place: int, sides: Array, spread: Array, link: Link) -> Array:
    """Return the derivatives of the population's predictor by all parameters.

    The standard deviation of a condition's random part is the length of L'z: its derivative by an entry of L
    is z_i (L'z)_j over it. At length zero the population's predictor does not depend on it in first order.
    """
    predictor, deviation = float(fit.coefficients[place]), math.hypot(*spread)
    by_predictor, by_deviation = (
        (
            _over_people(predictor + a * _DIFFERENCE, deviation + b * _DIFFERENCE, link)
            - _over_people(predictor - a * _DIFFERENCE, deviation - b * _DIFFERENCE, link)
        )
        / (2 * _DIFFERENCE)
        for a, b in ((1, 0), (0, 1))
    )
    entries = np.outer(sides, spread)[np.tril_indices(len(sides))] / max(deviation, _DIFFERENCE)
    gradient = np.zeros(len(fit.parameter_covariance))
    gradient[place] = by_predictor
    gradient[len(fit.coefficients) :] = by_deviation * entries
    return gradient


def _effects(fit: GlmmFit, contrasts: dict[Condition, Array]) -> tuple[SimpleEffect, ...]:
    from scipy.special import ndtr

    differences = [float(weights @ fit.coefficients) for weights in contrasts.values()]
    errors = [math.sqrt(weights @ fit.covariance @ weights) for weights in contrasts.values()]
    z = [difference / error for difference, error in zip(differences, errors, strict=True)]
    p = [float(2 * ndtr(-abs(each))) for each in z]
    return tuple(
        SimpleEffect(at, difference, error, wald_interval(difference, error), own_z, own_p, own_holm)
        for at, difference, error, own_z, own_p, own_holm in zip(
            contrasts, differences, errors, z, p, holm(p), strict=True
        )
        if own_holm is not None
    )


def _interaction(
    fit: GlmmFit, rows: BinomialRows, contrasts: dict[Condition, Array], link: Link
) -> ModelInteraction | None:
    """Compare with the model in which the simple effects are the same; None with fewer than two."""
    over = next((at[0][0] for at in contrasts if at), None)
    effects = [weights for at, weights in contrasts.items() if at and at[0][0] == over]
    if over is None or len(effects) < 2:
        return None
    same = without(rows, np.array([each - effects[0] for each in effects[1:]]))
    reduced = fit_glmm(same, fit.nodes, link)
    if not reduced.converged:
        return None
    statistic, p = likelihood_ratio(fit, reduced, df=len(effects) - 1)
    return ModelInteraction(over, statistic, len(effects) - 1, p)


def _probability(predictor: float, link: Link) -> float:
    return float(link.probability(np.asarray(predictor)))


def _back(interval: Interval, link: Link) -> Interval:
    return Interval(_probability(interval.low, link), _probability(interval.high, link))
