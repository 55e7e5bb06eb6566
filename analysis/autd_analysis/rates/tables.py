"""The tables of detection and false-alarm rates."""

from autd_analysis.rates.numbers import (
    GROUP_INTERVAL,
    PARTICIPANT_INTERVAL,
    ConditionRate,
    ParticipantRate,
    Rates,
)
from autd_analysis.report.table import (
    NO_CATCH_TRIALS,
    PARTICIPANT,
    Declared,
    interval_columns,
    iterated,
    why_no_interval,
)
from autd_trials.tables import Column, of

_PARTICIPANT: tuple[Column[ParticipantRate], ...] = (
    Column(
        "rate",
        "felt / trials; averaged over kinds of blocks where several are taken together.",
        of(lambda rate: rate.rate, float),
    ),
    *interval_columns(PARTICIPANT_INTERVAL),
    Column(
        "clopper_pearson_low",
        "Lower end of the exact 95 % interval (Clopper and Pearson).",
        of(lambda rate: rate.clopper_pearson, lambda ends: ends.low),
    ),
    Column(
        "clopper_pearson_high",
        "Upper end of the exact 95 % interval.",
        of(lambda rate: rate.clopper_pearson, lambda ends: ends.high),
    ),
    Column(
        "jeffreys_low",
        "Lower end of Jeffreys' 95 % interval; 0 where none was felt.",
        of(lambda rate: rate.jeffreys, lambda ends: ends.low),
    ),
    Column(
        "jeffreys_high",
        "Upper end of Jeffreys' 95 % interval; 1 where all were felt.",
        of(lambda rate: rate.jeffreys, lambda ends: ends.high),
    ),
    Column("felt", "Number of these trials answered as felt.", lambda rate: rate.felt),
    Column("trials", "Number of trials counted: complete and answered.", lambda rate: rate.n),
)
_CONDITION: tuple[Column[ConditionRate], ...] = (
    Column(
        "rate",
        "Mean of the participants' rates, each participant counting the same.",
        lambda rate: rate.mean,
    ),
    *interval_columns(GROUP_INTERVAL),
    Column(
        "bootstrap_low",
        "Lower end of the 95 % percentile interval of the participant bootstrap.",
        of(lambda rate: rate.bootstrap, lambda ends: ends.low),
    ),
    Column(
        "bootstrap_high",
        "Upper end of the 95 % percentile interval of the participant bootstrap.",
        of(lambda rate: rate.bootstrap, lambda ends: ends.high),
    ),
    Column(
        "beta_binomial_mean",
        "Mean rate over people by the beta-binomial model; n/a: not estimable.",
        of(lambda rate: rate.beta_binomial, lambda fit: iterated(fit.mean)),
    ),
    Column(
        "beta_binomial_low",
        "Lower end of its 95 % profile-likelihood interval.",
        of(lambda rate: rate.beta_binomial, lambda fit: iterated(fit.interval.low)),
    ),
    Column(
        "beta_binomial_high",
        "Upper end of its 95 % profile-likelihood interval.",
        of(lambda rate: rate.beta_binomial, lambda fit: iterated(fit.interval.high)),
    ),
    Column(
        "beta_binomial_correlation",
        "Correlation of two answers of one person; 0: people do not differ.",
        of(lambda rate: rate.beta_binomial, lambda fit: iterated(fit.correlation)),
    ),
    Column(
        "overdispersion_p",
        "p of the likelihood-ratio test that people do not differ.",
        of(lambda rate: rate.beta_binomial, lambda fit: iterated(fit.p_overdispersion)),
    ),
    Column("participants", "Number of participants who have a rate there.", lambda rate: rate.participants),
    Column("felt", "Number of these trials answered as felt.", lambda rate: rate.felt),
    Column("trials", "Number of trials counted: complete and answered.", lambda rate: rate.n),
)


def _participant_note(rate: ParticipantRate) -> str | None:
    averaged = rate.rate is not None and rate.interval is None
    return "mean over kinds of blocks, so no interval" if averaged else None


def _condition_note(rate: ConditionRate) -> str | None:
    return why_no_interval(rate.interval, rate.participants)


RATES = Declared[Rates, ConditionRate](
    "rates",
    "Detection rate in every condition, over participants.",
    rows=lambda rates: rates.conditions,
    columns=_CONDITION,
    notes=_condition_note,
    condition=lambda rate: rate.condition,
)
RATES_BY_PARTICIPANT = Declared[Rates, ParticipantRate](
    "rates_by_participant",
    "Detection rate in every condition, of each participant.",
    rows=lambda rates: rates.participants,
    columns=_PARTICIPANT,
    notes=_participant_note,
    leading=(PARTICIPANT,),
    condition=lambda rate: rate.condition,
)
FALSE_ALARMS = Declared[Rates, ConditionRate](
    "false_alarms",
    "False-alarm rate (catch trials answered as felt), over participants.",
    rows=lambda rates: rates.false_alarms or (),
    columns=_CONDITION,
    notes=_condition_note,
    condition=lambda rate: rate.condition,
    factors=lambda design: design.between_blocks,
    undefined=NO_CATCH_TRIALS,
)
FALSE_ALARMS_BY_PARTICIPANT = Declared[Rates, ParticipantRate](
    "false_alarms_by_participant",
    "False-alarm rate (catch trials answered as felt), of each participant.",
    rows=lambda rates: rates.participant_false_alarms or (),
    columns=_PARTICIPANT,
    notes=_participant_note,
    leading=(PARTICIPANT,),
    condition=lambda rate: rate.condition,
    factors=lambda design: design.between_blocks,
    undefined=NO_CATCH_TRIALS,
)
