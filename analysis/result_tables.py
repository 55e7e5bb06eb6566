"""The results as tables: rows, and what every column means."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from analysis.comparisons import DIFFERENCE_INTERVAL, ComparisonResult
from analysis.design import StudyFactor, format_level
from analysis.detectability import DETECTABILITY_INTERVAL, Detectability, GroupDetectability
from analysis.intervals import Interval
from analysis.models.beta_binomial import BetaBinomial
from analysis.rates import GROUP_INTERVAL, PARTICIPANT_INTERVAL, ConditionRate, ParticipantRate
from analysis.study import Results
from autd_trials.records.table import Column

Value = str | float | bool | None
Row = dict[str, Value]

NO_CATCH_TRIALS = "undefined: the study has no catch trials"

_PARTICIPANT = Column("participant", "The participant's label.")
_SIMULATED = Column(
    "simulated", "Whether participants were simulated: if yes, these are no data about people."
)
_NOTES = Column("notes", "What could not be computed, and why.")
_ENDS = (
    Column("interval_low", "Lower end of the interval; n/a where none can be given."),
    Column("interval_high", "Upper end of the interval; n/a where none can be given."),
    Column("interval", "Kind of the interval."),
)
_COUNTS = (
    Column("felt", "Number of these trials answered as felt."),
    Column("trials", "Number of trials counted: complete and answered."),
)
_PARTICIPANT_RATE = (
    Column("rate", "felt / trials; averaged over kinds of blocks where several are taken together."),
    *_ENDS,
    Column("clopper_pearson_low", "Lower end of the exact 95 % interval (Clopper and Pearson)."),
    Column("clopper_pearson_high", "Upper end of the exact 95 % interval."),
    Column("jeffreys_low", "Lower end of Jeffreys' 95 % interval; 0 where none was felt."),
    Column("jeffreys_high", "Upper end of Jeffreys' 95 % interval; 1 where all were felt."),
    *_COUNTS,
    _NOTES,
    _SIMULATED,
)
_CONDITION_RATE = (
    Column("rate", "Mean of the participants' rates, each participant counting the same."),
    *_ENDS,
    Column("bootstrap_low", "Lower end of the 95 % percentile interval of the participant bootstrap."),
    Column("bootstrap_high", "Upper end of the 95 % percentile interval of the participant bootstrap."),
    Column("beta_binomial_mean", "Mean rate over people by the beta-binomial model; n/a: not estimable."),
    Column("beta_binomial_low", "Lower end of its 95 % profile-likelihood interval."),
    Column("beta_binomial_high", "Upper end of its 95 % profile-likelihood interval."),
    Column("beta_binomial_correlation", "Correlation of two answers of one person; 0: people do not differ."),
    Column("overdispersion_p", "p of the likelihood-ratio test that people do not differ."),
    Column("participants", "Number of participants who have a rate there."),
    *_COUNTS,
    _NOTES,
    _SIMULATED,
)
_COMPARISON = (
    Column("factor", "The factor compared."),
    Column("first", "The level subtracted from."),
    Column("second", "The level subtracted."),
    Column("at", "The level of the other factor at which they were compared; n/a if over all trials."),
    Column("participants", "Number of participants who have both rates."),
    Column("mean_difference", "Mean over participants of the rate at first minus the rate at second."),
    Column("sd_difference", "Standard deviation (n - 1) of these differences over participants."),
    *_ENDS,
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
    _NOTES,
    _SIMULATED,
)
_DETECTABILITY = (
    Column("d_prime", "z(hit rate) - z(false-alarm rate), log-linear correction."),
    Column("standard_error", "Its standard error by the delta method."),
    Column("criterion", "-(z(hit rate) + z(false-alarm rate)) / 2; positive: says felt rarely."),
    _NOTES,
    _SIMULATED,
)
_GROUP_DETECTABILITY = (
    Column("d_prime", "Mean of the participants' d'."),
    *_ENDS,
    Column("criterion", "Mean of the participants' criteria."),
    Column("participants", "Number of participants who have a d' there."),
    _NOTES,
    _SIMULATED,
)
_SIGNIFICANT_DIGITS = 10


@dataclass(frozen=True)
class ResultTable:
    """A table of results.

    Attributes
    ----------
    name
        The file's name without its ending.
    about
        What the table holds.
    columns
        The columns in order, each described.
    rows
        Cells by column; None is missing or undefined.
    """

    name: str
    about: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]


def result_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return all results of a study as tables.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    tuple of ResultTable
        The same tables for every study; what is undefined is said in a row of its own.
    """
    design = results.trials.design
    mark: Row = {"simulated": results.simulated}
    cells, blocks = _factor_columns(design.factors), _factor_columns(design.between_blocks)
    undefined: Row = {"trials": 0, "notes": NO_CATCH_TRIALS}
    return (
        ResultTable(
            "rates",
            "Detection rate in every condition, over participants.",
            (*cells, *_CONDITION_RATE),
            _rows(mark, map(_condition_row, results.rates)),
        ),
        ResultTable(
            "rates_by_participant",
            "Detection rate in every condition, of each participant.",
            (_PARTICIPANT, *cells, *_PARTICIPANT_RATE),
            _rows(mark, map(_participant_row, results.participant_rates)),
        ),
        ResultTable(
            "comparisons",
            "The planned comparisons, each participant compared with himself or herself.",
            _COMPARISON,
            _rows(mark, map(_comparison_row, results.comparisons)),
        ),
        ResultTable(
            "false_alarms",
            "False-alarm rate (catch trials answered as felt), over participants.",
            (*blocks, *_CONDITION_RATE),
            _rows(mark, map(_condition_row, results.false_alarms or ()), or_else=undefined),
        ),
        ResultTable(
            "detectability",
            "d' and criterion in every condition, over participants.",
            (*cells, *_GROUP_DETECTABILITY),
            _rows(mark, map(_group_detectability_row, results.group_detectability), or_else=undefined),
        ),
        ResultTable(
            "detectability_by_participant",
            "d' and criterion in every condition, of each participant.",
            (_PARTICIPANT, *cells, *_DETECTABILITY),
            _rows(mark, map(_detectability_row, results.detectability or ()), or_else=undefined),
        ),
        ResultTable(
            "false_alarms_by_participant",
            "False-alarm rate (catch trials answered as felt), of each participant.",
            (_PARTICIPANT, *blocks, *_PARTICIPANT_RATE),
            _rows(mark, map(_participant_row, results.participant_false_alarms or ()), or_else=undefined),
        ),
    )


