"""The mixed model against glmm.py's own links, a plain quadrature and simulation; means and Fieller."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from autd_analysis.models.glmm import fit_glmm
from autd_analysis.models.links import LOGIT, PROBIT, Link
from autd_analysis.models.marginal import BinomialRows
from autd_analysis.psychometric.fit import Curve, fit
from autd_analysis.psychometric.functions import (
    LOGISTIC,
    NORMAL,
    WEIBULL,
    Array,
    Axis,
    Core,
    psychometric_function,
)
from autd_analysis.psychometric.hierarchical import (
    KnownRates,
    MixedCurve,
    fieller,
    mean_slope,
    mean_threshold,
    mixed_curve,
)
from autd_analysis.psychometric.model import Answers, Model, answers
from scipy import stats
from scipy.optimize import brentq, minimize
from scipy.special import logsumexp

from tests.analysis.psychometric.conftest import OCTAVES

LEVELS = np.geomspace(10, 160, 5)


def people(
    count: int, seed: int, *, guess: float = 0.0, lapse: float = 0.0, trials: int = 20
) -> list[Answers]:
    """Normal functions with thresholds about 40, SD 0.6 octaves, slopes about 0.5, SD 0.1."""
    generator = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        p = psychometric_function(
            NORMAL, OCTAVES, LEVELS,
            threshold=40 * 2 ** generator.normal(0, 0.6), slope=max(0.1, generator.normal(0.5, 0.1)),
            guess=guess, lapse=lapse,
        )  # fmt: skip
        felt = generator.binomial(trials, p)
        found.append(answers([(x, f, trials) for x, f in zip(LEVELS, felt, strict=True)], OCTAVES))
    return found


def rows_of(every: Sequence[Answers]) -> BinomialRows:
    octaves = np.concatenate([np.log2(each.x) for each in every])
    columns = np.column_stack([np.ones(len(octaves)), octaves - np.log2(40)])
    return BinomialRows(
        np.concatenate([each.felt for each in every]),
        np.concatenate([each.n for each in every]),
        columns,
        columns,
        np.repeat(np.arange(len(every)), [len(each.x) for each in every]),
    )


@pytest.mark.parametrize(("core", "link"), [(LOGISTIC, LOGIT), (NORMAL, PROBIT)])
def test_without_guesses_and_lapses_it_is_the_mixed_model_of_that_link(core: Core, link: Link) -> None:
    every = people(8, seed=2)
    rows = rows_of(every)
    zero = np.zeros(8)
    mine, its = fit_glmm(rows, link=KnownRates(core, zero, zero)), fit_glmm(rows, link=link)
    assert mine.coefficients == pytest.approx(its.coefficients, rel=2e-3)
    assert mine.standard_deviations == pytest.approx(its.standard_deviations, rel=1e-2)
    assert mine.log_likelihood == pytest.approx(its.log_likelihood, abs=1e-4)
    assert np.sqrt(np.diag(mine.covariance)) == pytest.approx(np.sqrt(np.diag(its.covariance)), rel=0.05)
    curve = mixed_curve(every, zero.tolist(), zero.tolist(), core, OCTAVES)
    assert isinstance(curve, MixedCurve)
    assert math.log2(curve.threshold / 40) == pytest.approx(
        -its.coefficients[0] / its.coefficients[1], abs=2e-3
    )


def plain_log_likelihood(
    parameters: Array, rows: BinomialRows, guess: Array, lapse: float, core: Core = NORMAL
) -> float:
    """By plain sums over 71 x 71 even steps, which are exact where posteriors are wider than a step."""
    even = np.linspace(-6, 6, 71)
    u = np.stack(np.meshgrid(even, even, indexing="ij"), axis=-1).reshape(-1, 2)
    logs = 2 * math.log(even[1] - even[0]) - math.log(2 * math.pi) - 0.5 * (u**2).sum(axis=1)
    factor = np.array([[parameters[2], 0], [parameters[3], parameters[4]]])
    total = 0.0
    for person in range(len(guess)):
        mine = rows.participant == person
        predictor = rows.fixed[mine] @ parameters[:2] + u @ factor.T @ rows.random[mine].T
        p = guess[person] + (1 - guess[person] - lapse) * core.distribution(predictor)[0]
        p = np.clip(p, 1e-300, 1 - 1e-15)
        of_points = (rows.felt[mine] * np.log(p) + (rows.trials - rows.felt)[mine] * np.log1p(-p)).sum(axis=1)
        total += float(logsumexp(of_points + logs))
    return total


def test_with_guesses_and_lapses_it_is_the_top_of_a_plain_quadrature() -> None:
    every = people(6, seed=5, guess=0.1, lapse=0.03, trials=12)
    rows, guess = rows_of(every), np.full(6, 0.1)
    fitted = fit_glmm(rows, link=KnownRates(NORMAL, guess, np.full(6, 0.03)))
    assert fitted.converged
    found = np.concatenate([fitted.coefficients, fitted.factor[np.tril_indices(2)]])

    def loss(x: Array) -> float:
        return -plain_log_likelihood(x, rows, guess, 0.03)

    assert fitted.log_likelihood == pytest.approx(-loss(found), abs=5e-3)
    better = minimize(loss, found, method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-5})
    assert -better.fun == pytest.approx(-loss(found), abs=5e-3)
    assert found[:2] == pytest.approx(better.x[:2], abs=0.03)


def test_a_population_is_recovered() -> None:
    every = people(60, seed=8, guess=0.05, lapse=0.02, trials=40)
    curve = mixed_curve(every, [0.05] * 60, [0.02] * 60, NORMAL, OCTAVES)
    assert isinstance(curve, MixedCurve)
    assert curve.participants == 60
    assert math.log2(curve.threshold / 40) == pytest.approx(0, abs=3 * 0.6 / math.sqrt(60))
    assert curve.threshold_sd == pytest.approx(0.6, rel=0.25)
    assert curve.slope == pytest.approx(0.5, rel=0.15)
    assert curve.interval.low is not None
    assert curve.interval.high is not None
    assert curve.interval.low < curve.threshold < curve.interval.high
    assert curve.slope_interval.low < curve.slope < curve.slope_interval.high


@pytest.mark.slow
def test_the_interval_of_the_threshold_covers() -> None:
    covered, studies = 0, 100
    for seed in range(studies):
        curve = mixed_curve(people(12, seed, trials=12), [0.0] * 12, [0.0] * 12, NORMAL, OCTAVES)
        assert isinstance(curve, MixedCurve)
        covered += (curve.interval.low or 0) <= 40 <= (curve.interval.high or math.inf)
    # Normal quantiles with 12 people: somewhat under 95 %; below the 0.1 % point of 90 % something is wrong
    assert covered >= stats.binom.ppf(0.001, studies, 0.9)


@pytest.mark.parametrize(
    ("felt", "count", "cause"),
    [
        ([0, 0, 0], 5, "do not rise gradually"),
        ([10, 10, 10], 5, "do not rise gradually"),
        ([8, 4, 1], 5, "do not rise gradually"),
        ([0, 0, 10], 5, "do not rise gradually"),
        ([4], 5, "do not rise gradually"),
        ([2, 5, 8], 3, "needs 4 participants"),
        ([2, 5, 8], 0, "needs 4 participants"),
    ],
)
def test_what_has_no_mixed_model_says_why(felt: Sequence[float], count: int, cause: str) -> None:
    rows = [(x, f, 10) for x, f in zip((25, 50, 100), felt, strict=False)]
    zero = [0.0] * count
    found = mixed_curve([answers(rows, OCTAVES)] * count, zero, zero, NORMAL, OCTAVES)
    assert isinstance(found, str)
    assert cause in found


def test_fiellers_ends_are_where_the_difference_is_just_significant() -> None:
    above, below, covariance = -1.2, 0.8, np.array([[0.05, 0.01], [0.01, 0.02]])

    def excess(ratio: float) -> float:
        variance = covariance[0, 0] - 2 * ratio * covariance[0, 1] + ratio**2 * covariance[1, 1]
        return (above - ratio * below) ** 2 - 1.959963984540054**2 * float(variance)

    low, high = fieller(above, below, covariance, 1.959963984540054)
    assert low == pytest.approx(brentq(excess, -20, above / below))
    assert high == pytest.approx(brentq(excess, above / below, 20))
    assert fieller(-1.2, 0.2, covariance, 1.959963984540054) == (None, None)


def curves(rows: Sequence[Sequence[float]]) -> list[Curve]:
    found: list[Curve] = []
    for felt in rows:
        condition = answers(list(zip((25, 50, 100), felt, (10, 10, 10), strict=True)), OCTAVES)
        found += fit([condition], Model(NORMAL, 0.0, 0.0), OCTAVES).curves
    return found


def test_means_are_those_of_logarithms_and_leave_out_who_has_none() -> None:
    every = curves([(1, 5, 9), (3, 6, 10), (0, 3, 8), (0, 0, 0), (0, 0, 10)])
    mean = mean_threshold(every, OCTAVES)
    octaves = [math.log2(each.threshold) for each in every if each.threshold is not None]
    assert mean.participants == 4
    assert mean.value == pytest.approx(2 ** float(np.mean(octaves)))
    low, high = stats.t.interval(0.95, 3, np.mean(octaves), stats.sem(octaves))
    assert mean.interval is not None
    assert (mean.interval.low, mean.interval.high) == pytest.approx((2**low, 2**high))
    slope = mean_slope(every)
    assert slope.participants == 3
    slopes = [each.slope for each in every[:3] if each.slope is not None]
    assert slope.value == pytest.approx(stats.gmean(slopes))


def test_means_of_nobody_and_of_one() -> None:
    nobody, one = curves([(0, 0, 0)]), curves([(1, 5, 9)])
    assert mean_threshold(nobody, OCTAVES).value is None
    assert mean_slope(nobody).value is None
    assert mean_threshold(one, OCTAVES).value == one[0].threshold
    assert mean_threshold(one, OCTAVES).interval is None
    assert mean_threshold(one, Axis(logarithmic=False)).value == one[0].threshold


@pytest.mark.parametrize("seed", range(3))
def test_information_is_the_observed_one_where_rates_are_known(seed: int) -> None:
    """Expected curvature in its place gave slopes' intervals a fifth as wide as they are, and a crash."""
    generator, core = np.random.default_rng(seed), (NORMAL, LOGISTIC, WEIBULL)[seed % 3]
    guess = generator.uniform(0, 0.4, 6)
    every = [
        people(1, 10 * seed + place, guess=each, lapse=0.1, trials=10)[0] for place, each in enumerate(guess)
    ]
    rows = rows_of(every)
    fitted = fit_glmm(rows, link=KnownRates(core, guess, np.full(6, 0.1)))
    assert fitted.converged
    at = np.concatenate([fitted.coefficients, fitted.factor[np.tril_indices(2)]])

    def log_likelihood(x: Array) -> float:
        return plain_log_likelihood(x, rows, guess, 0.1, core)

    numeric = np.linalg.pinv(-hessian(log_likelihood, at))[:2, :2]
    assert np.sqrt(np.diag(fitted.covariance)) == pytest.approx(np.sqrt(np.diag(numeric)), rel=0.02)


def hessian(function: Callable[[Array], float], at: Array, step: float = 2e-3) -> Array:
    moves = step * np.eye(len(at))
    pairs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
    return np.array(
        [
            [sum(a * b * function(at + a * one + b * other) for a, b in pairs) for other in moves]
            for one in moves
        ]
    ) / (4 * step**2)


def test_high_rates_that_differ_are_no_trouble() -> None:
    for seed in range(3):
        generator = np.random.default_rng(seed)
        every = [
            answers(
                [(x, float(generator.binomial(10, p)), 10.0) for x, p in zip(LEVELS, rates, strict=False)],
                OCTAVES,
            )
            for rates in np.sort(generator.uniform(0, 1, (6, 3)))
        ]
        found = mixed_curve(every, generator.uniform(0, 0.5, 6).tolist(), [0.02] * 6, NORMAL, OCTAVES)
        assert isinstance(found, MixedCurve)
        assert found.slope_interval.low < found.slope < found.slope_interval.high
