"""The tables of the mixed models of all answers: means, simple effects, and how they were fitted."""

import math
from collections.abc import Iterator, Sequence

from analysis.design import Condition, format_level
from analysis.intervals import Interval
from analysis.models.cell_model import CellModel, LinkName, SimpleEffect
from analysis.models.cells import Compared, planned
from analysis.models.means import ModelMean
from analysis.study import Results
from analysis.tables.table import (
    ResultTable,
    Row,
    Value,
    end_cells,
    factor_columns,
    iterated,
    iterated_interval,
    result_table,
)
from analysis.wording import levels_text
from autd_trials.records.table import Column

PARTICIPANTS = Column("participants", "Number of participants who tell something about it.")
TRIALS = Column("trials", "Number of their trials counted.")
READING = Column("reading", "The estimate in words.")
COMPARED = (
    Column("factor", "The factor compared, whose slope varies over participants; n/a: none is compared."),
    Column("first", "The level subtracted from."),
    Column("second", "The level subtracted."),
)
AT = Column("at", "The level of the other factor at which they were compared; n/a: the mean over all.")
_LINK = Column(
    "link",
    "What the model is linear in.",
    levels={"logit": "Log odds.", "probit": "Normal quantiles: standard deviations of noise."},
)
_MEANS = (
    Column("mean", "Estimate in units of the link, for the average participant (random effects of zero)."),
    Column("standard_error", "Its standard error."),
    Column("average", "Probability that the average participant feels it."),
    Column("average_low", "Lower end of its Wald 95 % interval."),
    Column("average_high", "Upper end of its Wald 95 % interval."),
    Column("population", "Probability over all people: the average over the random effects."),
    Column("population_low", "Lower end of its Wald 95 % interval (delta method)."),
    Column("population_high", "Upper end of its Wald 95 % interval (delta method)."),
    PARTICIPANTS,
    TRIALS,
    READING,
)
_EFFECTS = (
    Column("difference", "First minus second in units of the link, for the average participant."),
    Column("standard_error", "Its standard error."),
    Column("interval_low", "Lower end of its Wald 95 % interval."),
    Column("interval_high", "Upper end of its Wald 95 % interval."),
    Column("z", "Statistic of Wald's test, two-sided."),
    Column("p", "Its p."),
    Column("p_holm", "Its p after Holm's adjustment over the simple effects of this model."),
    PARTICIPANTS,
    TRIALS,
    READING,
)
_FIT = (
    Column("method", "How the likelihood was approximated."),
    Column("converged", "Whether the iterations came to rest."),
    Column("singular", "Whether a variance is 0 or a correlation 1."),
    Column("penalised", "Whether answers are separated, so that half an answer of each kind was added."),
    Column("intercept_sd", "Standard deviation over participants of their level, in units of the link."),
    Column("slope_sd", "Standard deviation over participants of the compared difference."),
    Column(
        "correlation", "Correlation of level and difference over participants; n/a where one does not vary."
    ),
    Column("log_likelihood", "Without the binomial coefficients."),
    Column("interaction_with", "The other factor, on whose levels the difference may depend."),
    Column(
        "interaction_lr", "Statistic of the likelihood-ratio test that the difference is the same at all."
    ),
    Column("interaction_df", "Its degrees of freedom."),
    Column("interaction_p", "Its p, not adjusted."),
    PARTICIPANTS,
    TRIALS,
)
NOTHING_COMPARED: Row = {"notes": "the protocol plans no comparison"}
_NO_TRIALS = "a condition has no trials"