def _factor_columns(factors: Sequence[StudyFactor]) -> tuple[Column, ...]:
    return tuple(
        Column(factor.name, "Level of this factor; n/a: over all its levels together.") for factor in factors
    )


def _rows(mark: Row, rows: Iterable[Row], or_else: Row | None = None) -> tuple[Row, ...]:
    """Return the rows, each with the mark; where there are none, `or_else` instead."""
    made = list(rows) or ([or_else] if or_else else [])
    return tuple({key: _rounded(value) for key, value in row.items()} | mark for row in made)


def _rounded(value: Value) -> Value:
    # The last digits of a float may differ between machines; the tables shall not.
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if isinstance(value, float) else value


def _interval_cells(interval: Interval | None, kind: str) -> Row:
    return {**_end_cells("interval", interval), "interval": kind}


def _end_cells(name: str, interval: Interval | None) -> Row:
    return {
        f"{name}_low": interval.low if interval else None,
        f"{name}_high": interval.high if interval else None,
    }


def _participant_row(rate: ParticipantRate) -> Row:
    averaged = rate.rate is not None and rate.interval is None
    return {
        "participant": rate.participant,
        **dict(rate.condition),
        "rate": None if rate.rate is None else float(rate.rate),
        **_interval_cells(rate.interval, PARTICIPANT_INTERVAL),
        **_end_cells("clopper_pearson", rate.clopper_pearson),
        **_end_cells("jeffreys", rate.jeffreys),
        "felt": rate.felt,
        "trials": rate.n,
        "notes": "mean over kinds of blocks, so no interval" if averaged else None,
    }


def _condition_row(rate: ConditionRate) -> Row:
    return {
        **dict(rate.condition),
        "rate": rate.mean,
        **_interval_cells(rate.interval, GROUP_INTERVAL),
        **_end_cells("bootstrap", rate.bootstrap),
        **_beta_binomial_cells(rate.beta_binomial),
        "participants": rate.participants,
        "felt": rate.felt,
        "trials": rate.n,
        "notes": None if rate.interval else _why_no_interval(rate.participants),
    }


def _beta_binomial_cells(fit: BetaBinomial | None) -> Row:
    return {
        "beta_binomial_mean": _iterated(fit.mean) if fit else None,
        "beta_binomial_low": _iterated(fit.interval.low) if fit else None,
        "beta_binomial_high": _iterated(fit.interval.high) if fit else None,
        "beta_binomial_correlation": _iterated(fit.correlation) if fit else None,
        "overdispersion_p": _iterated(fit.p_overdispersion) if fit else None,
    }


def _why_no_interval(participants: int) -> str:
    if participants > 1:
        return "no interval: all participants have the same rate"
    return f"no interval over {participants} participant(s)"


def _comparison_row(result: ComparisonResult) -> Row:
    sign_flip, paired_t = result.sign_flip, result.paired_t
    return {
        "factor": result.factor,
        "first": format_level(result.first),
        "second": format_level(result.second),
        "at": "; ".join(f"{name} {format_level(level)}" for name, level in result.at) or None,
        "participants": result.participants,
        "mean_difference": result.mean,
        "sd_difference": result.sd,
        **_interval_cells(result.interval, DIFFERENCE_INTERVAL),
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


def _detectability_row(found: Detectability) -> Row:
    return {
        "participant": found.participant,
        **dict(found.condition),
        "d_prime": found.d_prime,
        "standard_error": found.standard_error,
        "criterion": found.criterion,
    }


def _group_detectability_row(group: GroupDetectability) -> Row:
    return {
        **dict(group.condition),
        "d_prime": group.d_prime,
        **_interval_cells(group.interval, DETECTABILITY_INTERVAL),
        "criterion": group.criterion,
        "participants": group.participants,
        "notes": None if group.interval else _why_no_interval(group.participants),
    }


def _more_of_t_cells(result: ComparisonResult) -> Row:
    interval = result.dz_interval
    return {
        "t_dz_interval_low": None if interval is None else _iterated(interval.low),
        "t_dz_interval_high": None if interval is None else _iterated(interval.high),
        "bayes_factor": _iterated(result.bayes_factor),
    }


def _iterated(value: float | None) -> float | None:
    """Round what an iteration or a quadrature gave: machines agree in fewer digits there."""
    return None if value is None else float(f"{value:.5g}")


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
        **{name: _iterated(value) for name, value in estimates.items()},
        "glmm_tests": result.mixed_model_tests,
        "glmm_penalised": test.penalised if test else None,
    }
