"""The table of planned comparisons."""

from analysis.comparisons import DIFFERENCE_INTERVAL, ComparisonResult
from analysis.design import format_level
from analysis.study import Results
from analysis.tables.table import ENDS, ResultTable, Row, interval_cells, iterated, result_table
from analysis.wording import levels_text
from autd_trials.records.table import Column

_COMPARISON = (
    Column("factor", "The factor compared."),
    Column("first", "The level subtracted from."),
    Column("second", "The level subtracted."),
    Column("at", "The level of the other factor at which they were compared; n/a if over all trials."),
    Column("participants", "Number of participants who have both rates."),
    Column("mean_difference", "Mean over participants of the rate at first minus the rate at second."),
    Column("sd_difference", "Standard deviation (n - 1) of these differences over participants."),
    *ENDS,
    Column("sign_flip_p", "p of the exact sign-flip test of the differences, two-sided; n/a: not testable."),
    Column("sign_flip_p_holm", "The same after Holm's adjustment."),
    Column(
        "sign_flip_least_p", "Smallest p that the sign-flip test could have given with these differences."
    ),
    Column("sign_flip_nonzero", "Number of participants whose difference is not zero."),
    Column("sign_flip_tests", "Number of sign-flip tests adjusted for: all planned ones that were testable."),
    Column("t", "Statistic of the paired t test, two-sided; n/a: not testable."),
    Column("t_df", "Its degrees of freedom."),
    Column("t_p", "Its p."),
    Column("t_p_holm", "Its p after Holm's adjustment."),
    Column("t_tests", "Number of t tests adjusted for: all planned ones that were testable."),
    Column("t_dz", "Standardised mean difference: mean_difference / sd_difference."),
    Column("t_dz_interval_low", "Lower end of its 95 % interval (noncentral t)."),
    Column("t_dz_interval_high", "Upper end of its 95 % interval (noncentral t)."),
    Column("bayes_factor", "Bayes factor for a difference against none (JZS, Cauchy scale 0.707)."),
    Column("wilcoxon_p", "p of the exact signed-rank test, two-sided, not adjusted; n/a: not testable."),
    Column("wilcoxon_least_p", "Smallest p that the signed-rank test could have given."),
    Column("glmm_logits", "Difference in logits by the mixed model, first minus second; n/a: not testable."),
    Column("glmm_interval_low", "Lower end of its Wald 95 % interval."),
    Column("glmm_interval_high", "Upper end of its Wald 95 % interval."),
    Column("glmm_slope_sd", "Standard deviation over participants of this difference, in logits."),
    Column("glmm_lr", "Statistic of the likelihood-ratio test, one degree of freedom."),
    Column("glmm_p", "Its p."),
    Column("glmm_p_holm", "Its p after Holm's adjustment."),
    Column("glmm_tests", "Number of these tests adjusted for: all planned ones that were testable."),
    Column("glmm_penalised", "Whether answers are separated, so that Firth's penalty was used."),
)


def comparison_table(results: Results) -> ResultTable:
    """Return the planned comparisons with all their tests."""
    return result_table(
        "comparisons",
        "The planned comparisons, each participant compared with himself or herself.",
        _COMPARISON,
        map(_comparison_row, results.comparisons),
        simulated=results.simulated,
    )


def _comparison_row(result: ComparisonResult) -> Row:
    sign_flip, paired_t = result.sign_flip, result.paired_t
    return {
        "factor": result.factor,
        "first": format_level(result.first),
        "second": format_level(result.second),
        "at": levels_text(result.at),
        "participants": result.participants,
        "mean_difference": result.mean,
        "sd_difference": result.sd,
        **interval_cells(result.interval, DIFFERENCE_INTERVAL),
        "sign_flip_p": sign_flip.p if sign_flip else None,
        "sign_flip_p_holm": result.sign_flip_holm,
        "sign_flip_least_p": sign_flip.floor if sign_flip else None,
        "sign_flip_nonzero": sign_flip.nonzero if sign_flip else None,
        "sign_flip_tests": result.sign_flip_tests,
        "t": paired_t.t if paired_t else None,
        "t_df": paired_t.df if paired_t else None,
        "t_p": paired_t.p if paired_t else None,
        "t_p_holm": result.paired_t_holm,
        "t_tests": result.paired_t_tests,
        "t_dz": paired_t.dz if paired_t else None,
        **_more_of_t_cells(result),
        "wilcoxon_p": result.wilcoxon.p if result.wilcoxon else None,
        "wilcoxon_least_p": result.wilcoxon.floor if result.wilcoxon else None,
        **_mixed_model_cells(result),
        "notes": "; ".join(result.notes) or None,
    }


def _more_of_t_cells(result: ComparisonResult) -> Row:
    interval = result.dz_interval
    return {
        "t_dz_interval_low": None if interval is None else iterated(interval.low),
        "t_dz_interval_high": None if interval is None else iterated(interval.high),
        "bayes_factor": iterated(result.bayes_factor),
    }


def _mixed_model_cells(result: ComparisonResult) -> Row:
    test = result.mixed_model
    estimates: dict[str, float | None] = {
        "glmm_logits": test.logits if test else None,
        "glmm_interval_low": test.interval.low if test else None,
        "glmm_interval_high": test.interval.high if test else None,
        "glmm_slope_sd": test.slope_sd if test else None,
        "glmm_lr": test.statistic if test else None,
        "glmm_p": test.p if test else None,
        "glmm_p_holm": result.mixed_model_holm,
    }
    return {
        **{name: iterated(value) for name, value in estimates.items()},
        "glmm_tests": result.mixed_model_tests,
        "glmm_penalised": test.penalised if test else None,
    }
