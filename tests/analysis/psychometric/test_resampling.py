"""Bootstrap and goodness of fit against all possible answers, R's standard errors, and misfits."""

import itertools
import math

import numpy as np
import pytest
from autd_analysis.psychometric.fit import fit
from autd_analysis.psychometric.functions import NORMAL, psychometric_function
from autd_analysis.psychometric.model import Model, answers
from autd_analysis.psychometric.resampling import Resampled, resample
from scipy.optimize import minimize
from scipy.special import log_ndtr, xlogy
from scipy.stats import binom

from tests.analysis.psychometric.conftest import CASES, CORES, OCTAVES, reference

EXACT = Model(NORMAL, guess=0.0, lapse=0.0)


def only(found: tuple[Resampled | None, ...]) -> Resampled:
    (each,) = found
    assert each is not None
    return each


def least_deviance(octaves: np.ndarray, felt: np.ndarray, n: int) -> float:
    """Of rising probits, by plain minimisation from several starts."""
    most = float((xlogy(felt, felt / n) + xlogy(n - felt, 1 - felt / n)).sum())

    def loss(x: np.ndarray) -> float:
        predictor = x[0] + math.exp(min(x[1], 20.0)) * octaves
        return -float((felt * log_ndtr(predictor) + (n - felt) * log_ndtr(-predictor)).sum())

    starts = [(a, b) for a in (-1.0, 1.0) for b in (-6.0, 1.0)]
    found = min(minimize(loss, start, method="Nelder-Mead").fun for start in starts)
    return 2 * (most + float(found))


def test_the_p_of_the_deviance_is_that_over_all_possible_answers() -> None:
    octaves, n = np.array([-1.0, 0.0, 1.0]), 3
    rows = [(2**octave, felt, n) for octave, felt in zip(octaves, (2, 0, 3), strict=True)]
    fitted = fit([answers(rows, OCTAVES)], EXACT, OCTAVES)
    found = only(resample(fitted, resamples=2000))
    assert found.goodness is not None
    curve = fitted.curves[0]
    assert curve.threshold is not None
    assert curve.slope is not None
    p = psychometric_function(NORMAL, OCTAVES, 2**octaves, threshold=curve.threshold, slope=curve.slope)
    observed = least_deviance(octaves, np.array([2.0, 0, 3]), n)
    exact, mean = 0.0, 0.0
    for felt in itertools.product(range(n + 1), repeat=3):
        chance = float(np.prod(binom.pmf(felt, n, p)))
        deviance = least_deviance(octaves, np.array(felt, float), n)
        exact += chance * (deviance >= observed - 1e-3)
        mean += chance * deviance
    assert found.goodness.deviance == pytest.approx(observed, abs=1e-3)
    assert found.goodness.p == pytest.approx(exact, abs=4 * math.sqrt(exact * (1 - exact) / 2000))
    assert found.goodness.dispersion == pytest.approx(observed / mean, rel=0.1)


@pytest.mark.parametrize("core", CORES)
def test_the_deviance_is_rs(core: str) -> None:
    for data in ("three", "six", "single"):
        known = reference(data, core)
        found = only(resample(fit([known.answers], Model(CORES[core], 0.0, 0.0), OCTAVES), resamples=19))
        assert found.goodness is not None
        assert found.goodness.deviance == pytest.approx(known.values["deviance"], abs=1e-6)


@pytest.mark.parametrize(("data", "core"), [case for case in CASES if case[0] == "six"])
def test_with_many_trials_the_interval_is_nearly_rs_two_standard_errors(data: str, core: str) -> None:
    known = reference(data, core)
    found = only(resample(fit([known.answers], Model(CORES[core], 0.0, 0.0), OCTAVES), resamples=2000))
    assert found.intervals.threshold is not None
    assert found.intervals.threshold.low is not None
    assert found.intervals.threshold.high is not None
    half_width = (math.log2(found.intervals.threshold.high) - math.log2(found.intervals.threshold.low)) / 2
    assert half_width == pytest.approx(1.96 * known.values["threshold_se"], rel=0.1)
    assert found.flat == 0


def test_the_same_seed_gives_the_same_interval_and_another_one_not() -> None:
    fitted = fit([reference("six", "normal").answers], Model(), OCTAVES)
    assert resample(fitted) == resample(fitted)
    assert resample(fitted) != resample(fitted, seed=2)


def test_a_function_of_another_form_does_not_fit() -> None:
    rows = [(x, felt, 60.0) for x, felt in zip((1, 2, 4, 8, 16), (5, 40, 20, 45, 58), strict=True)]
    found = only(resample(fit([answers(rows, OCTAVES)], Model(), OCTAVES)))
    assert found.goodness is not None
    assert found.goodness.p == 1 / 401
    assert found.goodness.dispersion is not None
    assert found.goodness.dispersion > 3


def test_what_has_no_function_has_no_bootstrap_interval() -> None:
    step, flat = (
        only(resample(fit([answers(rows, OCTAVES)], Model(), OCTAVES)))
        for rows in ([(1, 0, 9), (2, 0, 9), (4, 9, 9)], [(1, 8, 9), (2, 5, 9), (4, 2, 9)])
    )
    for found in (step, flat):
        assert (found.intervals.threshold, found.intervals.slope) == (None, None)
    assert resample(fit([answers([(1, 3, 9)], OCTAVES)], Model(), OCTAVES)) == (None,)


def test_two_levels_have_no_goodness_of_fit() -> None:
    found = only(resample(fit([answers([(1, 3, 9), (2, 6, 9)], OCTAVES)], Model(), OCTAVES)))
    assert found.goodness is None


def test_intervals_are_open_where_resamples_are_steps() -> None:
    found = only(resample(fit([answers([(1, 1, 4), (2, 2, 4), (4, 4, 4)], OCTAVES)], Model(), OCTAVES)))
    assert found.intervals.slope is not None
    assert found.intervals.slope.high is None
