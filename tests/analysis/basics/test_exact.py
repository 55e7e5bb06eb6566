"""Wilcoxon's test, intervals of dz and Bayes factors against scipy, R's coin and published numbers."""

from fractions import Fraction

import numpy as np
import pytest
from autd_analysis.basics.exact import bayes_factor, dz_interval, wilcoxon_test
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats


def tenths(*counts: int) -> list[Fraction]:
    return [Fraction(count, 10) for count in counts]


def test_with_ties_it_is_that_of_coin() -> None:
    """R 4.2.2, coin 1.4-2: wilcoxsign_test(..., distribution = "exact", zero.method = "Wilcoxon")."""
    result = wilcoxon_test(tenths(3, 1, -1, 4, 5, 2, 7, 6))
    assert result is not None
    assert result.p == pytest.approx(0.0234375, abs=1e-12)
    assert result.floor == 2 / 2**8


@given(st.lists(st.integers(-50, 50), min_size=2, max_size=10, unique_by=abs).filter(lambda d: 0 not in d))
def test_without_ties_it_is_that_of_scipy(counts: list[int]) -> None:
    result = wilcoxon_test(tenths(*counts))
    expected = stats.wilcoxon(counts, method="exact")
    assert result is not None
    assert result.p == pytest.approx(expected.pvalue)
    assert min(result.statistic, sum(range(1, len(counts) + 1)) - result.statistic) == expected.statistic


@given(st.lists(st.integers(-4, 4), min_size=2, max_size=9))
def test_with_ties_and_zeros_it_counts_all_sign_patterns(counts: list[int]) -> None:
    result = wilcoxon_test(tenths(*counts))
    kept = np.array([count for count in counts if count])
    if len(kept) == 0:
        assert result is None
        return
    ranks = stats.rankdata(np.abs(kept))
    signs = np.array(np.meshgrid(*[[-1, 1]] * len(kept))).reshape(len(kept), -1)
    sums = ranks @ signs
    assert result is not None
    assert result.p == pytest.approx((np.abs(sums) >= abs(ranks @ np.sign(kept)) - 1e-9).mean())
    assert result.nonzero == len(kept)
    assert result.p >= result.floor - 1e-12


def test_what_cannot_be_tested() -> None:
    assert wilcoxon_test([]) is None
    assert wilcoxon_test(tenths(3)) is None
    assert wilcoxon_test(tenths(0, 0, 0)) is None


@given(t=st.floats(-8, 8), n=st.integers(3, 40))
def test_the_ends_of_the_interval_leave_two_and_a_half_percent(t: float, n: int) -> None:
    interval = dz_interval(t, n)
    assert stats.nct.sf(t, n - 1, interval.low * np.sqrt(n)) == pytest.approx(0.025, abs=1e-4)
    assert stats.nct.cdf(t, n - 1, interval.high * np.sqrt(n)) == pytest.approx(0.025, abs=1e-4)


def test_the_bayes_factor_is_the_published_one() -> None:
    """Rouder et al. (2009): t(79) = 2.03 gives 1.56 in favour of no difference, scale 1."""
    assert 1 / bayes_factor(2.03, 80, scale=1.0) == pytest.approx(1.56, abs=0.005)


@pytest.mark.parametrize(("t", "n"), [(0.0, 8), (2.0, 8), (4.17, 8), (-3.0, 20)])
def test_the_bayes_factor_is_the_ratio_of_marginal_likelihoods(t: float, n: int) -> None:
    effects = np.linspace(-30, 30, 120_001)
    prior = stats.cauchy.pdf(effects, scale=np.sqrt(0.5))
    marginal = np.trapezoid(stats.nct.pdf(t, n - 1, effects * np.sqrt(n)) * prior, effects)
    assert bayes_factor(t, n) == pytest.approx(marginal / stats.t.pdf(t, n - 1), rel=2e-3)


@pytest.mark.parametrize(("t", "n"), [(4.0, 500), (8.0, 500), (20.0, 1000)])
def test_the_bayes_factor_of_many_people_is_quadpacks(t: float, n: int) -> None:
    """Rouder et al. (2009), equation 1 with r = sqrt(1/2), in pieces so short that no peak is missed."""

    def density(log_g: float) -> float:
        spread = 1 + n * 0.5 * np.exp(log_g)
        kernel = ((1 + t * t / (spread * (n - 1))) / (1 + t * t / (n - 1))) ** (-n / 2)
        return float(
            kernel * spread**-0.5 * stats.invgamma.pdf(np.exp(log_g), 0.5, scale=0.5) * np.exp(log_g)
        )

    expected = sum(integrate.quad(density, low, low + 1)[0] for low in range(-8, 60))
    assert bayes_factor(t, n) == pytest.approx(expected, rel=1e-6)


def test_the_bayes_factor_ends_where_floats_do() -> None:
    assert bayes_factor(1e9, 200) == pytest.approx(1e300)
