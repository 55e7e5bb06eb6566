"""The tables of timing: onsets and disturbances, and response times."""

from analysis.study import Results
from analysis.tables.table import (
    PARTICIPANT,
    ResultTable,
    Row,
    factor_columns,
    result_table,
    why_no_interval,
)
from analysis.timing import (
    NOT_RECORDED,
    ConditionResponseTime,
    CountSummary,
    ParticipantResponseTime,
    TimeSummary,
    disturbances,
    onset_times,
    response_times,
    response_times_over_participants,
)
from autd_trials.records.table import Column

_TIMING = (
    Column("quantity", "What was measured or counted."),
    Column("about", "What it is."),
    Column("unit", "ms, or count."),
    Column("trials", "Number of complete trials that have it; of times, stimulus trials in real time."),
    Column("least", "Least time."),
    Column("median", "Median time."),
    Column("largest", "Largest time."),
    Column("late_trials", "Onsets later than 1 ms."),
    Column("total", "Sum of the counts."),
    Column("trials_with", "Number of trials with at least one."),
)
_PER_PARTICIPANT = (
    Column("lower_quartile_s", "Lower quartile of the response times; n/a without any."),
    Column("median_s", "Median of the response times."),
    Column("upper_quartile_s", "Upper quartile of the response times."),
    Column("trials", "Number of stimuli that were felt and have a response time."),
)
_OVER_PARTICIPANTS = (
    Column("mean_of_medians_s", "Mean of the participants' medians, each participant counting the same."),
    Column("interval_low_s", "Lower end of its 95 % t interval over participants."),
    Column("interval_high_s", "Upper end of its 95 % t interval over participants."),
    Column("participants", "Number of participants who have a response time there."),
    Column("trials", "Number of stimuli that were felt and have a response time."),
)
_FELT_ONLY = "Only stimuli that were felt have one, so that conditions differ in which trials they show."


def timing_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return how well onsets were timed, what disturbed trials, and how fast people answered."""
    factors, simulated = results.trials.design.factors, results.simulated
    cells, times = factor_columns(factors), response_times(results.trials, factors)
    return (
        result_table(
            "timing",
            "How well onsets were timed, and what disturbed trials. Times are not measured in virtual time.",
            _TIMING,
            [
                *map(_time_row, onset_times(results.trials)),
                *map(_count_row, disturbances(results.trials)),
            ],
            simulated=simulated,
        ),
        result_table(
            "response_times",
            f"Response times from the onset to the first press, over participants. {_FELT_ONLY}",
            (*cells, *_OVER_PARTICIPANTS),
            map(_condition_row, response_times_over_participants(times)),
            simulated=simulated,
        ),
        result_table(
            "response_times_by_participant",
            f"Response times from the onset to the first press, of each participant. {_FELT_ONLY}",
            (PARTICIPANT, *cells, *_PER_PARTICIPANT),
            map(_participant_row, times),
            simulated=simulated,
        ),
    )


def _time_row(times: TimeSummary) -> Row:
    return {
        "quantity": times.name,
        "about": times.about,
        "unit": "ms",
        "trials": times.trials,
        "least": _ms(times.values_s[0] if times.trials else None),
        "median": _ms(times.median_s),
        "largest": _ms(times.values_s[-1] if times.trials else None),
        "late_trials": times.late if times.trials and times.name == "onset_lateness" else None,
        "notes": times.note,
    }


def _count_row(counts: CountSummary) -> Row:
    return {
        "quantity": counts.name,
        "about": counts.about,
        "unit": "count",
        "trials": counts.trials,
        "total": counts.total,
        "trials_with": None if counts.total is None else counts.trials_with,
        "notes": NOT_RECORDED if counts.total is None else None,
    }


def _condition_row(time: ConditionResponseTime) -> Row:
    ends = time.interval_s
    return {
        **dict(time.condition),
        "mean_of_medians_s": time.mean_s,
        "interval_low_s": ends.low if ends else None,
        "interval_high_s": ends.high if ends else None,
        "participants": time.participants,
        "trials": time.trials,
        "notes": None if ends else why_no_interval(time.participants),
    }


def _participant_row(time: ParticipantResponseTime) -> Row:
    low, median, high = time.quartiles_s or (None, None, None)
    return {
        "participant": time.participant,
        **dict(time.condition),
        "lower_quartile_s": low,
        "median_s": median,
        "upper_quartile_s": high,
        "trials": len(time.values_s),
        "notes": None if time.values_s else "no felt stimulus with a response time",
    }


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1000 * seconds
