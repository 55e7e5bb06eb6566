"""The tables of thresholds of adaptive studies."""

from analysis.design import format_level
from analysis.study import Results
from analysis.tables.table import (
    ENDS,
    PARTICIPANT,
    ResultTable,
    Row,
    factor_columns,
    interval_cells,
    iterated,
    iterated_interval,
    result_table,
    why_no_interval,
)
from analysis.threshold_comparisons import DIFFERENCE_INTERVAL, ThresholdComparison
from analysis.thresholds import THRESHOLD_INTERVAL, GroupThreshold, Threshold
from analysis.wording import levels_text
from autd_trials.records.table import Column

_UNTOLD = Column("untold", "Number of participants whose tracks do not tell it; they are left out.")
_BY_PARTICIPANT = (
    Column("threshold", "The level felt at `rate`; n/a: the track does not tell."),
    Column("rate", "The rate of felt that the threshold is for."),
    Column("spread_db", "Standard deviation in dB, of QUEST+'s posterior or over a staircase's reversals."),
    Column("trials", "Number of trials."),
)
_GROUP = (
    Column("threshold", "Geometric mean of the participants' thresholds."),
    *ENDS,
    Column("participants", "Number of participants in the mean."),
    _UNTOLD,
    Column("over", "Those of them whose threshold lies over the largest level: the mean is too low."),
    Column("under", "Those of them whose threshold lies under the smallest level: the mean is too high."),
)
_COMPARISON = (
    Column("factor", "The factor compared."),
    Column("first", "The level subtracted from."),
    Column("second", "The level subtracted."),
    Column("at", "The level of the other factor at which they were compared; n/a if over all."),
    Column("participants", "Number of participants with both thresholds."),
    _UNTOLD,
    Column("mean_difference_db", "Mean of threshold at first minus threshold at second, in dB."),
    *ENDS,
    Column("t", "Paired t of the differences in dB, two-sided; n/a: not testable."),
    Column("t_df", "Its degrees of freedom."),
    Column("t_p", "Its p."),
    Column("t_p_holm", "Its p after Holm's adjustment over all comparisons."),
    Column("t_dz", "Standardised mean difference."),
    Column("sign_flip_p", "p of the exact sign-flip test of the differences, two-sided."),
    Column("sign_flip_p_holm", "The same after Holm's adjustment."),
    Column("sign_flip_least_p", "Smallest p that the sign-flip test could have given."),
    Column(
        "higher_first",
        "Participants whose threshold at first is known to be the higher, beyond the levels included.",
    ),
    Column("higher_second", "Participants whose threshold at second is known to be the higher."),
    Column("sign_p", "p of the exact sign test of these two counts, two-sided."),
    Column("sign_p_holm", "The same after Holm's adjustment."),
)


def threshold_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return thresholds over participants, of each, and compared."""
    cells = factor_columns(results.trials.design.factors)
    return (
        result_table(
            "thresholds",
            "Thresholds in every condition, over participants, as the adaptive method estimates them.",
            (*cells, *_GROUP),
            map(_group_row, results.group_thresholds),
            simulated=results.simulated,
        ),
        result_table(
            "thresholds_by_participant",
            "Thresholds in every condition, of each participant.",
            (PARTICIPANT, *cells, *_BY_PARTICIPANT),
            map(_row, results.thresholds),
            simulated=results.simulated,
        ),
        result_table(
            "threshold_comparisons",
            "The planned comparisons, of thresholds in dB within participants.",
            _COMPARISON,
            map(_comparison_row, results.threshold_comparisons),
            simulated=results.simulated,
        ),
    )


def _row(found: Threshold) -> Row:
    return {
        "participant": found.participant,
        **dict(found.condition),
        "threshold": iterated(found.threshold),
        "rate": iterated(found.rate),
        "spread_db": iterated(found.spread_db),
        "trials": found.trials,
        "notes": found.note,
    }


def _group_row(group: GroupThreshold) -> Row:
    return {
        **dict(group.condition),
        "threshold": iterated(group.threshold),
        **interval_cells(iterated_interval(group.interval), THRESHOLD_INTERVAL),
        "participants": group.participants,
        "untold": group.untold,
        "over": group.over,
        "under": group.under,
        "notes": None if group.interval else why_no_interval(group.participants),
    }


def _comparison_row(found: ThresholdComparison) -> Row:
    paired_t, sign_flip = found.paired_t, found.sign_flip
    return {
        "factor": found.factor,
        "first": format_level(found.first),
        "second": format_level(found.second),
        "at": levels_text(found.at),
        "participants": len(found.differences_db),
        "untold": found.untold,
        "mean_difference_db": iterated(found.mean_db),
        **interval_cells(iterated_interval(found.interval), DIFFERENCE_INTERVAL),
        "t": iterated(paired_t.t) if paired_t else None,
        "t_df": paired_t.df if paired_t else None,
        "t_p": iterated(paired_t.p) if paired_t else None,
        "t_p_holm": iterated(found.paired_t_holm),
        "t_dz": iterated(paired_t.dz) if paired_t else None,
        "sign_flip_p": sign_flip.p if sign_flip else None,
        "sign_flip_p_holm": found.sign_flip_holm,
        "sign_flip_least_p": sign_flip.floor if sign_flip else None,
        "higher_first": found.higher_first,
        "higher_second": found.higher_second,
        "sign_p": found.sign_p,
        "sign_p_holm": found.sign_holm,
        "notes": None if found.interval else why_no_interval(len(found.differences_db)),
    }
