"""The tables of further adjustments, of other models and pooled tests, and of Firth's logits."""

from collections.abc import Callable

from autd_analysis.basics.adjustment import METHODS, Method
from autd_analysis.basics.intervals import Interval
from autd_analysis.models.tables import odds_reading
from autd_analysis.report.table import (
    AT,
    COMPARED,
    NOTHING_COMPARED,
    PARTICIPANTS,
    READING,
    TRIALS,
    Declared,
    iterated,
)
from autd_analysis.sensitivity.adjusted import AdjustedP
from autd_analysis.sensitivity.firth_logits import ConditionLogit
from autd_analysis.sensitivity.numbers import OtherEstimate, Sensitivity
from autd_analysis.sensitivity.pooled import PooledTests
from autd_trials.tables import Column, of


def _firth_interval(found: ConditionLogit) -> Interval | None:
    return found.effect.interval if found.effect else None


def _by_method(method: Method) -> Callable[[AdjustedP], float | None]:
    return lambda row: row.by_method[method]


OTHER_MODELS = Declared[Sensitivity, OtherEstimate](
    "other_models",
    "The planned comparisons by other models: GEE, conditional logistic and Firth's logistic. The "
    "last two take people for alike in the effect, and GEE without correction is for many: where "
    "that is not so, their p are too small.",
    rows=lambda found: found.other_estimates,
    columns=(
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
            lambda found: odds_reading(found.contrast, found.logits, found.interval),
        ),
    ),
    notes=lambda found: found.note,
    undefined=NOTHING_COMPARED,
)
FIRTH_LOGITS = Declared[Sensitivity, ConditionLogit](
    "firth_logits",
    "Every condition's logit with Firth's penalty, finite also where all or none were felt. Answers "
    "are taken as independent, so the intervals are too narrow where people differ.",
    rows=lambda found: found.condition_logits,
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
ADJUSTED_P = Declared[Sensitivity, AdjustedP](
    "adjusted_p",
    "The p of the planned comparisons, adjusted for their number in several ways. The planned one is "
    "Holm's; choosing among them by their result is not.",
    rows=lambda found: found.adjusted,
    columns=(
        *COMPARED,
        AT,
        Column("test", "Which test.", lambda row: row.test),
        Column("tests", "Number of tests of this kind that were made.", lambda row: row.tests),
        Column("p", "p as it is, two-sided.", lambda row: row.p),
        *(
            Column(f"p_{method}", f"Adjusted: {about}.", _by_method(method))
            for method, about in METHODS.items()
        ),
    ),
    notes=lambda row: "not testable, so not counted" if row.p is None else None,
)
POOLED = Declared[Sensitivity, PooledTests](
    "pooled",
    "Tests that take people for alike in how much the condition matters to them. Where they are not, "
    "these p are too small.",
    rows=lambda found: found.pooled,
    columns=(
        *COMPARED,
        AT,
        Column("felt_first", "Felt at first, all participants together.", lambda found: found.felt_first),
        Column("trials_first", "Trials at first.", lambda found: found.n_first),
        Column("felt_second", "Felt at second.", lambda found: found.felt_second),
        Column("trials_second", "Trials at second.", lambda found: found.n_second),
        Column(
            "chi_squared_p",
            "Pearson's chi-squared test of all answers, no continuity correction.",
            lambda found: found.chi_squared_p,
        ),
        Column("fisher_p", "Fisher's exact test of all answers.", lambda found: found.fisher_p),
        Column(
            "cmh_p",
            "Cochran-Mantel-Haenszel test over participants, no continuity correction.",
            lambda found: found.cmh_p,
        ),
        Column("cmh_exact_p", "The same, exact and conditional.", lambda found: found.cmh_exact_p),
        Column(
            "odds_ratio",
            "Common odds ratio of Mantel and Haenszel; n/a if 0 or infinite.",
            lambda found: found.odds_ratio,
        ),
        Column(
            "odds_ratio_low",
            "Lower end of its 95 % interval (Robins, Breslow and Greenland).",
            of(lambda found: found.odds_ratio_interval, lambda ends: ends.low),
        ),
        Column(
            "odds_ratio_high",
            "Upper end of its 95 % interval.",
            of(lambda found: found.odds_ratio_interval, lambda ends: ends.high),
        ),
        Column(
            "mcnemar_p",
            "McNemar's exact test; n/a unless everybody has one answer at each level.",
            lambda found: found.mcnemar_p,
        ),
        Column("mcnemar_mid_p", "The same, mid-p.", lambda found: found.mcnemar_mid_p),
    ),
)
