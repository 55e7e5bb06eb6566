"""The tables of other models of the planned comparisons, and of Firth's logits of the conditions."""

from analysis.models.conditions import ConditionLogit
from analysis.models.other_models import OtherEstimate
from analysis.study import Results
from analysis.tables.models import (
    AT,
    COMPARED,
    NOTHING_COMPARED,
    PARTICIPANTS,
    READING,
    TRIALS,
    compared_cells,
    odds_reading,
)
from analysis.tables.table import (
    ResultTable,
    Row,
    end_cells,
    factor_columns,
    iterated,
    iterated_interval,
    result_table,
)
from analysis.wording import levels_text
from autd_trials.records.table import Column

_OTHER = (
    Column("method", "The model, and for GEE (population-averaged) the correction for few participants."),
    Column("logits", "Difference in logits, first minus second; n/a where undefined."),
    Column("standard_error", "Its standard error."),
    Column("interval_low", "Lower end of its 95 % interval: t for GEE, Wald, or profile for Firth."),
    Column("interval_high", "Upper end of its 95 % interval."),
    Column("wald", "Estimate over standard error."),
    Column("df", "Satterthwaite's degrees of freedom of it; n/a: normal."),
    Column("wald_p", "Its two-sided p, not adjusted."),
    Column("lr", "Statistic of the (for Firth: penalised) likelihood-ratio test, one degree of freedom."),
    Column("lr_p", "Its p, not adjusted."),
    PARTICIPANTS,
    TRIALS,
    READING,
)
_FIRTH = (
    Column("separated", "Whether all or none were felt, so that the plain logit is infinite."),
    Column("logit", "Firth's estimate: log of (felt + 1/2) / (not felt + 1/2)."),
    Column("standard_error", "Its standard error."),
    Column("interval_low", "Lower end of its 95 % profile interval, answers taken as independent."),
    Column("interval_high", "Upper end of its 95 % profile interval."),
    Column("probability", "The same as a probability: (felt + 1/2) / (trials + 1)."),
    Column("felt", "Number of trials answered as felt, of all participants."),
    PARTICIPANTS,
    TRIALS,
    READING,
)


def other_model_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return the planned comparisons by other models, and Firth's logits."""
    cells, simulated = factor_columns(results.trials.design.factors), results.simulated
    return (
        result_table(
            "other_models",
            "The planned comparisons by other models: GEE, conditional logistic and Firth's logistic. The "
            "last two take people for alike in the effect, and GEE without correction is for many: where "
            "that is not so, their p are too small.",
            (*COMPARED, AT, *_OTHER),
            map(_other_row, results.other_estimates),
            simulated=simulated,
            or_else=NOTHING_COMPARED,
        ),
        result_table(
            "firth_logits",
            "Every condition's logit with Firth's penalty, finite also where all or none were felt. Answers "
            "are taken as independent, so the intervals are too narrow where people differ.",
            (*cells, *_FIRTH),
            map(_firth_row, results.condition_logits),
            simulated=simulated,
        ),
    )


def _other_row(found: OtherEstimate) -> Row:
    return {
        **compared_cells(found.compared),
        "at": levels_text(found.at),
        "method": found.method,
        "logits": iterated(found.logits),
        "standard_error": iterated(found.standard_error),
        **end_cells("interval", iterated_interval(found.interval)),
        "wald": iterated(found.wald),
        "df": iterated(found.df),
        "wald_p": iterated(found.wald_p),
        "lr": iterated(found.ratio),
        "lr_p": iterated(found.ratio_p),
        "participants": found.participants,
        "trials": found.trials,
        "reading": odds_reading(found.compared, found.logits, found.interval),
        "notes": found.note,
    }


def _firth_row(found: ConditionLogit) -> Row:
    effect = found.effect
    return {
        **dict(found.condition),
        "separated": found.separated,
        "logit": iterated(effect.logits) if effect else None,
        "standard_error": iterated(effect.standard_error) if effect else None,
        **end_cells("interval", iterated_interval(effect.interval if effect else None)),
        "probability": iterated(found.probability),
        "felt": found.felt,
        "participants": found.participants,
        "trials": found.trials,
        "reading": None if found.probability is None else f"felt with probability {found.probability:.2f}",
        "notes": None if effect else "no trials",
    }
