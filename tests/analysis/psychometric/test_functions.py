"""The functions against SciPy's distributions, and what their conventions promise."""

import numpy as np
import pytest
from autd_analysis.psychometric.functions import Axis, Core, psychometric_function
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tests.analysis.psychometric.conftest import CORES, OCTAVES

X = np.geomspace(0.01, 100, 41)
each_core = pytest.mark.parametrize("core", CORES.values(), ids=CORES)


def test_the_cores_are_the_distributions_of_their_names() -> None:
    spread = 1.7
    octaves = np.log2(X / 3)
    logistic = psychometric_function(CORES["logistic"], OCTAVES, X, threshold=3, slope=1 / (4 * spread))
    assert logistic == pytest.approx(stats.logistic.cdf(octaves, scale=spread))
    slope = 1 / (spread * np.sqrt(2 * np.pi))
    normal = psychometric_function(CORES["normal"], OCTAVES, X, threshold=3, slope=slope)
    assert normal == pytest.approx(stats.norm.cdf(octaves, scale=spread))
    # Weibull's shape in natural logarithms; dF/dlog2(x) at the median is shape log(2)^2 / 2
    shape, scale = 1.4, 3 / np.log(2) ** (1 / 1.4)
    weibull = psychometric_function(
        CORES["Weibull"], OCTAVES, X, threshold=3, slope=shape * np.log(2) ** 2 / 2
    )
    assert weibull == pytest.approx(stats.weibull_min.cdf(X, shape, scale=scale))


@each_core
def test_threshold_is_halfway_and_slope_is_the_derivative_there(core: Core) -> None:
    def at(x: float) -> float:
        found = psychometric_function(
            core, OCTAVES, np.array([x]), threshold=5, slope=0.8, guess=0.1, lapse=0.04
        )
        return float(found[0])

    assert at(5) == pytest.approx((0.1 + 0.96) / 2)
    step = 1e-5
    derivative = (at(5 * 2**step) - at(5 * 2**-step)) / (2 * step)
    assert derivative / (1 - 0.1 - 0.04) == pytest.approx(0.8, rel=1e-6)


@each_core
def test_tails_add_up_and_quantiles_invert(core: Core) -> None:
    predictor = np.linspace(-700, 700, 1401)
    below, above = core.distribution(predictor)
    assert below + above == pytest.approx(1)
    assert (core.density(predictor) >= 0).all()
    shares = np.linspace(0.001, 0.999, 99)
    assert core.distribution(core.quantile(shares))[0] == pytest.approx(shares)


@each_core
def test_derivatives_are_those_of_the_distribution(core: Core) -> None:
    predictor, step = np.linspace(-8, 4, 97), 1e-5
    below, above, density, bend = core.derivatives(predictor)
    assert np.stack([below, above]) == pytest.approx(np.stack(core.distribution(predictor)))
    assert density == pytest.approx(core.density(predictor))
    ends = [core.distribution(predictor + side)[0] for side in (step, -step)]
    assert density == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)
    ends = [core.density(predictor + side) for side in (step, -step)]
    assert bend == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)


@each_core
@given(
    threshold=st.floats(1e-3, 1e3),
    slope=st.floats(1e-3, 50),
    guess=st.floats(0, 0.2),
    lapse=st.floats(0, 0.2),
    scale=st.floats(0.01, 100),
)
def test_it_rises_between_guess_and_lapse_and_has_no_unit(
    core: Core, threshold: float, slope: float, guess: float, lapse: float, scale: float
) -> None:
    def at(x: np.ndarray, threshold: float) -> np.ndarray:
        return psychometric_function(
            core, OCTAVES, x, threshold=threshold, slope=slope, guess=guess, lapse=lapse
        )

    p = at(X, threshold)
    assert (np.diff(p) >= -1e-12).all()
    assert p.min() >= guess - 1e-12
    assert p.max() <= 1 - lapse + 1e-12
    assert at(scale * X, scale * threshold) == pytest.approx(p, abs=1e-9)


def test_a_linear_axis_takes_negative_stimuli() -> None:
    x = np.array([-2.0, 0.0, 2.0])
    p = psychometric_function(CORES["normal"], Axis(logarithmic=False), x, threshold=0, slope=0.3)
    assert p == pytest.approx(stats.norm.cdf(x, scale=1 / (0.3 * np.sqrt(2 * np.pi))))


def test_a_threshold_too_large_to_be_written_is_infinite() -> None:
    assert OCTAVES.stimulus(5000.0) == np.inf
