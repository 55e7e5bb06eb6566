"""Tests that pool answers over participants: to see how far they are off, never to decide by.

They take all answers in a condition, or all differences between people, for alike. People differ in how
much a condition matters to them, and then such tests find effects where there are none: with a standard
deviation of 0.8 logits about one in ten at the 5 % level, in a study of eight.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval, wald_interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Condition
from autd_analysis.rates.numbers import ParticipantRate
from autd_trials.protocol.schema import Level

Array = NDArray[np.float64]

Stratum = tuple[tuple[int, int], tuple[int, int]]
"""Felt and trials at the first level, and at the second."""


@dataclass(frozen=True)
class PooledTests:
    """The pooled tests of one comparison, two-sided.

    Attributes
    ----------
    contrast
        What was compared, and where.
    felt_first, n_first, felt_second, n_second
        Counts over all participants who have trials at both levels.
    chi_squared_p, fisher_p
        Of the table of all answers, the former without continuity correction; None without answers of both
        kinds.
    cmh_p, cmh_exact_p
        Cochran-Mantel-Haenszel test over participants, asymptotic without continuity correction, and exact.
    odds_ratio, odds_ratio_interval
        Common odds ratio of Mantel and Haenszel with the interval of Robins, Breslow and Greenland.
    mcnemar_p, mcnemar_mid_p
        McNemar's test, exact and mid-p; only where everybody has a single answer at each level.
    """

    contrast: Contrast
    felt_first: int
    n_first: int
    felt_second: int
    n_second: int
    chi_squared_p: float | None
    fisher_p: float | None
    cmh_p: float | None
    cmh_exact_p: float | None
    odds_ratio: float | None
    odds_ratio_interval: Interval | None
    mcnemar_p: float | None
    mcnemar_mid_p: float | None


def pooled_tests(rates: Sequence[ParticipantRate], contrasts: Sequence[Contrast]) -> tuple[PooledTests, ...]:
    """Return the pooled tests of the planned contrasts.

    Parameters
    ----------
    rates
        Rates in the single cells.
    contrasts
        The planned contrasts.

    Returns
    -------
    tuple of PooledTests
        In the order of the contrasts.
    """
    return tuple(_pooled(contrast, _strata(rates, contrast)) for contrast in contrasts)


def chi_squared_p(table: Stratum) -> float | None:
    """Return p of Pearson's test of two proportions; None if all answers are the same or a side is empty."""
    from scipy.special import chdtrc

    (a, n), (b, m) = table
    felt, trials = a + b, n + m
    if min(n, m) == 0 or felt in (0, trials):
        return None
    statistic = trials * (a * (m - b) - b * (n - a)) ** 2 / (n * m * felt * (trials - felt))
    return float(chdtrc(1, statistic))


def cmh_p(strata: Sequence[Stratum]) -> float | None:
    """Return p of the Cochran-Mantel-Haenszel test; None if no stratum is informative.

    W. G. Cochran (1954), Biometrics 10, 417-451; N. Mantel and W. Haenszel (1959), J. Natl. Cancer Inst. 22,
    719-748.
    """
    from scipy.special import chdtrc

    excess = variance = 0.0
    for (a, n), (b, m) in strata:
        felt, trials = a + b, n + m
        if trials > 1:
            excess += a - n * felt / trials
            variance += n * m * felt * (trials - felt) / (trials**2 * (trials - 1))
    return float(chdtrc(1, excess**2 / variance)) if variance > 0 else None


def cmh_exact_p(strata: Sequence[Stratum]) -> float | None:
    """Return the exact conditional p of no common odds ratio but 1; None if no stratum is informative.

    The sum of the strata's hypergeometric counts; outcomes at most as likely as the observed one count.
    """
    informative = [
        (first, second) for first, second in strata if 0 < first[0] + second[0] < first[1] + second[1]
    ]
    informative = [(first, second) for first, second in informative if min(first[1], second[1]) > 0]
    if not informative:
        return None
    parts = [_hypergeometric(n, m, a + b) for (a, n), (b, m) in informative]
    chances = reduce(np.convolve, parts)
    observed = chances[sum(first[0] for first, _ in informative)]
    return min(1.0, float(chances[chances <= observed * (1 + 1e-7)].sum()))


