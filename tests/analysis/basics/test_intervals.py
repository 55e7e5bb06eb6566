"""Intervals against statsmodels, SciPy and published numbers."""

import numpy as np
import pytest
from autd_analysis.basics.intervals import (
    clopper_pearson_interval,
    jeffreys_interval,
    newcombe_interval,
    t_interval,
    t_quantile,
    wilson_interval,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.proportion import confint_proportions_2indep, proportion_confint


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
@settings(max_examples=200, deadline=None)
def test_wilson_equals_statsmodels(counts: tuple[int, int]) -> None:
    successes, n = counts
    interval = wilson_interval(successes, n)
    assert interval is not None
    low, high = proportion_confint(successes, n, method="wilson")
    assert interval.low == pytest.approx(low, abs=1e-12)
    assert interval.high == pytest.approx(high, abs=1e-12)
    assert 0 <= interval.low <= successes / n <= interval.high <= 1


def test_wilson_published_example() -> None:
    # R. G. Newcombe (1998), Stat. Med. 17, 857-872, table I, method 3: 81 of 263, and 0 of 20.
    interval, none_felt = wilson_interval(81, 263), wilson_interval(0, 20)
    assert interval is not None
    assert none_felt is not None
    assert (interval.low, interval.high) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert (none_felt.low, none_felt.high) == pytest.approx((0, 0.1611), abs=5e-5)


def test_wilson_ends_are_exact_at_none_and_all() -> None:
    for n in range(1, 60):
        none, every = wilson_interval(0, n), wilson_interval(n, n)
        assert none is not None
        assert every is not None
        assert none.low == 0
        assert every.high == 1


def test_wilson_without_trials_or_with_impossible_counts() -> None:
    assert wilson_interval(0, 0) is None
    with pytest.raises(ValueError, match="3 successes in 2 trials"):
        wilson_interval(3, 2)


@given(st.lists(st.integers(-50, 50).map(lambda k: k / 50), min_size=2, max_size=30))
@settings(max_examples=150, deadline=None)
def test_t_interval_equals_scipy(values: list[float]) -> None:
    interval = t_interval(values)
    if len(set(values)) == 1:
        assert interval is None
        return
    assert interval is not None
    low, high = stats.t.interval(0.95, len(values) - 1, loc=np.mean(values), scale=stats.sem(values))
    assert (interval.low, interval.high) == pytest.approx((low, high))


def test_t_interval_keeps_within_bounds() -> None:
    interval = t_interval([1.0, 1.0, 0.9], bounds=(0.0, 1.0))
    assert interval is not None
    assert interval.high == 1
    assert interval.low == pytest.approx(0.9666666667 - 4.302653 * 0.0333333333, abs=1e-6)


def test_no_interval_from_one_value_or_from_equal_values() -> None:
    assert t_interval([]) is None
    assert t_interval([0.4]) is None
    assert t_interval([1.0, 1.0, 1.0]) is None


def test_t_quantile_from_printed_tables() -> None:
    assert t_quantile(7) == pytest.approx(2.365, abs=5e-4)
    assert t_quantile(1) == pytest.approx(12.706, abs=5e-4)


counts = st.integers(1, 200).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(counts)
@settings(max_examples=100, deadline=None)
def test_clopper_pearson_equals_scipy(felt: tuple[int, int]) -> None:
    interval = clopper_pearson_interval(*felt)
    expected = stats.binomtest(*felt).proportion_ci(method="exact")
    assert interval is not None
    assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high), abs=1e-9)


@given(counts)
@settings(max_examples=100, deadline=None)
def test_jeffreys_equals_the_beta_quantiles_but_for_none_and_all(felt: tuple[int, int]) -> None:
    k, n = felt
    interval = jeffreys_interval(k, n)
    low, high = (float(stats.beta.ppf(q, k + 0.5, n - k + 0.5)) for q in (0.025, 0.975))
    assert interval is not None
    assert interval.low == (0 if k == 0 else pytest.approx(low))
    assert interval.high == (1 if k == n else pytest.approx(high))


def test_jeffreys_and_clopper_pearson_published_examples() -> None:
    # Brown, Cai and DasGupta (2001), Stat. Sci. 16, table 5 (n = 7..): Jeffreys at 0 of 7 is [0, .292].
    none = jeffreys_interval(0, 7)
    assert none is not None
    assert (none.low, none.high) == pytest.approx((0, 0.292), abs=6e-4)
    # Newcombe (1998), Stat. Med. 17, 857-872, table I, method 5: 81 of 263.
    exact = clopper_pearson_interval(81, 263)
    assert exact is not None
    assert (exact.low, exact.high) == pytest.approx((0.2527, 0.3676), abs=5e-5)


def test_newcombe_published_examples_and_statsmodels() -> None:
    # R. G. Newcombe (1998), Stat. Med. 17, 873-890, table II, method 10, contrasts (a), (e) and (g).
    examples = {((56, 70), (48, 80)): (0.0524, 0.3339), ((5, 56), (0, 29)): (-0.0381, 0.1926)}
    for (first, second), ends in examples.items():
        interval = newcombe_interval(first, second)
        assert interval is not None
        assert (interval.low, interval.high) == pytest.approx(ends, abs=5e-5)
    for first, second in [((0, 10), (0, 10)), ((10, 10), (0, 10)), ((3, 10), (7, 12))]:
        interval = newcombe_interval(first, second)
        assert interval is not None
        expected = confint_proportions_2indep(*first, *second, method="newcomb", compare="diff")
        assert (interval.low, interval.high) == pytest.approx(expected, abs=1e-9)
    assert newcombe_interval((0, 0), (1, 2)) is None


def test_without_trials_there_is_no_interval() -> None:
    assert clopper_pearson_interval(0, 0) is None
    assert jeffreys_interval(0, 0) is None
