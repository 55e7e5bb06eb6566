"""The tests of many studies at once give the p of one study's tests, exactly."""

import math
from fractions import Fraction

import numpy as np
import pytest
from autd_analysis.basics.paired import paired_t_test, sign_flip_test
from autd_analysis.power.fast import paired_t_p, rejected, sign_flip_p
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray


@given(arrays(np.int64, st.tuples(st.integers(1, 6), st.integers(2, 24)), elements=st.integers(-10, 10)))
def test_sign_flip(differences: NDArray[np.int64]) -> None:
    p = sign_flip_p(differences, 10)
    for study, found in zip(differences, p, strict=True):
        expected = sign_flip_test([Fraction(int(difference), 10) for difference in study])
        assert expected is not None
        assert found == pytest.approx(expected.p, abs=1e-12)


@given(arrays(np.int64, st.tuples(st.integers(1, 6), st.integers(2, 24)), elements=st.integers(-10, 10)))
def test_paired_t(differences: NDArray[np.int64]) -> None:
    p = paired_t_p(differences)
    for study, found in zip(differences, p, strict=True):
        expected = paired_t_test([Fraction(int(difference)) for difference in study])
        assert found == pytest.approx(math.nan if expected is None else expected.p, abs=1e-12, nan_ok=True)


def test_equal_to_alpha_counts_as_found() -> None:
    assert rejected(np.array([0.05 + 1e-15, 0.0501, 0.05]), 0.05).tolist() == [True, False, True]


def test_many_studies_go_through_in_parts() -> None:
    differences = np.random.default_rng(1).integers(-10, 11, (4500, 8))
    p = sign_flip_p(differences, 10)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 8)).reshape(8, -1)
    for row in (0, 2100, 4499):
        sums = np.abs(differences[row] @ signs)
        assert p[row] == pytest.approx((sums >= abs(differences[row].sum())).mean())


def test_a_hundred_participants_are_as_exact() -> None:
    differences = np.random.default_rng(2).integers(-20, 21, (2, 100))
    for study, found in zip(differences, sign_flip_p(differences, 20), strict=True):
        expected = sign_flip_test([Fraction(int(difference), 20) for difference in study])
        assert expected is not None
        assert found == pytest.approx(expected.p, abs=1e-10)
