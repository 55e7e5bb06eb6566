"""The planned comparisons of thresholds, within participants and in dB.

Where a threshold lies beyond the levels its difference from another is not known, but which is higher often
is: the sign test counts that.
"""

import dataclasses
import math
import statistics
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from autd_analysis.basics.adjustment import holm
from autd_analysis.basics.intervals import Interval, t_interval
from autd_analysis.basics.paired import PairedT, SignFlip, paired_t_test, sign_flip_test
from autd_analysis.data.contrasts import Contrast, planned_contrasts
from autd_analysis.data.design import Design
from autd_analysis.data.trials import Trials
from autd_analysis.thresholds.numbers import (
    GroupThreshold,
    Threshold,
    common_sign,
    over_participants,
    thresholds,
)
from autd_trials.protocol.method import Method
from autd_trials.protocol.schema import Level

DIFFERENCE_INTERVAL = "95 % t interval over participants' differences in dB"

_MICRO, _CENTI = 1_000_000, 100


@dataclass(frozen=True)
class ThresholdComparison:
    """A planned comparison of thresholds.

    Attributes
    ----------
    contrast
        What is compared, and where.
    differences_db
        Participants' differences in dB, first minus second.
    mean_db, interval, paired_t, sign_flip
        Their mean, its t interval, and two-sided tests.
    undetermined
        Number of participants who lack one of the two thresholds.
    higher_first, higher_second, sign_p
        At how many participants which threshold is known to be higher, those beyond the levels included, and
        the exact sign test of that.
    paired_t_holm, sign_flip_holm, sign_holm
        The p after Holm's adjustment over all comparisons.
    """

    contrast: Contrast
    differences_db: tuple[tuple[str, float], ...]
    mean_db: float | None
    interval: Interval | None
    paired_t: PairedT | None
    sign_flip: SignFlip | None
    undetermined: int
    higher_first: int
    higher_second: int
    sign_p: float | None
    paired_t_holm: float | None = None
    sign_flip_holm: float | None = None
    sign_holm: float | None = None


@dataclass(frozen=True)
class Thresholds:
    """Thresholds of each participant and over participants in every condition, and compared.

    Attributes
    ----------
    method
        How levels were chosen and thresholds are estimated.
    participants, conditions, comparisons
        The thresholds.
    """

    method: Method
    participants: tuple[Threshold, ...]
    conditions: tuple[GroupThreshold, ...]
    comparisons: tuple[ThresholdComparison, ...]


def all_thresholds(trials: Trials, method: Method) -> Thresholds:
    """Return the thresholds of a study, over participants and compared."""
    found = thresholds(trials, method)
    return Thresholds(method, found, over_participants(found), compared_thresholds(found, trials.design))


def compared_thresholds(found: Sequence[Threshold], design: Design) -> tuple[ThresholdComparison, ...]:
    """Return the planned comparisons of thresholds, adjusted by Holm's method over all of them."""
    results = [_compare(found, contrast) for contrast in planned_contrasts(design)]
    t = holm([result.paired_t.p if result.paired_t else None for result in results])
    flip = holm([result.sign_flip.p if result.sign_flip else None for result in results])
    sign = holm([result.sign_p for result in results])
    return tuple(
        dataclasses.replace(result, paired_t_holm=t_p, sign_flip_holm=flip_p, sign_holm=sign_p)
        for result, t_p, flip_p, sign_p in zip(results, t, flip, sign, strict=True)
    )


def _compare(found: Sequence[Threshold], contrast: Contrast) -> ThresholdComparison:
    sides = [_means_db(found, contrast, level) for level in contrast.levels]
    differences = [
        (participant, sides[0][participant] - sides[1][participant])
        for participant in sides[0]
        if participant in sides[1]
    ]
    values = [_rounded(difference, _MICRO) for _, difference in differences]
    coarse = [_rounded(difference, _CENTI) for _, difference in differences]  # sums that can be counted
    higher = _higher(found, contrast)
    return ThresholdComparison(
        contrast=contrast,
        differences_db=tuple(differences),
        mean_db=float(statistics.mean(values)) if values else None,
        interval=t_interval([float(value) for value in values]),
        paired_t=paired_t_test(values),
        sign_flip=sign_flip_test(coarse),
        undetermined=len({each.participant for each in found}) - len(values),
        higher_first=higher.count(1),
        higher_second=higher.count(-1),
        sign_p=_sign_test(higher.count(1), higher.count(-1)),
    )


def _means_db(found: Sequence[Threshold], contrast: Contrast, level: Level) -> dict[str, float]:
    """Return participants' mean thresholds in dB on one side of a contrast; who lacks one is missing."""
    cells: defaultdict[str, list[float | None]] = defaultdict(list)
    for each in found:
        if contrast.side(level) <= set(each.condition):
            cells[each.participant].append(each.db)
    told = {participant: [db for db in values if db is not None] for participant, values in cells.items()}
    return {
        participant: statistics.fmean(values)
        for participant, values in told.items()
        if len(values) == len(cells[participant])
    }


def _rounded(value: float, parts: int) -> Fraction:
    return Fraction(round(value * parts), parts)


def _higher(found: Sequence[Threshold], contrast: Contrast) -> list[int]:
    """Return for each participant 1 where the first threshold is higher, -1 where the second is.

    0 where they are equal, not known, or mixed over the cells of factors that are not compared.
    """
    cells: defaultdict[tuple[str, frozenset[tuple[str, Level]]], dict[Level, float]] = defaultdict(dict)
    for each in found:
        level = dict(each.condition).get(contrast.factor)
        if level in contrast.levels and contrast.takes(each.condition):
            others = frozenset(pair for pair in each.condition if pair[0] != contrast.factor)
            place = each.db if each.db is not None else each.beyond * math.inf
            cells[each.participant, others][level] = place
    signs: defaultdict[str, list[int]] = defaultdict(list)
    for (participant, _), sides in cells.items():
        first, second = (sides.get(level, math.nan) for level in contrast.levels)
        signs[participant].append((first > second) - (first < second))
    return [common_sign(of_cells) for of_cells in signs.values()]


def _sign_test(higher: int, lower: int) -> float | None:
    """Return the exact two-sided p; None with fewer than two participants."""
    from scipy.special import bdtr

    if higher + lower < 2:
        return None
    return min(1.0, 2 * float(bdtr(min(higher, lower), higher + lower, 0.5)))
