"""The exact participant bootstrap against enumeration and SciPy."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from autd_analysis.basics.bootstrap import bootstrap_interval
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats


@given(st.lists(st.integers(0, 10), min_size=2, max_size=5))
@settings(max_examples=60, deadline=None)
def test_equals_the_quantiles_of_all_resamples(felt: list[int]) -> None:
    interval = bootstrap_interval([Fraction(each, 10) for each in felt])
    if len(set(felt)) == 1:
        assert interval is None
        return
    assert interval is not None
    sums = np.sort([sum(resample) for resample in itertools.product(felt, repeat=len(felt))])
    ends = [sums[int(np.ceil(len(sums) * q)) - 1] / len(felt) / 10 for q in (0.025, 0.975)]
    assert (interval.low, interval.high) == pytest.approx(ends)


def test_close_to_scipys_drawn_resamples() -> None:
    felt = [2, 9, 4, 7, 7, 10, 1, 5]
    interval = bootstrap_interval([Fraction(each, 10) for each in felt])
    assert interval is not None
    drawn = stats.bootstrap(
        (np.array(felt) / 10,), np.mean, n_resamples=20_000, method="percentile", rng=np.random.default_rng(1)
    ).confidence_interval
    assert (interval.low, interval.high) == pytest.approx((drawn.low, drawn.high), abs=0.013)


def test_many_participants_are_no_hindrance_and_odd_fractions_are_said_to_be() -> None:
    many = [Fraction(each % 11, 10) for each in range(60)]
    interval = bootstrap_interval(many)
    assert interval is not None
    assert interval.high - interval.low == pytest.approx(
        2 * 1.96 * np.std([*map(float, many)]) / 60**0.5, rel=0.03
    )
    primes = [101, 103, 107, 109, 113, 127, 131, 137]
    assert bootstrap_interval([Fraction(1, prime) for prime in primes]) is not None
    assert bootstrap_interval([Fraction(n, prime) for prime in primes for n in range(1, 9)]) is None


def test_one_value_has_no_interval() -> None:
    assert bootstrap_interval([Fraction(1, 2)]) is None
    assert bootstrap_interval([]) is None
