"""The covariance of sums over noise that may be correlated in time, against what is known of such series."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from autd_trials.calibration.long_run import long_run_covariance

ONES = np.broadcast_to(np.eye(3), (1000, 3, 3))


@pytest.mark.parametrize(("rho", "tolerance"), [(0.0, 0.15), (0.5, 0.2), (0.9, 0.25)])
def test_an_autoregressive_series_sums_up_as_its_theory_says(rho: float, tolerance: float) -> None:
    found = []
    for seed in range(20):
        noise = np.random.default_rng(seed).standard_normal((1000, 3))
        covariance, counted = long_run_covariance(lfilter([1.0], [1.0, -rho], noise, axis=0), ONES)
        found.append([covariance[0, 0], covariance[2, 2], 1000 / counted])
    expected = [1000 / (1 - rho) ** 2, 1000 / (1 - rho) ** 2, (1 + rho) / (1 - rho)]
    assert np.mean(found, axis=0) == pytest.approx(expected, rel=tolerance)


def test_slow_noise_below_much_white_noise_is_seen() -> None:
    found = []
    for seed in range(20):
        generator = np.random.default_rng(seed)
        slow = lfilter([0.3], [1.0, -0.9], generator.standard_normal((1000, 3)), axis=0)  # summed: variance 9
        covariance, _ = long_run_covariance(slow + generator.standard_normal((1000, 3)), ONES)
        found.append(np.diag(covariance).mean() / 1000)
    assert np.mean(found) == pytest.approx(10, rel=0.2)


def test_slow_noise_matters_less_where_derivatives_change_fast() -> None:
    generator = np.random.default_rng(1)
    slow = lfilter([1.0], [1.0, -0.9], generator.standard_normal((1000, 3)), axis=0)
    turning = ONES * np.where(np.arange(1000) % 2, 1.0, -1.0)[:, None, None]
    covariance, _ = long_run_covariance(slow, np.concatenate([ONES, turning], axis=2))
    alone = 1000 / (1 - 0.9**2)
    assert np.diag(covariance)[:3].mean() > 10 * alone
    assert np.diag(covariance)[3:].mean() == pytest.approx(alone, rel=0.25)  # never below independent terms


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
    residuals = generator.standard_normal((count, 3))
    derivatives = generator.standard_normal((count, 3, len(sizes))) * sizes
    lost = generator.random(count) < missing
    residuals[lost], derivatives[lost] = 0.0, 0.0
    covariance, counted = long_run_covariance(residuals, derivatives)
    assert np.isfinite(covariance).all()
    scaled = covariance / np.outer(sizes, sizes)
    assert scaled == pytest.approx(scaled.T, rel=1e-6, abs=1e-6 * np.abs(scaled).max())
    assert np.linalg.eigvalsh(scaled).min() > -1e-6 * max(1.0, np.abs(scaled).max())
    assert 0 <= counted <= count


def test_what_no_residual_sees_stays_unseen() -> None:
    generator = np.random.default_rng(2)
    seen = generator.standard_normal((300, 3, 2))
    derivatives = np.concatenate([seen, seen.sum(axis=2, keepdims=True) * 1000], axis=2)
    covariance, _ = long_run_covariance(generator.standard_normal((300, 3)), derivatives)
    unseen = np.array([1.0, 1.0, -1e-3])
    assert unseen @ covariance @ unseen == pytest.approx(0, abs=1e-6)
