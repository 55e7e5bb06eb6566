"""The tables of detection and false-alarm rates."""

from analysis.models.beta_binomial import BetaBinomial
from analysis.rates import GROUP_INTERVAL, PARTICIPANT_INTERVAL, ConditionRate, ParticipantRate
from analysis.study import Results
from analysis.tables.table import (
    ENDS,
    NO_CATCH_TRIALS,
    PARTICIPANT,
    ResultTable,
    Row,
    end_cells,
    factor_columns,
    interval_cells,
    iterated,
    result_table,
    why_no_interval,
)
from autd_trials.records.table import Column

_COUNTS = (
    Column("felt", "Number of these trials answered as felt."),
    Column("trials", "Number of trials counted: complete and answered."),
)
_PARTICIPANT_RATE = (
    Column("rate", "felt / trials; averaged over kinds of blocks where several are taken together."),
    *ENDS,
    Column("clopper_pearson_low", "Lower end of the exact 95 % interval (Clopper and Pearson)."),
    Column("clopper_pearson_high", "Upper end of the exact 95 % interval."),
    Column("jeffreys_low", "Lower end of Jeffreys' 95 % interval; 0 where none was felt."),
    Column("jeffreys_high", "Upper end of Jeffreys' 95 % interval; 1 where all were felt."),
    *_COUNTS,
)
_CONDITION_RATE = (
    Column("rate", "Mean of the participants' rates, each participant counting the same."),
    *ENDS,
    Column("bootstrap_low", "Lower end of the 95 % percentile interval of the participant bootstrap."),
    Column("bootstrap_high", "Upper end of the 95 % percentile interval of the participant bootstrap."),
    Column("beta_binomial_mean", "Mean rate over people by the beta-binomial model; n/a: not estimable."),
    Column("beta_binomial_low", "Lower end of its 95 % profile-likelihood interval."),
    Column("beta_binomial_high", "Upper end of its 95 % profile-likelihood interval."),
    Column("beta_binomial_correlation", "Correlation of two answers of one person; 0: people do not differ."),
    Column("overdispersion_p", "p of the likelihood-ratio test that people do not differ."),
    Column("participants", "Number of participants who have a rate there."),
    *_COUNTS,
)


def rate_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return the rates over participants and of each, and the false alarms likewise."""
    design, simulated = results.trials.design, results.simulated
    cells, blocks = factor_columns(design.factors), factor_columns(design.between_blocks)
    return (
        result_table(
            "rates",
            "Detection rate in every condition, over participants.",
            (*cells, *_CONDITION_RATE),
            map(_condition_row, results.rates),
            simulated=simulated,
        ),
        result_table(
            "rates_by_participant",
            "Detection rate in every condition, of each participant.",
            (PARTICIPANT, *cells, *_PARTICIPANT_RATE),
            map(_participant_row, results.participant_rates),
            simulated=simulated,
        ),
        result_table(
            "false_alarms",
            "False-alarm rate (catch trials answered as felt), over participants.",
            (*blocks, *_CONDITION_RATE),
            map(_condition_row, results.false_alarms or ()),
            simulated=simulated,
            or_else=NO_CATCH_TRIALS,
        ),
        result_table(
            "false_alarms_by_participant",
            "False-alarm rate (catch trials answered as felt), of each participant.",
            (PARTICIPANT, *blocks, *_PARTICIPANT_RATE),
            map(_participant_row, results.participant_false_alarms or ()),
            simulated=simulated,
            or_else=NO_CATCH_TRIALS,
        ),
    )


def _participant_row(rate: ParticipantRate) -> Row:
    averaged = rate.rate is not None and rate.interval is None
    return {
        "participant": rate.participant,
        **dict(rate.condition),
        "rate": None if rate.rate is None else float(rate.rate),
        **interval_cells(rate.interval, PARTICIPANT_INTERVAL),
        **end_cells("clopper_pearson", rate.clopper_pearson),
        **end_cells("jeffreys", rate.jeffreys),
        "felt": rate.felt,
        "trials": rate.n,
        "notes": "mean over kinds of blocks, so no interval" if averaged else None,
    }


def _condition_row(rate: ConditionRate) -> Row:
    return {
        **dict(rate.condition),
        "rate": rate.mean,
        **interval_cells(rate.interval, GROUP_INTERVAL),
        **end_cells("bootstrap", rate.bootstrap),
        **_beta_binomial_cells(rate.beta_binomial),
        "participants": rate.participants,
        "felt": rate.felt,
        "trials": rate.n,
        "notes": None if rate.interval else why_no_interval(rate.participants),
    }


def _beta_binomial_cells(fit: BetaBinomial | None) -> Row:
    return {
        "beta_binomial_mean": iterated(fit.mean) if fit else None,
        "beta_binomial_low": iterated(fit.interval.low) if fit else None,
        "beta_binomial_high": iterated(fit.interval.high) if fit else None,
        "beta_binomial_correlation": iterated(fit.correlation) if fit else None,
        "overdispersion_p": iterated(fit.p_overdispersion) if fit else None,
    }
