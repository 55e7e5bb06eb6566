"""The tables of the planned comparisons, and of each participant's differences."""

from collections.abc import Sequence

from autd_analysis.comparisons.numbers import (
    DIFFERENCE_INTERVAL,
    NEWCOMBE_INTERVAL,
    ComparisonResult,
    Difference,
)
from autd_analysis.report.table import (
    AT,
    COMPARED,
    PARTICIPANT,
    Declared,
    interval_columns,
    iterated,
    joined,
)
from autd_trials.tables import Column, of

_RATES: tuple[Column[ComparisonResult], ...] = (
    *COMPARED,
    AT,
    Column(
        "participants",
        "Number of participants who have both rates.",
        lambda result: result.participants,
    ),
    Column(
        "mean_difference",
        "Mean over participants of the rate at first minus the rate at second.",
        lambda result: result.mean,
    ),
    Column(
        "sd_difference",
        "Standard deviation (n - 1) of these differences over participants.",
        lambda result: result.sd,
    ),
    *interval_columns(DIFFERENCE_INTERVAL),
)
_SIGN_FLIP: tuple[Column[ComparisonResult], ...] = (
    Column(
        "sign_flip_p",
        "p of the exact sign-flip test of the differences, two-sided; n/a: not testable.",
        of(lambda result: result.sign_flip, lambda test: test.p),
    ),
    Column("sign_flip_p_holm", "The same after Holm's adjustment.", lambda result: result.sign_flip_holm),
    Column(
        "sign_flip_least_p",
        "Smallest p that the sign-flip test could have given with these differences.",
        of(lambda result: result.sign_flip, lambda test: test.floor),
    ),
    Column(
        "sign_flip_nonzero",
        "Number of participants whose difference is not zero.",
        of(lambda result: result.sign_flip, lambda test: test.nonzero),
    ),
    Column(
        "sign_flip_tests",
        "Number of sign-flip tests adjusted for: all planned ones that were testable.",
        lambda result: result.sign_flip_tests,
    ),
)
_PAIRED_T: tuple[Column[ComparisonResult], ...] = (
    Column(
        "t",
        "Statistic of the paired t test, two-sided; n/a: not testable.",
        of(lambda result: result.paired_t, lambda test: test.t),
    ),
    Column("t_df", "Its degrees of freedom.", of(lambda result: result.paired_t, lambda test: test.df)),
    Column("t_p", "Its p.", of(lambda result: result.paired_t, lambda test: test.p)),
    Column("t_p_holm", "Its p after Holm's adjustment.", lambda result: result.paired_t_holm),
    Column(
        "t_tests",
        "Number of t tests adjusted for: all planned ones that were testable.",
        lambda result: result.paired_t_tests,
    ),
    Column(
        "t_dz",
        "Standardised mean difference: mean_difference / sd_difference.",
        of(lambda result: result.paired_t, lambda test: test.dz),
    ),
    Column(
        "t_dz_interval_low",
        "Lower end of its 95 % interval (noncentral t).",
        of(lambda result: result.dz_interval, lambda ends: iterated(ends.low)),
    ),
    Column(
        "t_dz_interval_high",
        "Upper end of its 95 % interval (noncentral t).",
        of(lambda result: result.dz_interval, lambda ends: iterated(ends.high)),
    ),
    Column(
        "bayes_factor",
        "Bayes factor for a difference against none (JZS, Cauchy scale 0.707).",
        lambda result: iterated(result.bayes_factor),
    ),
)
_WILCOXON: tuple[Column[ComparisonResult], ...] = (
    Column(
        "wilcoxon_p",
        "p of the exact signed-rank test, two-sided, not adjusted; n/a: not testable.",
        of(lambda result: result.wilcoxon, lambda test: test.p),
    ),
    Column(
        "wilcoxon_least_p",
        "Smallest p that the signed-rank test could have given.",
        of(lambda result: result.wilcoxon, lambda test: test.floor),
    ),
)
_MIXED_MODEL: tuple[Column[ComparisonResult], ...] = (
    Column(
        "glmm_logits",
        "Difference in logits by the mixed model, first minus second; n/a: not testable.",
        of(lambda result: result.mixed_model, lambda test: iterated(test.logits)),
    ),
    Column(
        "glmm_interval_low",
        "Lower end of its Wald 95 % interval.",
        of(lambda result: result.mixed_model, lambda test: iterated(test.interval.low)),
    ),
    Column(
        "glmm_interval_high",
        "Upper end of its Wald 95 % interval.",
        of(lambda result: result.mixed_model, lambda test: iterated(test.interval.high)),
    ),
    Column(
        "glmm_slope_sd",
        "Standard deviation over participants of this difference, in logits.",
        of(lambda result: result.mixed_model, lambda test: iterated(test.slope_sd)),
    ),
    Column(
        "glmm_lr",
        "Statistic of the likelihood-ratio test, one degree of freedom.",
        of(lambda result: result.mixed_model, lambda test: iterated(test.statistic)),
    ),
    Column("glmm_p", "Its p.", of(lambda result: result.mixed_model, lambda test: iterated(test.p))),
    Column("glmm_p_holm", "Its p after Holm's adjustment.", lambda result: iterated(result.mixed_model_holm)),
    Column(
        "glmm_tests",
        "Number of these tests adjusted for: all planned ones that were testable.",
        lambda result: result.mixed_model_tests,
    ),
    Column(
        "glmm_penalised",
        "Whether answers are separated, so that Firth's penalty was used.",
        of(lambda result: result.mixed_model, lambda test: test.penalised),
    ),
)


COMPARISONS = Declared[Sequence[ComparisonResult], ComparisonResult](
    "comparisons",
    "The planned comparisons, each participant compared with himself or herself.",
    rows=lambda comparisons: comparisons,
    columns=(*_RATES, *_SIGN_FLIP, *_PAIRED_T, *_WILCOXON, *_MIXED_MODEL),
    notes=lambda result: joined(result.notes),
)
DIFFERENCES = Declared[Sequence[ComparisonResult], Difference](
    "differences_by_participant",
    "Each participant's difference of rates in the planned comparisons.",
    rows=lambda comparisons: [each for result in comparisons for each in result.differences],
    columns=(
        PARTICIPANT,
        *COMPARED,
        AT,
        Column("difference", "Rate at first minus rate at second.", lambda row: float(row.value)),
        *interval_columns(NEWCOMBE_INTERVAL),
    ),
    notes=lambda row: None if row.interval else "mean over conditions, so no interval",
)