def model_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return means, effects and fit of the mixed models."""
    cells, simulated = factor_columns(results.trials.design.factors), results.simulated
    models = results.cell_models
    return (
        result_table(
            "model_means",
            "Every condition's mean by a mixed model of all answers.",
            (_LINK, *COMPARED, *cells, *_MEANS),
            (_mean_row(model, rate.condition) for model in models for rate in results.rates),
            simulated=simulated,
        ),
        result_table(
            "model_effects",
            "Simple effects of what is compared by the same models. They take a participant's slope for the "
            "same at all levels; where it is not, their p and that of the interaction are too small.",
            (_LINK, *COMPARED, AT, *_EFFECTS),
            (row for model in models for row in _effect_rows(model, planned(results.trials.design))),
            simulated=simulated,
            or_else=NOTHING_COMPARED,
        ),
        result_table(
            "model_fit",
            "How these models were fitted, how participants vary, and the interaction, which has the "
            "weakness of the simple effects.",
            (_LINK, *COMPARED, *_FIT),
            map(_fit_row, models),
            simulated=simulated,
        ),
    )


def compared_cells(compared: Compared) -> dict[str, Value]:
    """Return the cells that say what was compared."""
    return {
        "factor": compared.factor,
        "first": format_level(compared.first),
        "second": format_level(compared.second),
    }


def odds_reading(compared: Compared, logits: float | None, interval: Interval | None) -> str | None:
    """Return a difference in logits as a ratio of odds, in words."""
    if logits is None or interval is None:
        return None
    first, second = format_level(compared.first), format_level(compared.second)
    return (
        f"the odds of feeling are {_ratio(logits)} times as high with {first} as with {second} "
        f"(95 %: {_ratio(interval.low)} to {_ratio(interval.high)})"
    )


def _mean_row(model: CellModel, condition: Condition) -> Row:
    mean = next((mean for mean in model.means if mean.condition == condition), None)
    cells = {**_model_cells(model), **dict(condition)}
    if mean is None:
        return {**cells, "notes": cells["notes"] if not model.means else "no trials there"}
    return {
        **cells,
        "mean": iterated(mean.predictor),
        "standard_error": iterated(mean.standard_error),
        "average": iterated(mean.average),
        **_ends("average", mean.average_interval),
        "population": iterated(mean.population),
        **_ends("population", mean.population_interval),
        "reading": _mean_reading(mean),
    }


def _effect_rows(model: CellModel, plan: Sequence[tuple[Compared, Condition]]) -> Iterator[Row]:
    found = {effect.at: effect for effect in model.effects}
    for compared, at in plan:
        if compared != model.compared:
            continue
        effect = found.get(at)
        cells = {**_model_cells(model), "at": levels_text(at)}
        if effect is None:
            yield {**cells, "notes": _NO_TRIALS if model.means else cells["notes"]}
            continue
        yield {
            **cells,
            "difference": iterated(effect.difference),
            "standard_error": iterated(effect.standard_error),
            **_ends("interval", effect.interval),
            "z": iterated(effect.z),
            "p": iterated(effect.p),
            "p_holm": iterated(effect.p_holm),
            "reading": _effect_reading(compared, model.link, effect),
        }


def _fit_row(model: CellModel) -> Row:
    fit, interaction = model.fit, model.interaction
    deviations = fit.standard_deviations.tolist() if fit else []
    return {
        **_model_cells(model),
        "method": _method(fit.nodes) if fit else None,
        "converged": fit.converged if fit else None,
        "singular": fit.singular if fit else None,
        "penalised": model.penalised,
        "intercept_sd": round(deviations[0], 3) if len(deviations) else None,
        "slope_sd": round(deviations[1], 3) if len(deviations) > 1 else None,
        "correlation": iterated(model.correlation),
        "log_likelihood": iterated(fit.log_likelihood) if fit else None,
        "interaction_with": interaction.over if interaction else None,
        "interaction_lr": iterated(interaction.statistic) if interaction else None,
        "interaction_df": interaction.df if interaction else None,
        "interaction_p": iterated(interaction.p) if interaction else None,
    }


def _model_cells(model: CellModel) -> dict[str, Value]:
    return {
        "link": model.link,
        **(compared_cells(model.compared) if model.compared else {}),
        "participants": model.participants,
        "trials": model.trials,
        "notes": "; ".join(model.notes) or None,
    }


def _ends(name: str, interval: Interval | None) -> dict[str, Value]:
    return end_cells(name, iterated_interval(interval))


def _method(nodes: int) -> str:
    return "Laplace" if nodes == 1 else f"adaptive Gauss-Hermite quadrature, {nodes} nodes per random effect"


def _mean_reading(mean: ModelMean) -> str:
    return (
        f"the average participant feels it with probability {mean.average:.2f}, people on the whole with "
        f"{mean.population:.2f}"
    )


def _effect_reading(compared: Compared, link: LinkName, effect: SimpleEffect) -> str | None:
    if link == "logit":
        return odds_reading(compared, effect.difference, effect.interval)
    more = "higher" if effect.difference > 0 else "lower"
    return (
        f"{abs(effect.difference):.2g} standard deviations of noise {more} with "
        f"{format_level(compared.first)} than with {format_level(compared.second)}"
    )


def _ratio(logits: float) -> str:
    if logits > math.log(1e6):
        return "more than a million"
    ratio = math.exp(logits)
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
