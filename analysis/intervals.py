"""95 % intervals: Wilson's for one proportion, Student's t for a mean over participants."""

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


def t_quantile(df: int) -> float:
    """Return the two-sided 95 % point of Student's t with `df` degrees of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(df, (1 + CONFIDENCE) / 2))
