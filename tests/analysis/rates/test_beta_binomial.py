"""The beta-binomial model against SciPy's distribution, plain optimisation, and its own simulation."""

import numpy as np
import pytest
from autd_analysis.rates.beta_binomial import fit_beta_binomial
from scipy import stats
from scipy.optimize import brentq, minimize

# D. A. Williams (1975), Biometrics 31, 949-952, control litters: survivors of litter size.
CONTROL = [
    (13, 13), (12, 12), (9, 9), (9, 9), (8, 8), (8, 8), (12, 13), (11, 12),
    (9, 10), (9, 10), (8, 9), (11, 13), (4, 5), (5, 7), (7, 10), (7, 10),
]  # fmt: skip


def scipy_log_likelihood(counts: list[tuple[int, int]], mean: float, correlations: np.ndarray) -> np.ndarray:
    """Return the log likelihood at each of some correlations."""
    felt, n = np.array(counts).T
    size = (1 / np.asarray(correlations) - 1)[..., None]
    likely = stats.betabinom.logpmf(felt, n, mean * size, (1 - mean) * size)
    found: np.ndarray = (likely - stats.binom.logpmf(felt, n, felt / n)).sum(axis=-1)
    return found


def test_williams_litters_against_plain_optimisation_of_scipys_likelihood() -> None:
    fit = fit_beta_binomial(CONTROL)
    assert fit is not None

    def loss(x: np.ndarray) -> float:
        mean, correlation = 1 / (1 + np.exp(-x))
        return -float(scipy_log_likelihood(CONTROL, mean, correlation))

    found = minimize(loss, [2.0, -3.0], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-10})
    mean, correlation = 1 / (1 + np.exp(-found.x))
    assert fit.mean == pytest.approx(mean, abs=1e-5)
    assert fit.correlation == pytest.approx(correlation, abs=1e-4)

    def lost(mean: float) -> float:
        grid = 1 / (1 + np.exp(-np.linspace(-8, 3, 2000)))
        return float(scipy_log_likelihood(CONTROL, mean, grid).max()) + found.fun + 1.9207294

    assert fit.interval.low == pytest.approx(brentq(lost, 0.6, mean, xtol=1e-5), abs=2e-4)
    assert fit.interval.high == pytest.approx(brentq(lost, mean, 0.99, xtol=1e-5), abs=2e-4)


def test_people_who_are_alike_show_no_correlation_and_the_binomial_interval() -> None:
    fit = fit_beta_binomial([(5, 10)] * 6)
    assert fit is not None
    assert fit.mean == pytest.approx(0.5, abs=1e-6)
    assert fit.correlation == 0
    assert fit.p_overdispersion == 0.5
    # 30 of 60: the deviance falls by 3.841 at logits of +-0.512
    drop = stats.binom.logpmf(30, 60, 0.5) - stats.binom.logpmf(30, 60, fit.interval.high)
    assert drop >= 1.92072 - 1e-3


def test_people_who_always_or_never_feel_are_fully_correlated() -> None:
    fit = fit_beta_binomial([(10, 10), (0, 10), (10, 10), (0, 10), (10, 10), (0, 10)])
    assert fit is not None
    assert fit.mean == pytest.approx(0.5, abs=1e-4)
    assert fit.correlation > 0.99
    assert fit.p_overdispersion < 1e-10
    # then each person is one answer: 3 of 6
    low, high = fit.interval.low, fit.interval.high
    assert stats.binom.logpmf(3, 6, 0.5) - stats.binom.logpmf(3, 6, low) == pytest.approx(1.9207, abs=0.01)
    assert low + high == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("counts", [[], [(3, 10)], [(0, 10)] * 5, [(10, 10)] * 5, [(3, 10), (0, 0)]])
def test_what_cannot_be_told_is_not_told(counts: list[tuple[int, int]]) -> None:
    assert fit_beta_binomial(counts) is None


def test_the_interval_covers_and_the_correlation_is_recovered() -> None:
    generator = np.random.default_rng(4)
    covered, correlations = 0, []
    for _ in range(60):
        rates = generator.beta(2, 2, 20)  # mean 0.5, correlation 0.2
        fit = fit_beta_binomial([(int(felt), 10) for felt in generator.binomial(10, rates)])
        assert fit is not None
        covered += fit.interval.low <= 0.5 <= fit.interval.high
        correlations.append(fit.correlation)
    assert covered >= 51  # of 57 expected; fewer has a chance below 1 %
    assert np.median(correlations) == pytest.approx(0.2, abs=0.06)


def test_one_person_of_many_trials_among_others_of_few() -> None:
    """The likelihood has a second, lower top where everybody is alike; SciPy's on a grid finds the higher."""
    counts = [(500, 500), (0, 2), (0, 2), (0, 3)]
    fit = fit_beta_binomial(counts)
    assert fit is not None
    correlations = np.linspace(0.001, 0.999, 999)
    best = max(scipy_log_likelihood(counts, mean, correlations).max() for mean in np.linspace(0.01, 0.99, 99))
    assert scipy_log_likelihood(counts, fit.mean, correlations).max() >= best - 1e-3
