"""The tables of thresholds of adaptive studies."""

from autd_analysis.report.table import (
    AT,
    COMPARED,
    PARTICIPANT,
    Declared,
    interval_columns,
    iterated,
    why_no_interval,
)
from autd_analysis.thresholds.comparisons import DIFFERENCE_INTERVAL, ThresholdComparison, Thresholds
from autd_analysis.thresholds.numbers import THRESHOLD_INTERVAL, GroupThreshold, Threshold
from autd_trials.tables import Column, of

_UNDETERMINED: Column[GroupThreshold | ThresholdComparison] = Column(
    "undetermined",
    "Number of participants whose adaptive runs do not determine it; they are excluded.",
    lambda found: found.undetermined,
)


OVER_PARTICIPANTS = Declared[Thresholds, GroupThreshold](
    "thresholds",
    "Thresholds in every condition, over participants, as the adaptive method estimates them.",
    rows=lambda found: found.conditions,
    condition=lambda group: group.condition,
    columns=(
        Column(
            "threshold",
            "Geometric mean of the participants' thresholds.",
            lambda group: iterated(group.threshold),
        ),
        *interval_columns(THRESHOLD_INTERVAL, iterative=True),
        Column("participants", "Number of participants in the mean.", lambda group: group.participants),
        _UNDETERMINED,
        Column(
            "over",
            "Those of them whose threshold lies over the largest level: the mean is too low.",
            lambda group: group.over,
        ),
        Column(
            "under",
            "Those of them whose threshold lies under the smallest level: the mean is too high.",
            lambda group: group.under,
        ),
    ),
    notes=lambda group: why_no_interval(group.interval, group.participants),
)
BY_PARTICIPANT = Declared[Thresholds, Threshold](
    "thresholds_by_participant",
    "Thresholds in every condition, of each participant.",
    rows=lambda found: found.participants,
    leading=(PARTICIPANT,),
    condition=lambda found: found.condition,
    columns=(
        Column(
            "threshold",
            "The level felt at `rate`; n/a: undetermined.",
            lambda found: iterated(found.threshold),
        ),
        Column("rate", "The rate of felt that the threshold is for.", lambda found: iterated(found.rate)),
        Column(
            "spread_db",
            "Standard deviation in dB, of QUEST+'s posterior or over a staircase's reversals.",
            lambda found: iterated(found.spread_db),
        ),
        Column("trials", "Number of trials.", lambda found: found.trials),
    ),
    notes=lambda found: found.note,
)
COMPARISONS = Declared[Thresholds, ThresholdComparison](
    "threshold_comparisons",
    "The planned comparisons, of thresholds in dB within participants.",
    rows=lambda found: found.comparisons,
    columns=(
        *COMPARED,
        AT,
        Column(
            "participants",
            "Number of participants with both thresholds.",
            lambda found: len(found.differences_db),
        ),
        _UNDETERMINED,
        Column(
            "mean_difference_db",
            "Mean of threshold at first minus threshold at second, in dB.",
            lambda found: iterated(found.mean_db),
        ),
        *interval_columns(DIFFERENCE_INTERVAL, iterative=True),
        Column(
            "t",
            "Paired t of the differences in dB, two-sided; n/a: not testable.",
            of(lambda found: found.paired_t, lambda test: iterated(test.t)),
        ),
        Column("t_df", "Its degrees of freedom.", of(lambda found: found.paired_t, lambda test: test.df)),
        Column("t_p", "Its p.", of(lambda found: found.paired_t, lambda test: iterated(test.p))),
        Column(
            "t_p_holm",
            "Its p after Holm's adjustment over all comparisons.",
            lambda found: iterated(found.paired_t_holm),
        ),
        Column(
            "t_dz",
            "Standardised mean difference.",
            of(lambda found: found.paired_t, lambda test: iterated(test.dz)),
        ),
        Column(
            "sign_flip_p",
            "p of the exact sign-flip test of the differences, two-sided.",
            of(lambda found: found.sign_flip, lambda test: test.p),
        ),
        Column("sign_flip_p_holm", "The same after Holm's adjustment.", lambda found: found.sign_flip_holm),
        Column(
            "sign_flip_least_p",
            "Smallest p that the sign-flip test could have given.",
            of(lambda found: found.sign_flip, lambda test: test.floor),
        ),
        Column(
            "higher_first",
            "Participants whose threshold at first is known to be the higher, beyond the levels included.",
            lambda found: found.higher_first,
        ),
        Column(
            "higher_second",
            "Participants whose threshold at second is known to be the higher.",
            lambda found: found.higher_second,
        ),
        Column(
            "sign_p",
            "p of the exact sign test of these two counts, two-sided.",
            lambda found: found.sign_p,
        ),
        Column("sign_p_holm", "The same after Holm's adjustment.", lambda found: found.sign_holm),
    ),
    notes=lambda found: why_no_interval(found.interval, len(found.differences_db)),
)
