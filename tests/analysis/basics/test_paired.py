"""The paired tests against enumeration, SciPy and statsmodels."""

import itertools
import math
import statistics
from fractions import Fraction

import numpy as np
import pytest
from autd_analysis.basics.paired import paired_t_test, sign_flip_test
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

rates = st.builds(Fraction, st.integers(-10, 10), st.just(10))
odd_fractions = st.fractions(min_value=-1, max_value=1, max_denominator=17)


def enumerated(differences: list[Fraction]) -> tuple[float, float]:
    """p and the smallest p over all sign patterns, by plain enumeration in exact arithmetic."""
    sums = [
        abs(sum((sign * value for sign, value in zip(signs, differences, strict=True)), Fraction(0)))
        for signs in itertools.product((-1, 1), repeat=len(differences))
    ]
    observed = abs(sum(differences, Fraction(0)))
    return (
        sum(total >= observed for total in sums) / len(sums),
        sum(total == max(sums) for total in sums) / len(sums),
    )


@given(st.lists(st.one_of(rates, odd_fractions), min_size=2, max_size=8))
@settings(max_examples=150, deadline=None)
def test_sign_flip_equals_plain_enumeration(differences: list[Fraction]) -> None:
    result = sign_flip_test(differences)
    assert result is not None
    p, floor = enumerated(differences)
    assert result.p == p
    assert result.floor == floor
    assert result.p >= result.floor


def test_sign_flip_equals_scipy_where_scipy_has_no_rounding_ties() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        differences = [Fraction(int(value), 64) for value in rng.integers(-64, 65, size=7)]
        expected = stats.permutation_test(
            ([float(d) for d in differences],),
            lambda x, axis: np.sum(x, axis=axis),
            permutation_type="samples",
            n_resamples=10_000,
            vectorized=True,
        )
        result = sign_flip_test(differences)
        assert result is not None
        assert result.p == pytest.approx(float(expected.pvalue), rel=1e-12)


def test_sign_flip_of_eight_participants_who_all_go_down() -> None:
    result = sign_flip_test([Fraction(k, 10) for k in (1, 2, 3, 4, 5, 6, 7, 8)])
    assert result is not None
    assert result.p == result.floor == 2 / 256
    assert result.nonzero == 8


def test_sign_flip_by_hand_with_a_zero_and_a_tie() -> None:
    # Of +.3 +.1 -.1 (and a zero): sums 3 +-1 +-1; at least 3 away: 8 patterns less the two with |sum| = 1.
    result = sign_flip_test([Fraction(3, 10), Fraction(1, 10), Fraction(-1, 10), Fraction(0)])
    assert result is not None
    assert result.p == 6 / 8
    assert result.floor == 2 / 8
    assert result.nonzero == 3


def test_sign_flip_counts_ties_that_floats_would_miss() -> None:
    # In floats 0.1 + 0.2 is not 0.3, so that 0.1 + 0.2 - 0.3 is not 0.
    differences = [Fraction(1, 10), Fraction(2, 10), Fraction(-3, 10)]
    result = sign_flip_test(differences)
    assert result is not None
    assert result.p == 1


def test_sign_flip_of_zeros_only_says_nothing() -> None:
    result = sign_flip_test([Fraction(0)] * 5)
    assert result is not None
    assert (result.p, result.floor, result.nonzero) == (1, 1, 0)


@pytest.mark.parametrize("n", [0, 1])
def test_one_participant_is_not_testable(n: int) -> None:
    assert sign_flip_test([Fraction(1, 2)] * n) is None
    assert paired_t_test([Fraction(1, 2)] * n) is None


def test_sign_flip_is_exact_for_a_hundred_participants() -> None:
    differences = [Fraction(1, 10)] * 60 + [Fraction(-1, 10)] * 40
    result = sign_flip_test(differences)
    assert result is not None
    # With equal sizes the test is the two-sided binomial test of the signs.
    assert result.p == pytest.approx(float(stats.binomtest(60, 100).pvalue), rel=1e-12)
    assert result.floor == 2.0**-99


def test_sign_flip_refuses_what_it_cannot_count() -> None:
    distinct = [Fraction(2) ** power for power in range(25)]
    assert sign_flip_test(distinct) is None


@given(st.lists(rates, min_size=2, max_size=12))
@settings(max_examples=150, deadline=None)
def test_sign_flip_and_t_do_not_depend_on_direction_or_order(differences: list[Fraction]) -> None:
    turned = [-difference for difference in reversed(differences)]
    assert sign_flip_test(differences) == sign_flip_test(turned)
    one, other = paired_t_test(differences), paired_t_test(turned)
    assert (one is None) == (other is None)
    if one and other:
        assert one.t == pytest.approx(-other.t, abs=1e-12)
        assert one.p == pytest.approx(other.p, rel=1e-9)


@given(st.lists(st.tuples(st.integers(0, 10), st.integers(0, 10)), min_size=2, max_size=20))
@settings(max_examples=150, deadline=None)
def test_paired_t_equals_scipy(counts: list[tuple[int, int]]) -> None:
    result = paired_t_test([Fraction(first - second, 10) for first, second in counts])
    if len({first - second for first, second in counts}) == 1:
        assert result is None
        return
    assert result is not None
    first, second = (np.array(column, dtype=float) for column in zip(*counts, strict=True))
    expected = stats.ttest_rel(first, second)
    assert result.t == pytest.approx(float(expected.statistic), rel=1e-9, abs=1e-12)
    assert result.p == pytest.approx(float(expected.pvalue), rel=1e-9)
    assert result.df == len(counts) - 1
    assert result.dz * math.sqrt(len(counts)) == pytest.approx(result.t)


def test_the_papers_p_belongs_to_a_t_of_4_17() -> None:
    # Eight differences scaled so that t(7) = 4.17; the paper gives p = 4.2e-3.
    raw = [Fraction(k, 10) for k in (1, 2, 3, 4, 4, 5, 6, 7)]
    mean = statistics.mean(raw)
    spread = statistics.stdev([float(value) for value in raw])
    target = Fraction(4.17 * spread / math.sqrt(8)).limit_denominator(10**9)
    result = paired_t_test([value - mean + target for value in raw])
    assert result is not None
    assert result.t == pytest.approx(4.17, abs=1e-6)
    assert result.p == pytest.approx(4.2e-3, abs=5e-5)


def test_constant_differences_are_not_testable_by_t() -> None:
    # SciPy gives t = inf and p = 0 here.
    assert paired_t_test([Fraction(3, 10)] * 8) is None
    assert paired_t_test([Fraction(0)] * 8) is None
