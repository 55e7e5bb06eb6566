"""The covariance of sums of terms that may be correlated in time, against what is known of such series."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from autd_trials.calibration.long_run import long_run_covariance


@pytest.mark.parametrize(("rho", "tolerance"), [(0.0, 0.1), (0.5, 0.12), (0.9, 0.25)])
def test_an_autoregressive_series_sums_up_as_its_theory_says(rho: float, tolerance: float) -> None:
    count, sums = 1000, []
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal((count, 2)) * [1, 100]
        covariance, independent = long_run_covariance(lfilter([1.0], [1.0, -rho], noise, axis=0))
        sums.append([covariance[0, 0], covariance[1, 1] / 1e4, count / independent])
    inflation = (1 + rho) / (1 - rho)
    expected = np.array([count / (1 - rho) ** 2, count / (1 - rho) ** 2, inflation])
    assert np.mean(sums, axis=0) == pytest.approx(expected, rel=tolerance)


def test_terms_that_alternate_do_not_claim_more_than_independent_ones() -> None:
    terms = np.random.default_rng(1).standard_normal((300, 3))
    terms = terms - 0.9 * np.roll(terms, 1, axis=0)
    covariance, _ = long_run_covariance(terms)
    assert np.linalg.eigvalsh(covariance - terms.T @ terms).min() > -1e-6


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(4, 60),
    missing=st.floats(0, 0.6),
    sizes=st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=5),
)
def test_it_is_a_covariance_whatever_is_missing(
    seed: int, count: int, missing: float, sizes: list[float]
) -> None:
    generator = np.random.default_rng(seed)
    terms = generator.standard_normal((count, len(sizes))) * sizes
    terms[generator.random(count) < missing] = 0
    covariance, independent = long_run_covariance(terms)
    assert np.isfinite(covariance).all()
    scaled = covariance / np.outer(sizes, sizes)
    assert scaled == pytest.approx(scaled.T)
    assert np.linalg.eigvalsh(scaled).min() > -1e-9 * max(1.0, np.abs(scaled).max())
    assert 0 <= independent <= count
