"""Tests of paired differences, one difference per participant.

Differences are exact fractions (of rates k/n), so that ties and zeros are what they are and not what
rounding makes of them.
"""

import math
import statistics
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

LARGEST_SUPPORT = 1_000_000
"""Most distinct sums of signed differences that the exact sign-flip test keeps track of."""


@dataclass(frozen=True)
class SignFlip:
    """Result of the exact sign-flip test.

    Attributes
    ----------
    p
        Two-sided p.
    floor
        The smallest p that these differences could have given: 2 / 2**nonzero, at most 1.
    nonzero
        Number of differences that are not zero.
    """

    p: float
    floor: float
    nonzero: int


@dataclass(frozen=True)
class PairedT:
    """Result of the paired t test.

    Attributes
    ----------
    t, df, p
        Statistic, degrees of freedom, two-sided p.
    dz
        Standardised mean difference: mean over standard deviation of the differences (Cohen's d_z).
    """

    t: float
    df: int
    p: float
    dz: float


def sign_flip_test(differences: Sequence[Fraction]) -> SignFlip | None:
    """Test exactly whether paired differences are symmetric about zero.

    Under the null hypothesis every difference could as well have had the other sign. p is the share of all
    2**n sign patterns whose sum lies at least as far from zero as the observed one. The patterns are counted
    by dynamic programming over the attainable sums: no sampling, and no enumeration that limits n.

    Parameters
    ----------
    differences
        One difference per participant.

    Returns
    -------
    SignFlip or None
        None where the test says nothing: fewer than two differences; or where the differences take so many
        distinct sums (over `LARGEST_SUPPORT`) that they cannot be counted exactly.

    Notes
    -----
    R. A. Fisher (1935), The Design of Experiments, section 21.
    """
    if len(differences) < 2:
        return None
    sizes, _ = as_integers([difference for difference in differences if difference != 0])
    ways = Counter({0: 1})
    for size in sizes:
        if 2 * len(ways) > LARGEST_SUPPORT:
            return None
        flipped: Counter[int] = Counter()
        for total, count in ways.items():
            flipped[total + size] += count
            flipped[total - size] += count
        ways = flipped
    observed = abs(sum(sizes))
    as_extreme = sum(count for total, count in ways.items() if abs(total) >= observed)
    patterns = 2 ** len(sizes)
    return SignFlip(
        p=float(Fraction(as_extreme, patterns)),
        floor=float(min(Fraction(2, patterns), Fraction(1))),
        nonzero=len(sizes),
    )


def paired_t_test(differences: Sequence[Fraction]) -> PairedT | None:
    """Test by Student's t whether the mean of paired differences is zero.

    Parameters
    ----------
    differences
        One difference per participant.

    Returns
    -------
    PairedT or None
        None where the test is not defined: fewer than two differences, or all of them equal (the usual
        formula would then give t = infinity and p = 0, or 0 / 0).
    """
    if len(differences) < 2 or len(set(differences)) == 1:
        return None
    from scipy.special import stdtr

    n = len(differences)
    dz = float(statistics.mean(differences)) / statistics.stdev([float(d) for d in differences])
    t = dz * math.sqrt(n)
    return PairedT(t=t, df=n - 1, p=2 * float(stdtr(n - 1, -abs(t))), dz=dz)


def as_integers(fractions: Sequence[Fraction]) -> tuple[list[int], int]:
    """Return the fractions' numerators on their least common denominator, and that denominator."""
    denominator = math.lcm(*(fraction.denominator for fraction in fractions))
    return [int(fraction * denominator) for fraction in fractions], denominator
