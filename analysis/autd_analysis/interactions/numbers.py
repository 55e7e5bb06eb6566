"""Does a difference depend on the other factor? Interaction and trend of the planned comparisons.

Both work on participants' differences of rates at the levels of the other factor, so that what people
differ in is in their error. They are not planned tests: their p are not adjusted.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval, t_interval
from autd_analysis.basics.paired import PairedT, SignFlip, as_integers, paired_t_test, sign_flip_test
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.data.contrasts import Contrast, contrast_families
from autd_trials.protocol.schema import Level

MOST_FLIPPED = 18
"""Most participants for whom all sign patterns of their contrasts are gone through."""

TREND_INTERVAL = "95 % t interval over participants' slopes"

_OCTAVE_DIGITS = 6
_NO_SPREAD = 1e-12

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Interaction:
    """Whether a difference is the same at all levels of another factor.

    Attributes
    ----------
    contrast, over
        What was compared, and over the levels of which factor.
    participants
        Number of participants with the difference at every level.
    t2, f, df, f_p
        Hotelling's T squared of the differences' contrasts, its F with degrees of freedom, and p; None where
        there are too few participants or the contrasts are collinear.
    sign_flip_p, sign_flip_floor
        Exact p of flipping each participant's contrasts, and the smallest that there could have been.
    """

    contrast: Contrast
    over: str
    participants: int
    t2: float | None
    f: float | None
    df: tuple[int, int] | None
    f_p: float | None
    sign_flip_p: float | None
    sign_flip_floor: float | None


@dataclass(frozen=True)
class Trend:
    """How a difference changes with a numeric factor: the mean of participants' slopes.

    Attributes
    ----------
    contrast, over
        What was compared, and along which factor.
    unit
        What the slope is per: octave where all levels are positive, else unit of the factor.
    participants, mean, interval, paired_t, sign_flip
        The slopes' number, mean, t interval over participants, and tests against zero.
    """

    contrast: Contrast
    over: str
    unit: str
    participants: int
    mean: float | None
    interval: Interval | None
    paired_t: PairedT | None
    sign_flip: SignFlip | None


@dataclass(frozen=True)
class Interactions:
    """Interactions of all comparisons made at several levels, and their trends over three or more numbers."""

    interactions: tuple[Interaction, ...]
    trends: tuple[Trend, ...]


def dependence_on_other_factor(comparisons: Sequence[ComparisonResult]) -> Interactions:
    """Return interactions and trends of the planned comparisons."""
    return Interactions(interactions(comparisons), trends(comparisons))


def interactions(comparisons: Sequence[ComparisonResult]) -> tuple[Interaction, ...]:
    """Test the interaction of every comparison that was made at several levels."""
    return tuple(_interaction(family) for family in _families(comparisons))


def trends(comparisons: Sequence[ComparisonResult]) -> tuple[Trend, ...]:
    """Return the trend of every comparison that was made at three or more numeric levels."""
    return tuple(
        _trend(family)
        for family in _families(comparisons)
        if len(family) > 2 and all(isinstance(_level(result), float) for result in family)
    )


def _families(comparisons: Sequence[ComparisonResult]) -> list[list[ComparisonResult]]:
    """Return the comparisons of the same levels at several levels of one other factor."""
    by_contrast = {result.contrast: result for result in comparisons}
    return [[by_contrast[each] for each in family] for family in contrast_families(by_contrast)]


def _interaction(family: Sequence[ComparisonResult]) -> Interaction:
    differences = _complete(family)
    numbers, denominator = as_integers([each for row in differences for each in row])
    table = np.array(numbers, dtype=float).reshape(len(differences), len(family))
    contrasts = (table[:, 1:] - table[:, :1]) / denominator
    t2, f, df, f_p = _hotelling(contrasts)
    floor, flipped = _flip(table)
    return Interaction(
        contrast=family[0].contrast.overall,
        over=_over(family),
        participants=len(differences),
        t2=t2,
        f=f,
        df=df,
        f_p=f_p,
        sign_flip_p=flipped,
        sign_flip_floor=floor,
    )


def _hotelling(
    contrasts: Array,
) -> tuple[float | None, float | None, tuple[int, int] | None, float | None]:
    """Return T squared, F, its degrees of freedom, and p.

    H. Hotelling (1931), Ann. Math. Stat. 2, 360-378.
    """
    from scipy.special import fdtrc

    n, width = contrasts.shape
    if n <= width:
        return None, None, None, None
    covariance = np.cov(contrasts, rowvar=False).reshape(width, width)
    # Rates are counts: what varies at all varies by more than this.
    if np.linalg.matrix_rank(covariance, tol=_NO_SPREAD, hermitian=True) < width:
        return None, None, None, None
    mean = contrasts.mean(axis=0)
    t2 = float(n * mean @ np.linalg.solve(covariance, mean))
    df = (width, n - width)
    f = t2 * df[1] / (width * (n - 1))
    return t2, f, df, float(fdtrc(*df, f))


def _flip(differences: Array) -> tuple[float | None, float | None]:
    """Return the least p possible and the exact p of the squared length of the contrasts' sum.

    The differences are whole numbers, so that equal sums are equal. The length is that of the differences
    about their mean over the levels, so that no level is special. One participant's signs may stay, as
    turning all of them changes nothing.
    """
    levels = differences.shape[1]
    centred = levels * differences - differences.sum(axis=1, keepdims=True)
    nonzero = centred[np.abs(centred).max(axis=1, initial=0) > 0]
    if len(differences) < 2 or len(nonzero) > MOST_FLIPPED:
        return None, None
    if len(nonzero) == 0:
        return 1.0, 1.0
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=len(nonzero) - 1)))
    sums = np.column_stack([np.ones(len(signs)), signs]) @ nonzero
    lengths = (sums**2).sum(axis=1)
    as_extreme = int((lengths >= lengths[0]).sum())
    return min(1.0, 2 / 2 ** len(nonzero)), as_extreme / len(signs)


def _trend(family: Sequence[ComparisonResult]) -> Trend:
    levels = [level for result in family if isinstance(level := _level(result), float)]
    octaves = min(levels) > 0
    scores = [_rational(math.log2(level)) if octaves else Fraction(str(level)) for level in levels]
    centre = sum(scores, Fraction(0)) / len(scores)
    weights = [score - centre for score in scores]
    norm = sum((weight**2 for weight in weights), Fraction(0))
    slopes = [
        sum((weight * each for weight, each in zip(weights, row, strict=True)), Fraction(0)) / norm
        for row in _complete(family)
    ]
    return Trend(
        contrast=family[0].contrast.overall,
        over=_over(family),
        unit="octave" if octaves else "unit",
        participants=len(slopes),
        mean=float(sum(slopes) / len(slopes)) if slopes else None,
        interval=t_interval([float(slope) for slope in slopes]),
        paired_t=paired_t_test(slopes),
        sign_flip=sign_flip_test(slopes),
    )


def _complete(family: Sequence[ComparisonResult]) -> list[list[Fraction]]:
    """Return the differences at every level, of the participants who have all of them."""
    columns = [{each.participant: each.value for each in result.differences} for result in family]
    return [
        [column[participant] for column in columns]
        for participant in columns[0]
        if all(participant in column for column in columns)
    ]


def _over(family: Sequence[ComparisonResult]) -> str:
    return family[0].contrast.at[0][0]


def _level(result: ComparisonResult) -> Level:
    return result.contrast.at[0][1]


def _rational(value: float) -> Fraction:
    """Return the value to six decimals, exactly, so that equal slopes stay equal."""
    return Fraction(round(value * 10**_OCTAVE_DIGITS), 10**_OCTAVE_DIGITS)
