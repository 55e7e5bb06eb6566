"""95 % intervals: of one proportion, of a difference of two, and of a mean over participants."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

CONFIDENCE = 0.95
"""Coverage aimed at by every interval of the analysis."""


@dataclass(frozen=True)
class Interval:
    """A confidence interval, ends included."""

    low: float
    high: float


def wilson_interval(successes: int, n: int) -> Interval | None:
    """Return Wilson's score interval for a proportion, without continuity correction.

    It treats the `n` trials as independent and equally likely to succeed, so it is meant for one participant
    in one condition, not for trials pooled over people.

    Parameters
    ----------
    successes
        Number of successes, 0..n.
    n
        Number of trials.

    Returns
    -------
    Interval or None
        The interval, within 0..1; None without trials.

    Raises
    ------
    ValueError
        `successes` does not lie in 0..n.

    Notes
    -----
    E. B. Wilson (1927), J. Am. Stat. Assoc. 22, 209-212.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes in {n} trials")
    if n == 0:
        return None
    z = statistics.NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    centre = (successes + z * z / 2) / (n + z * z)
    half_width = z / (n + z * z) * math.sqrt(successes * (n - successes) / n + z * z / 4)
    # At 0/n and n/n the formula's end is exactly 0 or 1; rounding must not move it.
    low = 0.0 if successes == 0 else centre - half_width
    high = 1.0 if successes == n else centre + half_width
    return Interval(low, high)


def clopper_pearson_interval(successes: int, n: int) -> Interval | None:
    """Return the exact interval for a proportion: it covers at least 95 % of the time, often more.

    Parameters and None as in `wilson_interval`.

    Notes
    -----
    C. J. Clopper and E. S. Pearson (1934), Biometrika 26, 404-413.
    """
    from scipy.special import betaincinv

    if n == 0:
        return None
    tail = (1 - CONFIDENCE) / 2
    low = 0.0 if successes == 0 else float(betaincinv(successes, n - successes + 1, tail))
    high = 1.0 if successes == n else float(betaincinv(successes + 1, n - successes, 1 - tail))
    return Interval(low, high)


def jeffreys_interval(successes: int, n: int) -> Interval | None:
    """Return the Bayesian interval for a proportion with Jeffreys' prior, with equal tails.

    Where none or all succeeded the end next to them is 0 or 1 (the rule of Brown, Cai and DasGupta: otherwise
    the interval would never contain 0 or 1). Parameters and None as in `wilson_interval`.

    Notes
    -----
    L. D. Brown, T. T. Cai and A. DasGupta (2001), Stat. Sci. 16, 101-133, section 4.1.3.
    """
    from scipy.special import betaincinv

    if n == 0:
        return None
    tail = (1 - CONFIDENCE) / 2
    a, b = successes + 0.5, n - successes + 0.5
    low = 0.0 if successes == 0 else float(betaincinv(a, b, tail))
    high = 1.0 if successes == n else float(betaincinv(a, b, 1 - tail))
    return Interval(low, high)


def newcombe_interval(first: tuple[int, int], second: tuple[int, int]) -> Interval | None:
    """Return Newcombe's interval for the difference of two independent proportions, first minus second.

    Like Wilson's, from which it is made, it is meant for one participant's trials.

    Parameters
    ----------
    first, second
        Successes and number of trials of each.

    Returns
    -------
    Interval or None
        Within -1..1; None if one of them has no trials.

    Notes
    -----
    R. G. Newcombe (1998), Stat. Med. 17, 873-890, method 10.
    """
    one, other = wilson_interval(*first), wilson_interval(*second)
    if one is None or other is None:
        return None
    p, q = first[0] / first[1], second[0] / second[1]
    return Interval(
        p - q - math.hypot(p - one.low, other.high - q), p - q + math.hypot(one.high - p, q - other.low)
    )


def t_interval(values: Sequence[float], *, bounds: tuple[float, float] | None = None) -> Interval | None:
    """Return Student's t interval for the mean of independent values.

    Parameters
    ----------
    values
        One value per participant.
    bounds
        The smallest and the largest possible mean (0 and 1 for rates); an end beyond them is moved to them,
        which loses no coverage.

    Returns
    -------
    Interval or None
        None where no interval can be given: fewer than two values, or all values equal (an interval of no
        width would claim a certainty that nobody has).
    """
    if len(values) < 2 or min(values) == max(values):
        return None
    mean = statistics.fmean(values)
    half_width = t_quantile(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values))
    low, high = mean - half_width, mean + half_width
    if bounds is not None:
        low, high = max(low, bounds[0]), min(high, bounds[1])
    return Interval(low, high)


def wald_interval(estimate: float, standard_error: float) -> Interval:
    """Return the interval of an estimate that is normally distributed, as in large samples."""
    half_width = statistics.NormalDist().inv_cdf((1 + CONFIDENCE) / 2) * standard_error
    return Interval(estimate - half_width, estimate + half_width)


def t_quantile(df: float) -> float:
    """Return the two-sided 95 % point of Student's t with `df` degrees of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(df, (1 + CONFIDENCE) / 2))
