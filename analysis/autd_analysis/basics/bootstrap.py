"""The participant bootstrap of a mean, exactly: every resample counts, none is drawn.

A resample of n participants with replacement has as its sum that of n independent draws from the observed
values. Its distribution over all n**n resamples is counted over the attainable sums, so that there is neither
a number of resamples to choose nor a seed.
"""

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction

from autd_analysis.basics.intervals import CONFIDENCE, Interval
from autd_analysis.basics.paired import LARGEST_SUPPORT, as_integers


def bootstrap_interval(values: Sequence[Fraction]) -> Interval | None:
    """Return the percentile interval of the mean over participants.

    With few participants it is narrower than it should be (it lacks the factor of about sqrt(n / (n - 1)) and
    the heavier tails of Student's t), so it goes beside the t interval, not in its place.

    Parameters
    ----------
    values
        One exact value per participant.

    Returns
    -------
    Interval or None
        None with fewer than two values, if all are equal, or if their sums take too many distinct values.

    Notes
    -----
    B. Efron (1979), Ann. Stat. 7, 1-26; exhaustive resampling: N. I. Fisher and P. Hall (1991), J. Stat.
    Plan. Inference 27, 157-169.
    """
    if len(values) < 2 or len(set(values)) == 1:
        return None
    numbers, denominator = as_integers(values)
    ways = _sums_of_resamples(numbers)
    if ways is None:
        return None
    resamples, scale = len(values) ** len(values), len(values) * denominator
    tail = Fraction(str(CONFIDENCE))
    low = _quantile(ways, resamples * (1 - tail) / 2)
    high = _quantile(ways, resamples * (1 + tail) / 2)
    return Interval(low / scale, high / scale)


def _sums_of_resamples(numbers: Sequence[int]) -> Counter[int] | None:
    """Return how many of the resamples have each sum."""
    draws = Counter(numbers)
    ways = Counter({0: 1})
    for _ in numbers:
        if len(ways) * len(draws) > LARGEST_SUPPORT:
            return None
        longer: Counter[int] = Counter()
        for total, count in ways.items():
            for number, times in draws.items():
                longer[total + number] += count * times
        ways = longer
    return ways


def _quantile(ways: Counter[int], rank: Fraction) -> int:
    """Return the least sum that at least `rank` resamples do not exceed."""
    seen = 0
    for total in sorted(ways):
        seen += ways[total]
        if seen >= rank:
            return total
    raise AssertionError("a rank beyond the number of resamples")
