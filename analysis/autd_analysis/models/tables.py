"""The tables of the mixed models of all answers: means, simple effects, and how they were fitted."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from autd_analysis.basics.intervals import Interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Condition
from autd_analysis.models.cell_model import CellModel, Models, SimpleEffect
from autd_analysis.models.means import ModelMean
from autd_analysis.report.table import (
    AT,
    COMPARED,
    NOTHING_COMPARED,
    PARTICIPANTS,
    READING,
    TRIALS,
    Declared,
    iterated,
    joined,
)
from autd_trials.tables import Column, level_text, of


@dataclass(frozen=True, eq=False)
class _Model:
    """A model as rows of all three tables have it."""

    model: CellModel
    contrast: Contrast | None

    @property
    def participants(self) -> int:
        return self.model.participants

    @property
    def trials(self) -> int:
        return self.model.trials

    @property
    def notes(self) -> str | None:
        return joined(self.model.notes)


@dataclass(frozen=True, eq=False)
class _Mean(_Model):
    condition: Condition
    mean: ModelMean | None

    @property
    def population_interval(self) -> Interval | None:
        return self.mean.population_interval if self.mean else None

    @property
    def notes(self) -> str | None:
        return "no trials there" if self.mean is None and self.model.means else super().notes


@dataclass(frozen=True, eq=False)
class _Effect(_Model):
    effect: SimpleEffect | None

    @property
    def notes(self) -> str | None:
        return "a condition has no trials" if self.effect is None and self.model.means else super().notes


def odds_reading(contrast: Contrast, logits: float | None, interval: Interval | None) -> str | None:
    """Return a difference in logits as a ratio of odds, in words."""
    if logits is None or interval is None:
        return None
    first, second = level_text(contrast.first), level_text(contrast.second)
    return (
        f"the odds of feeling are {_ratio(logits)} times as high with {first} as with {second} "
        f"(95 %: {_ratio(interval.low)} to {_ratio(interval.high)})"
    )


def _means(found: Models) -> Iterator[_Mean]:
    for model in found.models:
        means = {mean.condition: mean for mean in model.means}
        for condition in found.conditions:
            yield _Mean(model, model.compared, condition, means.get(condition))


def _effects(found: Models) -> Iterator[_Effect]:
    for model in found.models:
        effects = {effect.at: effect for effect in model.effects}
        for contrast in found.contrasts:
            if contrast.overall == model.compared:
                yield _Effect(model, contrast, effects.get(contrast.at))


def _method(nodes: int) -> str:
    return "Laplace" if nodes == 1 else f"adaptive Gauss-Hermite quadrature, {nodes} nodes per random effect"


def _deviation(model: CellModel, number: int) -> float | None:
    """Return a standard deviation over participants; None where the model has not so many."""
    deviations = model.fit.standard_deviations.tolist() if model.fit else []
    return round(deviations[number], 3) if number < len(deviations) else None


def _mean_reading(mean: ModelMean) -> str:
    return (
        f"the average participant feels it with probability {mean.average:.2f}, people on the whole with "
        f"{mean.population:.2f}"
    )


def _effect_reading(row: _Effect) -> str | None:
    contrast, effect = row.contrast, row.effect
    if contrast is None or effect is None:
        return None
    if row.model.link == "logit":
        return odds_reading(contrast, effect.difference, effect.interval)
    more = "higher" if effect.difference > 0 else "lower"
    return (
        f"{abs(effect.difference):.2g} standard deviations of noise {more} with "
        f"{level_text(contrast.first)} than with {level_text(contrast.second)}"
    )


def _ratio(logits: float) -> str:
    if logits > math.log(1e6):
        return "more than a million"
    ratio = math.exp(logits)
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"


_LINK: Column[_Model] = Column(
    "link",
    "What the model is linear in.",
    lambda row: row.model.link,
    levels={"logit": "Log odds.", "probit": "Normal quantiles: standard deviations of noise."},
)
MEANS = Declared[Models, _Mean](
    "model_means",
    "Every condition's mean by a mixed model of all answers.",
    rows=_means,
    leading=(_LINK, *COMPARED),
    condition=lambda row: row.condition,
    columns=(
        Column(
            "mean",
            "Estimate in units of the link, for the average participant (random effects of zero).",
            of(lambda row: row.mean, lambda mean: iterated(mean.predictor)),
        ),
        Column(
            "standard_error",
            "Its standard error.",
            of(lambda row: row.mean, lambda mean: iterated(mean.standard_error)),
        ),
        Column(
            "average",
            "Probability that the average participant feels it.",
            of(lambda row: row.mean, lambda mean: iterated(mean.average)),
        ),
        Column(
            "average_low",
            "Lower end of its Wald 95 % interval.",
            of(lambda row: row.mean, lambda mean: iterated(mean.average_interval.low)),
        ),
        Column(
            "average_high",
            "Upper end of its Wald 95 % interval.",
            of(lambda row: row.mean, lambda mean: iterated(mean.average_interval.high)),
        ),
        Column(
            "population",
            "Probability over all people: the average over the random effects.",
            of(lambda row: row.mean, lambda mean: iterated(mean.population)),
        ),
        Column(
            "population_low",
            "Lower end of its Wald 95 % interval (delta method).",
            of(lambda row: row.population_interval, lambda ends: iterated(ends.low)),
        ),
        Column(
            "population_high",
            "Upper end of its Wald 95 % interval (delta method).",
            of(lambda row: row.population_interval, lambda ends: iterated(ends.high)),
        ),
        PARTICIPANTS,
        TRIALS,
        Column("reading", READING, of(lambda row: row.mean, _mean_reading)),
    ),
    notes=lambda row: row.notes,
)
EFFECTS = Declared[Models, _Effect](
    "model_effects",
    "Simple effects of what is compared by the same models. They take a participant's slope for the "
    "same at all levels; where it is not, their p and that of the interaction are too small.",
    rows=_effects,
    columns=(
        _LINK,
        *COMPARED,
        AT,
        Column(
            "difference",
            "First minus second in units of the link, for the average participant.",
            of(lambda row: row.effect, lambda effect: iterated(effect.difference)),
        ),
        Column(
            "standard_error",
            "Its standard error.",
            of(lambda row: row.effect, lambda effect: iterated(effect.standard_error)),
        ),
        Column(
            "interval_low",
            "Lower end of its Wald 95 % interval.",
            of(lambda row: row.effect, lambda effect: iterated(effect.interval.low)),
        ),
        Column(
            "interval_high",
            "Upper end of its Wald 95 % interval.",
            of(lambda row: row.effect, lambda effect: iterated(effect.interval.high)),
        ),
        Column(
            "z",
            "Statistic of Wald's test, two-sided.",
            of(lambda row: row.effect, lambda effect: iterated(effect.z)),
        ),
        Column("p", "Its p.", of(lambda row: row.effect, lambda effect: iterated(effect.p))),
        Column(
            "p_holm",
            "Its p after Holm's adjustment over the simple effects of this model.",
            of(lambda row: row.effect, lambda effect: iterated(effect.p_holm)),
        ),
        PARTICIPANTS,
        TRIALS,
        Column("reading", READING, _effect_reading),
    ),
    notes=lambda row: row.notes,
    undefined=NOTHING_COMPARED,
)
FIT = Declared[Models, _Model](
    "model_fit",
    "How these models were fitted, how participants vary, and the interaction, which has the "
    "weakness of the simple effects.",
    rows=lambda found: [_Model(model, model.compared) for model in found.models],
    columns=(
        _LINK,
        *COMPARED,
        Column(
            "method",
            "How the likelihood was approximated.",
            of(lambda row: row.model.fit, lambda fit: _method(fit.nodes)),
        ),
        Column(
            "converged",
            "Whether the iterations came to rest.",
            of(lambda row: row.model.fit, lambda fit: fit.converged),
        ),
        Column(
            "singular",
            "Whether a variance is 0 or a correlation 1.",
            of(lambda row: row.model.fit, lambda fit: fit.singular),
        ),
        Column(
            "penalised",
            "Whether answers are separated, so that half an answer of each kind was added.",
            lambda row: row.model.penalised,
        ),
        Column(
            "intercept_sd",
            "Standard deviation over participants of their level, in units of the link.",
            lambda row: _deviation(row.model, 0),
        ),
        Column(
            "slope_sd",
            "Standard deviation over participants of the compared difference.",
            lambda row: _deviation(row.model, 1),
        ),
        Column(
            "correlation",
            "Correlation of level and difference over participants; n/a where one does not vary.",
            lambda row: iterated(row.model.correlation),
        ),
        Column(
            "log_likelihood",
            "Without the binomial coefficients.",
            of(lambda row: row.model.fit, lambda fit: iterated(fit.log_likelihood)),
        ),
        Column(
            "interaction_with",
            "The other factor, on whose levels the difference may depend.",
            of(lambda row: row.model.interaction, lambda found: found.over),
        ),
        Column(
            "interaction_lr",
            "Statistic of the likelihood-ratio test that the difference is the same at all.",
            of(lambda row: row.model.interaction, lambda found: iterated(found.statistic)),
        ),
        Column(
            "interaction_df",
            "Its degrees of freedom.",
            of(lambda row: row.model.interaction, lambda found: found.df),
        ),
        Column(
            "interaction_p",
            "Its p, not adjusted.",
            of(lambda row: row.model.interaction, lambda found: iterated(found.p)),
        ),
        PARTICIPANTS,
        TRIALS,
    ),
    notes=lambda row: row.notes,
)
