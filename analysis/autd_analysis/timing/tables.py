"""The tables of timing: onsets and disturbances, and response times."""

from autd_analysis.report.table import PARTICIPANT, Declared, why_no_interval
from autd_analysis.timing.numbers import (
    NOT_RECORDED,
    ConditionResponseTime,
    CountSummary,
    ParticipantResponseTime,
    TimeSummary,
    Timing,
)
from autd_trials.tables import Column, of

_FELT_ONLY = "Only stimuli that were felt have one, so that conditions differ in which trials they show."


def _time(row: TimeSummary | CountSummary) -> TimeSummary | None:
    return row if isinstance(row, TimeSummary) else None


def _measured(row: TimeSummary | CountSummary) -> TimeSummary | None:
    return row if isinstance(row, TimeSummary) and row.trials else None


def _count(row: TimeSummary | CountSummary) -> CountSummary | None:
    return row if isinstance(row, CountSummary) else None


def _timing_note(row: TimeSummary | CountSummary) -> str | None:
    if isinstance(row, TimeSummary):
        return row.note
    return NOT_RECORDED if row.total is None else None


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1000 * seconds


TIMING = Declared[Timing, TimeSummary | CountSummary](
    "timing",
    "How well onsets were timed, and what disturbed trials. Times are not measured in virtual time.",
    rows=lambda found: (*found.onsets, *found.disturbances),
    columns=(
        Column("quantity", "What was measured or counted.", lambda row: row.name),
        Column("about", "What it is.", lambda row: row.about),
        Column("unit", "ms, or count.", lambda row: "ms" if isinstance(row, TimeSummary) else "count"),
        Column(
            "trials",
            "Number of complete trials that have it; of times, stimulus trials in real time.",
            lambda row: row.trials,
        ),
        Column("least", "Least time.", of(_measured, lambda times: _ms(times.values_s[0]))),
        Column("median", "Median time.", of(_time, lambda times: _ms(times.median_s))),
        Column("largest", "Largest time.", of(_measured, lambda times: _ms(times.values_s[-1]))),
        Column(
            "late_trials",
            "Onsets later than 1 ms.",
            of(_measured, lambda times: times.late if times.name == "onset_lateness" else None),
        ),
        Column("total", "Sum of the counts.", of(_count, lambda counts: counts.total)),
        Column(
            "trials_with",
            "Number of trials with at least one.",
            of(_count, lambda counts: None if counts.total is None else counts.trials_with),
        ),
    ),
    notes=_timing_note,
)
OVER_PARTICIPANTS = Declared[Timing, ConditionResponseTime](
    "response_times",
    f"Response times from the onset to the first press, over participants. {_FELT_ONLY}",
    rows=lambda found: found.conditions,
    condition=lambda time: time.condition,
    columns=(
        Column(
            "mean_of_medians_s",
            "Mean of the participants' medians, each participant counting the same.",
            lambda time: time.mean_s,
        ),
        Column(
            "interval_low_s",
            "Lower end of its 95 % t interval over participants.",
            of(lambda time: time.interval_s, lambda ends: ends.low),
        ),
        Column(
            "interval_high_s",
            "Upper end of its 95 % t interval over participants.",
            of(lambda time: time.interval_s, lambda ends: ends.high),
        ),
        Column(
            "participants",
            "Number of participants who have a response time there.",
            lambda time: time.participants,
        ),
        Column(
            "trials",
            "Number of stimuli that were felt and have a response time.",
            lambda time: time.trials,
        ),
    ),
    notes=lambda time: why_no_interval(time.interval_s, time.participants),
)
BY_PARTICIPANT = Declared[Timing, ParticipantResponseTime](
    "response_times_by_participant",
    f"Response times from the onset to the first press, of each participant. {_FELT_ONLY}",
    rows=lambda found: found.participants,
    leading=(PARTICIPANT,),
    condition=lambda time: time.condition,
    columns=(
        Column(
            "lower_quartile_s",
            "Lower quartile of the response times; n/a without any.",
            of(lambda time: time.quartiles_s, lambda quartiles: quartiles[0]),
        ),
        Column(
            "median_s",
            "Median of the response times.",
            of(lambda time: time.quartiles_s, lambda quartiles: quartiles[1]),
        ),
        Column(
            "upper_quartile_s",
            "Upper quartile of the response times.",
            of(lambda time: time.quartiles_s, lambda quartiles: quartiles[2]),
        ),
        Column(
            "trials",
            "Number of stimuli that were felt and have a response time.",
            lambda time: len(time.values_s),
        ),
    ),
    notes=lambda time: None if time.values_s else "no felt stimulus with a response time",
)
