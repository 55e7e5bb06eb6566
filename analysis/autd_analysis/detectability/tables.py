"""The tables of d' and criterion."""

from autd_analysis.detectability.numbers import (
    DETECTABILITY_INTERVAL,
    PARTICIPANT_INTERVAL,
    Detectability,
    DetectabilityResults,
    GroupDetectability,
)
from autd_analysis.report.table import (
    NO_CATCH_TRIALS,
    PARTICIPANT,
    Declared,
    interval_columns,
    why_no_interval,
)
from autd_trials.tables import Column, of

BY_PARTICIPANT = Declared[DetectabilityResults, Detectability](
    "detectability_by_participant",
    "d' and criterion in every condition, of each participant.",
    rows=lambda found: found.participants,
    leading=(PARTICIPANT,),
    condition=lambda found: found.condition,
    columns=(
        Column(
            "d_prime",
            "z(hit rate) - z(false-alarm rate), log-linear correction.",
            lambda found: found.d_prime,
        ),
        Column(
            "standard_error",
            "Its standard error by the delta method; that of the criterion is half of it.",
            lambda found: found.standard_error,
        ),
        *interval_columns(PARTICIPANT_INTERVAL),
        Column(
            "criterion",
            "-(z(hit rate) + z(false-alarm rate)) / 2; positive: says felt rarely.",
            lambda found: found.criterion,
        ),
        Column(
            "criterion_low",
            "Lower end of the criterion's interval, of the same kind.",
            lambda found: found.criterion_interval.low,
        ),
        Column("criterion_high", "Upper end of it.", lambda found: found.criterion_interval.high),
        Column("stimuli", "Trials with a stimulus.", lambda found: found.stimuli),
        Column("catch_trials", "Catch trials of this kind of block.", lambda found: found.catch_trials),
    ),
    undefined=NO_CATCH_TRIALS,
)
OVER_PARTICIPANTS = Declared[DetectabilityResults, GroupDetectability](
    "detectability",
    "d' and criterion in every condition, over participants.",
    rows=lambda found: found.conditions,
    condition=lambda group: group.condition,
    columns=(
        Column("d_prime", "Mean of the participants' d'.", lambda group: group.d_prime),
        *interval_columns(DETECTABILITY_INTERVAL),
        Column("criterion", "Mean of the participants' criteria.", lambda group: group.criterion),
        Column(
            "criterion_low",
            "Lower end of the criterion's interval, of the same kind.",
            of(lambda group: group.criterion_interval, lambda ends: ends.low),
        ),
        Column(
            "criterion_high",
            "Upper end of it.",
            of(lambda group: group.criterion_interval, lambda ends: ends.high),
        ),
        Column(
            "participants", "Number of participants who have a d' there.", lambda group: group.participants
        ),
    ),
    notes=lambda group: why_no_interval(group.interval, group.participants),
    undefined=NO_CATCH_TRIALS,
)