def common_odds_ratio(strata: Sequence[Stratum]) -> tuple[float | None, Interval | None]:
    """Return the odds ratio and its interval; None where it is 0, infinite or 0 / 0.

    J. Robins, N. Breslow and S. Greenland (1986), Biometrics 42, 311-323.
    """
    agree = disagree = agree_alike = mixed = disagree_alike = 0.0
    for (a, n), (b, m) in strata:
        trials = n + m
        if trials > 1:
            alike, product, other = (a + m - b) / trials, a * (m - b) / trials, b * (n - a) / trials
            agree, disagree = agree + product, disagree + other
            agree_alike += alike * product
            mixed += alike * other + (1 - alike) * product
            disagree_alike += (1 - alike) * other
    if agree == 0 or disagree == 0:
        return None, None
    variance = agree_alike / agree**2 + mixed / (agree * disagree) + disagree_alike / disagree**2
    logs = wald_interval(math.log(agree / disagree), math.sqrt(variance / 2))
    return agree / disagree, Interval(math.exp(logs.low), math.exp(logs.high))


def mcnemar_p(only_first: int, only_second: int) -> tuple[float, float] | None:
    """Return McNemar's exact p and mid-p from the discordant pairs; None without any.

    M. W. Fagerland, S. Lydersen and P. Laake (2013), BMC Med. Res. Methodol. 13, 91.
    """
    from scipy.special import bdtr

    pairs, fewer = only_first + only_second, min(only_first, only_second)
    if pairs == 0:
        return None
    tail, point = float(bdtr(fewer, pairs, 0.5)), math.comb(pairs, fewer) / 2**pairs
    exact = min(1.0, 2 * tail)
    mid = exact - point if only_first != only_second else 1 - point
    return exact, mid


def _pooled(contrast: Contrast, strata: Sequence[Stratum]) -> PooledTests:
    total = tuple(
        tuple(sum(stratum[side][which] for stratum in strata) for which in (0, 1)) for side in (0, 1)
    )
    (a, n), (b, m) = total
    odds_ratio, interval = common_odds_ratio(strata)
    discordant = _discordant(strata)
    mcnemar = mcnemar_p(*discordant) if discordant else None
    return PooledTests(
        contrast=contrast,
        felt_first=a,
        n_first=n,
        felt_second=b,
        n_second=m,
        chi_squared_p=chi_squared_p(((a, n), (b, m))),
        fisher_p=cmh_exact_p([((a, n), (b, m))]),
        cmh_p=cmh_p(strata),
        cmh_exact_p=cmh_exact_p(strata),
        odds_ratio=odds_ratio,
        odds_ratio_interval=interval,
        mcnemar_p=mcnemar[0] if mcnemar else None,
        mcnemar_mid_p=mcnemar[1] if mcnemar else None,
    )


def _hypergeometric(n: int, m: int, felt: int) -> Array:
    """Return the chances that 0 to n of so many felt answers lie among the n, and not among the m."""
    from scipy.special import gammaln

    counts = np.arange(n + 1)
    others = felt - counts
    possible = (others >= 0) & (others <= m)
    counts, others = counts[possible], others[possible]

    def log_ways(of: int, take: NDArray[np.int64]) -> Array:
        ways: Array = gammaln(of + 1) - gammaln(take + 1) - gammaln(of - take + 1)
        return ways

    chances = np.zeros(n + 1)
    chances[possible] = np.exp(log_ways(n, counts) + log_ways(m, others) - log_ways(n + m, np.array(felt)))
    return chances


def _discordant(strata: Sequence[Stratum]) -> tuple[int, int] | None:
    """Return how many felt only the first, and only the second; None unless all have one answer at each."""
    if not strata or any(n != 1 or m != 1 for (_, n), (_, m) in strata):
        return None
    return sum(a > b for (a, _), (b, _) in strata), sum(a < b for (a, _), (b, _) in strata)


def _strata(rates: Sequence[ParticipantRate], contrast: Contrast) -> list[Stratum]:
    """Return the counts at both levels for every participant and level of the factors not compared."""
    counts: dict[tuple[str, Condition], dict[Level, tuple[int, int]]] = {}
    for rate in rates:
        level = dict(rate.condition).get(contrast.factor)
        if level in contrast.levels and contrast.takes(rate.condition) and rate.n > 0:
            others = tuple(pair for pair in rate.condition if pair[0] != contrast.factor)
            counts.setdefault((rate.participant, others), {})[level] = (rate.felt, rate.n)
    return [(sides[contrast.first], sides[contrast.second]) for sides in counts.values() if len(sides) == 2]
