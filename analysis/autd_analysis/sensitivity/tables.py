"""The tables of other models of the planned comparisons, and of Firth's logits of the conditions."""

from autd_analysis.basics.intervals import Interval
from autd_analysis.models.tables import (
    AT,
    COMPARED,
    NOTHING_COMPARED,
    PARTICIPANTS,
    READING,
    TRIALS,
    odds_reading,
)
from autd_analysis.report.table import Declared, ResultTable, iterated
from autd_analysis.sensitivity.firth_logits import ConditionLogit
from autd_analysis.sensitivity.numbers import OtherEstimate
from autd_analysis.study import Results
from autd_trials.tables import Column, of


def other_model_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return the planned comparisons by other models, and Firth's logits."""
    return (
        OTHER_MODELS.made(results, results.other_estimates),
        FIRTH_LOGITS.made(results, results.condition_logits),
    )


def _firth_interval(found: ConditionLogit) -> Interval | None:
    return found.effect.interval if found.effect else None


OTHER_MODELS = Declared[OtherEstimate](
    "other_models",
    "The planned comparisons by other models: GEE, conditional logistic and Firth's logistic. The "
    "last two take people for alike in the effect, and GEE without correction is for many: where "
    "that is not so, their p are too small.",
    (
        *COMPARED,
        AT,
        Column(
            "method",
            "The model, and for GEE (population-averaged) the correction for few participants.",
            lambda found: found.method,
        ),
        Column(
            "logits",
            "Difference in logits, first minus second; n/a where undefined.",
            lambda found: iterated(found.logits),
        ),
        Column("standard_error", "Its standard error.", lambda found: iterated(found.standard_error)),
        Column(
            "interval_low",
            "Lower end of its 95 % interval: t for GEE, Wald, or profile for Firth.",
            of(lambda found: found.interval, lambda ends: iterated(ends.low)),
        ),
        Column(
            "interval_high",
            "Upper end of its 95 % interval.",
            of(lambda found: found.interval, lambda ends: iterated(ends.high)),
        ),
        Column("wald", "Estimate over standard error.", lambda found: iterated(found.wald)),
        Column(
            "df",
            "Satterthwaite's degrees of freedom of it; n/a: normal.",
            lambda found: iterated(found.df),
        ),
        Column("wald_p", "Its two-sided p, not adjusted.", lambda found: iterated(found.wald_p)),
        Column(
            "lr",
            "Statistic of the (for Firth: penalised) likelihood-ratio test, one degree of freedom.",
            lambda found: iterated(found.ratio),
        ),
        Column("lr_p", "Its p, not adjusted.", lambda found: iterated(found.ratio_p)),
        PARTICIPANTS,
        TRIALS,
        Column(
            "reading",
            READING,
            lambda found: odds_reading(found.compared, found.logits, found.interval),
        ),
    ),
    notes=lambda found: found.note,
    undefined=NOTHING_COMPARED,
)
FIRTH_LOGITS = Declared[ConditionLogit](
    "firth_logits",
    "Every condition's logit with Firth's penalty, finite also where all or none were felt. Answers "
    "are taken as independent, so the intervals are too narrow where people differ.",
    condition=lambda found: found.condition,
    columns=(
        Column(
            "separated",
            "Whether all or none were felt, so that the plain logit is infinite.",
            lambda found: found.separated,
        ),
        Column(
            "logit",
            "Firth's estimate: log of (felt + 1/2) / (not felt + 1/2).",
            of(lambda found: found.effect, lambda effect: iterated(effect.logits)),
        ),
        Column(
            "standard_error",
            "Its standard error.",
            of(lambda found: found.effect, lambda effect: iterated(effect.standard_error)),
        ),
        Column(
            "interval_low",
            "Lower end of its 95 % profile interval, answers taken as independent.",
            of(_firth_interval, lambda ends: iterated(ends.low)),
        ),
        Column(
            "interval_high",
            "Upper end of its 95 % profile interval.",
            of(
                lambda found: found.effect.interval if found.effect else None,
                lambda ends: iterated(ends.high),
            ),
        ),
        Column(
            "probability",
            "The same as a probability: (felt + 1/2) / (trials + 1).",
            lambda found: iterated(found.probability),
        ),
        Column("felt", "Number of trials answered as felt, of all participants.", lambda found: found.felt),
        PARTICIPANTS,
        TRIALS,
        Column(
            "reading",
            READING,
            of(lambda found: found.probability, lambda share: f"felt with probability {share:.2f}"),
        ),
    ),
    notes=lambda found: None if found.effect else "no trials",
)
