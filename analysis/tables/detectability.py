"""The tables of d' and criterion."""

from analysis.detectability import (
    DETECTABILITY_INTERVAL,
    PARTICIPANT_INTERVAL,
    Detectability,
    GroupDetectability,
)
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
    result_table,
    why_no_interval,
)
from autd_trials.records.table import Column

_CRITERION_ENDS = (
    Column("criterion_low", "Lower end of the criterion's interval, of the same kind."),
    Column("criterion_high", "Upper end of it."),
)
_DETECTABILITY = (
    Column("d_prime", "z(hit rate) - z(false-alarm rate), log-linear correction."),
    Column("standard_error", "Its standard error by the delta method; that of the criterion is half of it."),
    *ENDS,
    Column("criterion", "-(z(hit rate) + z(false-alarm rate)) / 2; positive: says felt rarely."),
    *_CRITERION_ENDS,
    Column("stimuli", "Trials with a stimulus."),
    Column("catch_trials", "Catch trials of this kind of block."),
)
_GROUP_DETECTABILITY = (
    Column("d_prime", "Mean of the participants' d'."),
    *ENDS,
    Column("criterion", "Mean of the participants' criteria."),
    *_CRITERION_ENDS,
    Column("participants", "Number of participants who have a d' there."),
)


def detectability_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return d' over participants and of each."""
    cells = factor_columns(results.trials.design.factors)
    return (
        result_table(
            "detectability",
            "d' and criterion in every condition, over participants.",
            (*cells, *_GROUP_DETECTABILITY),
            map(_group_detectability_row, results.group_detectability),
            simulated=results.simulated,
            or_else=NO_CATCH_TRIALS,
        ),
        result_table(
            "detectability_by_participant",
            "d' and criterion in every condition, of each participant.",
            (PARTICIPANT, *cells, *_DETECTABILITY),
            map(_detectability_row, results.detectability or ()),
            simulated=results.simulated,
            or_else=NO_CATCH_TRIALS,
        ),
    )


def _detectability_row(found: Detectability) -> Row:
    return {
        "participant": found.participant,
        **dict(found.condition),
        "d_prime": found.d_prime,
        "standard_error": found.standard_error,
        **interval_cells(found.interval, PARTICIPANT_INTERVAL),
        "criterion": found.criterion,
        **end_cells("criterion", found.criterion_interval),
        "stimuli": found.stimuli,
        "catch_trials": found.catch_trials,
    }


def _group_detectability_row(group: GroupDetectability) -> Row:
    return {
        **dict(group.condition),
        "d_prime": group.d_prime,
        **interval_cells(group.interval, DETECTABILITY_INTERVAL),
        "criterion": group.criterion,
        **end_cells("criterion", group.criterion_interval),
        "participants": group.participants,
        "notes": None if group.interval else why_no_interval(group.participants),
    }
