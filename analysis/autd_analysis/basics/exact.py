"""Tests of paired differences and paired answers beside the sign-flip and t tests.

Differences are exact fractions, so that ties and zeros are what they are. Every p is two-sided.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from autd_analysis.basics.intervals import CONFIDENCE, Interval

_JZS_SCALE = math.sqrt(2) / 2
_LARGEST_LOG = 300 * math.log(10)


@dataclass(frozen=True)
class Wilcoxon:
    """Result of the exact signed-rank test.

    Attributes
    ----------
    statistic
        Sum of the ranks of the positive differences; tied sizes share their mean rank.
    p
        Two-sided p.
    floor
        The smallest p that these sizes could have given.
    nonzero
        Number of differences that are not zero; zeros are left out before ranking.
    """

    statistic: float
    p: float
    floor: float
    nonzero: int


def wilcoxon_test(differences: Sequence[Fraction]) -> Wilcoxon | None:
    """Test exactly whether paired differences are symmetric about zero, by their ranks.

    All 2**n sign patterns of the (mid-)ranks are counted, so that ties are exact. Zeros are left out, as
    Wilcoxon did.

    Parameters
    ----------
    differences
        One difference per participant.

    Returns
    -------
    Wilcoxon | None
        None with fewer than two differences, or if all are zero.

    Notes
    -----
    F. Wilcoxon (1945), Biometrics Bull. 1, 80-83.
    """
    kept = [difference for difference in differences if difference != 0]
    if len(differences) < 2 or not kept:
        return None
    ranks = _double_ranks([abs(difference) for difference in kept])
    ways = Counter({0: 1})
    for rank in ranks:
        ways = Counter(ways) + Counter({total + rank: count for total, count in ways.items()})
    positive = sum(rank for rank, difference in zip(ranks, kept, strict=True) if difference > 0)
    middle = Fraction(sum(ranks), 2)
    far = abs(positive - middle)
    patterns = 2 ** len(kept)
    as_extreme = sum(count for total, count in ways.items() if abs(total - middle) >= far)
    return Wilcoxon(positive / 2, as_extreme / patterns, min(1.0, 2 / patterns), len(kept))


def dz_interval(t: float, n: int) -> Interval:
    """Return the 95 % interval of the standardised mean difference by the noncentral t distribution.

    Parameters
    ----------
    t
        Statistic of the paired t test.
    n
        Number of participants.

    Notes
    -----
    G. Cumming and S. Finch (2001), Educ. Psychol. Meas. 61, 532-574.
    """
    from scipy.special import nctdtrinc

    tail, root = (1 - CONFIDENCE) / 2, math.sqrt(n)
    return Interval(
        float(nctdtrinc(n - 1, 1 - tail, t)) / root,
        float(nctdtrinc(n - 1, tail, t)) / root,
    )


def bayes_factor(t: float, n: int, scale: float = _JZS_SCALE) -> float:
    """Return the Bayes factor for a difference against none, of a paired t test; at most 1e300.

    The effect size has a Cauchy prior (the JZS Bayes factor).

    Parameters
    ----------
    t
        Statistic of the paired t test.
    n
        Number of participants.
    scale
        Scale of the Cauchy prior, 0.707 by default.

    Notes
    -----
    J. N. Rouder et al. (2009), Psychon. Bull. Rev. 16, 225-237, equation 1 with the scale in it.
    """
    import numpy as np

    df = n - 1
    log_g = np.arange(-15.0, 90.0, 0.01)  # everything beyond is negligible, for any t that a float holds
    log_spread = np.log1p(n * scale**2 * np.exp(log_g))
    log_ratio = np.log1p(t * t / df) - np.log1p(t * t / df * np.exp(-log_spread))
    log_prior = -0.5 * math.log(2 * math.pi) - 0.5 * log_g - 0.5 * np.exp(-log_g)
    log_density = (df + 1) / 2 * log_ratio - 0.5 * log_spread + log_prior
    largest = float(log_density.max())
    log_factor = largest + math.log(0.01 * float(np.exp(log_density - largest).sum()))
    return math.exp(min(log_factor, _LARGEST_LOG))


def _double_ranks(sizes: Sequence[Fraction]) -> list[int]:
    """Return twice the mid-ranks, which are whole numbers."""
    ordered = sorted(sizes)
    first = {size: ordered.index(size) for size in set(sizes)}
    count = Counter(sizes)
    return [2 * first[size] + count[size] + 1 for size in sizes]
