"""Estimated means of all conditions and simple effects by one mixed model of all answers.

Every condition has a fixed effect; the intercept and the slope of the compared factor vary over participants.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.adjustment import holm
from autd_analysis.basics.intervals import Interval, wald_interval
from autd_analysis.data.contrasts import Contrast, planned_contrasts
from autd_analysis.data.design import Condition, Design
from autd_analysis.models.cells import (
    FEWEST_PARTICIPANTS,
    cell_rows,
    contrast_weights,
    is_separated,
    participants,
    penalised,
    without,
)
from autd_analysis.models.glmm import (
    DEFAULT_NODES,
    SINGULAR,
    BinomialRows,
    GlmmFit,
    fit_glmm,
    likelihood_ratio,
)
from autd_analysis.models.links import LOGIT, PROBIT, Link
from autd_analysis.models.means import ModelMean, model_mean
from autd_analysis.rates.numbers import ParticipantRate

LinkName = Literal["logit", "probit"]
LINKS: dict[LinkName, Link] = {"logit": LOGIT, "probit": PROBIT}

Array = NDArray[np.float64]


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
    means, effects
        Of the conditions with trials, and of the levels where no condition lacks them; empty where no model
        could be fitted.
    interaction
        None where there are not two such levels, or nothing converged.
    notes
        What could not be done, and why.
    """

    link: LinkName
    compared: Contrast | None
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
        """Correlation of intercept and slope over participants; None where one of them does not vary."""
        if self.fit is None or len(self.fit.factor) < 2 or self.fit.standard_deviations.min() < SINGULAR:
            return None
        return float((self.fit.factor @ self.fit.factor.T)[0, 1] / self.fit.standard_deviations.prod())


@dataclass(frozen=True, eq=False)
class Models:
    """All mixed models of a study.

    Attributes
    ----------
    models
        A model for everything that is compared, by either link.
    conditions
        All conditions, also those without trials.
    contrasts
        What was planned.
    """

    models: tuple[CellModel, ...]
    conditions: tuple[Condition, ...]
    contrasts: tuple[Contrast, ...]


def all_models(rates: Sequence[ParticipantRate], design: Design) -> Models:
    """Return the mixed models of all answers of a study; parameters as for `cell_models`."""
    conditions = dict.fromkeys(rate.condition for rate in rates)
    return Models(cell_models(rates, design), tuple(conditions), planned_contrasts(design))


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
    plan = planned_contrasts(design)
    factors: list[Contrast | None] = list(dict.fromkeys(contrast.overall for contrast in plan))
    return tuple(
        cell_model(rates, each, [contrast.at for contrast in plan if contrast.overall == each], link)
        for each in factors or [None]
        for link in LINKS
    )


def cell_model(
    rates: Sequence[ParticipantRate],
    compared: Contrast | None,
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
        means=tuple(model_mean(fit, used, place, cell, LINKS[link]) for place, cell in enumerate(cells)),
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
            "answers are separated (all or none felt in a condition): half an answer of each kind is added "
            "to every condition, which for the logit is Firth's penalty"
        )
    if not fit.converged:
        notes.append("the mixed model did not converge")
    elif fit.singular:
        notes.append("the mixed model is singular: a variance is 0 or a correlation 1")
    return tuple(notes)


def _contrasts(
    every_cell: Sequence[Condition],
    cells: Sequence[Condition],
    compared: Contrast,
    levels: Sequence[Condition],
) -> dict[Condition, Array]:
    """Return the cells' weights in each simple effect of which no cell lacks trials."""
    seen = np.array([cell in cells for cell in every_cell])
    weights = {at: contrast_weights(every_cell, replace(compared, at=at)) for at in levels}
    return {at: each[seen] for at, each in weights.items() if each.any() and not each[~seen].any()}


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
