"""Profile-likelihood intervals against R, against grids, and against the truth they should cover."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from autd_analysis.psychometric.fit import fit
from autd_analysis.psychometric.functions import (
    Core,
    predictor_at_threshold,
    psychometric_function,
    slope_per_steepness,
)
from autd_analysis.psychometric.intervals import CurveIntervals, profile_intervals
from autd_analysis.psychometric.likelihood import Rate
from autd_analysis.psychometric.model import Model, answers
from autd_analysis.psychometric.profile import Job, Profile
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize
from scipy.stats import binom

from tests.analysis.psychometric.conftest import CASES, CORES, OCTAVES, reference

HALF_CHI2_95 = 1.920729410347062
LEVELS = (25.0, 50.0, 100.0)


def intervals_of(felt: Sequence[float], model: Model) -> CurveIntervals:
    rows = [(x, each, 10.0) for x, each in zip(LEVELS, felt, strict=True)]
    return profile_intervals(fit([answers(rows, OCTAVES)], model, OCTAVES))[0]


@pytest.mark.parametrize(("data", "core"), CASES)
def test_without_guesses_and_lapses_they_are_rs_profiles(data: str, core: str) -> None:
    known = reference(data, core)
    (found,) = profile_intervals(fit([known.answers], Model(CORES[core], 0.0, 0.0), OCTAVES))
    assert found.threshold is not None
    assert found.threshold.low is not None
    assert found.threshold.high is not None
    ends = [math.log2(found.threshold.low), math.log2(found.threshold.high)]
    assert ends == pytest.approx([known.values["low"], known.values["high"]], abs=2e-4)
    assert found.slope is not None
    scale = slope_per_steepness(CORES[core])
    assert found.slope.low == pytest.approx(known.values["steepness_low"] * scale, rel=1e-3)
    assert found.slope.high == pytest.approx(known.values["steepness_high"] * scale, rel=1e-3)


@pytest.mark.parametrize("core", CORES.values(), ids=CORES)
def test_a_shared_guess_rate_is_profiled_out_over_both_conditions(core: Core) -> None:
    levels = np.array([10.0, 20.0, 40.0, 80.0])
    felt = [np.array([2.0, 4, 9, 12]), np.array([1.0, 3, 6, 10])]
    catch = (2.0, 20.0)
    inner, outer = (list(zip(levels, each, [12.0] * 4, strict=True)) for each in felt)
    conditions = [answers(inner, OCTAVES, catch), answers(outer, OCTAVES)]
    fitted = fit(conditions, Model(core, guess="shared", lapse=0.02), OCTAVES)
    found = profile_intervals(fitted)[1].threshold
    assert found is not None

    def best_at(octave: float) -> float:
        """The largest likelihood with the second threshold given, by plain minimisation."""

        def loss(x: np.ndarray) -> float:
            guess = 0.2 / (1 + math.exp(-x[3]))
            total = -float(binom.logpmf(catch[0], catch[1], guess))
            for threshold, log_slope, each in ((x[0], x[1], felt[0]), (octave, x[2], felt[1])):
                p = psychometric_function(
                    core, OCTAVES, levels, threshold=2**threshold, slope=math.exp(log_slope),
                    guess=guess, lapse=0.02,
                )  # fmt: skip
                total -= float(np.sum(binom.logpmf(each, 12, p)))
            return total

        starts = [[4.5, -0.7, slope, guess] for slope in (-1.0, 0.5) for guess in (-1.0, 1.0)]
        found = [
            minimize(loss, each, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
            for each in starts
        ]
        return max(-float(each.fun) for each in found)

    estimate = fitted.curves[1].threshold
    assert estimate is not None
    top = best_at(math.log2(estimate))
    for end in (found.low, found.high):
        assert end is not None
        assert best_at(math.log2(end)) == pytest.approx(top - HALF_CHI2_95, abs=2e-3)


def test_all_and_none_bound_the_threshold_on_one_side() -> None:
    none, every = (intervals_of(felt, Model()) for felt in ([0, 0, 0], [10, 10, 10]))
    assert none.threshold is not None
    assert none.threshold.high is None
    assert none.threshold.low == pytest.approx(100, rel=1e-4)
    assert every.threshold is not None
    assert every.threshold.low is None
    assert every.threshold.high == pytest.approx(25, rel=1e-4)
    assert none.slope == every.slope
    assert none.slope is not None
    assert (none.slope.low, none.slope.high) == (0, None)


def test_a_step_bounds_the_threshold_by_its_levels_and_the_slope_from_below() -> None:
    found = intervals_of([0, 0, 10], Model(CORES["logistic"], 0.0, 0.0))
    assert found.threshold is not None
    assert found.threshold.low == pytest.approx(50, rel=1e-4)
    assert found.threshold.high == pytest.approx(100, rel=1e-4)
    assert found.slope is not None
    assert found.slope.high is None

    # the gentlest logistic function that loses 1.92: by symmetry its threshold is in the middle of the step
    def loss(steepness: float) -> float:
        far, near = steepness * 1.5, steepness * 0.5
        return 10 * sum(math.log1p(math.exp(-distance)) for distance in (far, near, near))

    def least(steepness: float) -> float:
        def moved(shift: float) -> float:
            places = np.array([-1.5, -0.5, 0.5]) - shift
            return 10 * float(np.logaddexp(0, steepness * places * np.array([1, 1, -1])).sum())

        return float(min(moved(shift) for shift in np.linspace(-0.5, 0.5, 2001)))

    assert least(3.0) <= loss(3.0)
    low = brentq(lambda steepness: least(steepness) - HALF_CHI2_95, 0.5, 20)
    assert found.slope.low == pytest.approx(low / 4, rel=1e-3)


def test_falling_answers_leave_everything_open_but_steep_slopes() -> None:
    found = intervals_of([8, 4, 1], Model())
    assert found.threshold is not None
    assert (found.threshold.low, found.threshold.high) == (None, None)
    assert found.slope is not None
    assert found.slope.low == 0
    assert found.slope.high is not None
    assert found.slope.high < 0.2


def test_one_level_has_no_interval() -> None:
    (found,) = profile_intervals(fit([answers([(25, 4, 10)], OCTAVES)], Model(), OCTAVES))
    assert (found.threshold, found.slope) == (None, None)


def test_an_end_may_lie_where_another_function_takes_over() -> None:
    # Likelihoods with a lapse rate have several tops; a dense grid knows them all.
    x = np.geomspace(20, 200, 5)
    felt, n = np.array([0.0, 2, 6, 4, 10]), np.array([11.0, 3, 6, 4, 10])
    fitted = fit([answers(list(zip(x, felt, n, strict=True)), OCTAVES)], Model(), OCTAVES)
    core, octaves = CORES["normal"], np.log2(x)

    def best_at(octave: float) -> float:
        steepness = np.geomspace(1e-3, 3e4, 20000)[:, None]
        below, _ = core.distribution(predictor_at_threshold(core) + steepness * (octaves - octave))
        p = np.clip(0.98 * below, 1e-300, 1)
        return float((felt * np.log(p) + (n - felt) * np.log1p(-p)).sum(axis=1).max())

    found = profile_intervals(fitted)[0].threshold
    assert found is not None
    for end in (found.low, found.high):
        assert end is not None
        lost = fitted.log_likelihood - best_at(math.log2(end))
        assert lost == pytest.approx(HALF_CHI2_95, abs=1e-3)


@settings(max_examples=40, deadline=None)
@given(
    core=st.sampled_from(list(CORES.values())),
    rate=st.sampled_from([0.0, 0.1, "shared", "free"]),
    rows=st.lists(
        st.tuples(st.sampled_from([0.1, 0.2, 0.5, 1.0, 7.0]), st.integers(0, 3), st.integers(3, 5)),
        min_size=1, max_size=6,
    ),
)  # fmt: skip
def test_whatever_is_answered_estimates_are_finite_and_in_their_intervals(
    core: Core, rate: Rate, rows: list[tuple[float, float, float]]
) -> None:
    fitted = fit(
        [answers(rows, OCTAVES, (1, 9)), answers(rows[:3], OCTAVES)], Model(core, rate, 0.02), OCTAVES
    )
    for curve, found in zip(fitted.curves, profile_intervals(fitted), strict=True):
        assert curve.threshold is None or math.isfinite(curve.threshold)
        for estimate, interval in ((curve.threshold, found.threshold), (curve.slope, found.slope)):
            if estimate is None or interval is None:
                continue
            assert interval.low is None or interval.low <= estimate * (1 + 1e-4)
            assert interval.high is None or estimate <= interval.high * (1 + 1e-4)


@pytest.mark.parametrize(("guess", "lapse"), [(0.0, 0.02), (0.1, 0.02), (0.5, 0.02), (0.0, 0.3)])
def test_thresholds_and_slopes_are_covered_95_times_in_100(guess: float, lapse: float) -> None:
    """A value is covered where its profile is inside, so that ends need not be looked for."""
    generator = np.random.default_rng(11)
    x, core, slope = np.geomspace(10, 160, 6), CORES["normal"], 0.5
    p = psychometric_function(core, OCTAVES, x, threshold=40, slope=slope, guess=guess, lapse=lapse)
    model = Model(core, "free" if guess == 0.1 else guess, "free" if lapse == 0.3 else lapse)
    studies, covered = 150, np.zeros(2)
    for _ in range(studies):
        rows = list(zip(x, generator.binomial(40, p), [40.0] * 6, strict=True))
        catch = (float(generator.binomial(40, guess)), 40.0)
        fitted = fit([answers(rows, OCTAVES, catch)], model, OCTAVES)
        octaves = fitted.problem.reach
        truths: dict[Job, np.ndarray] = {
            (0, "threshold"): np.array([(math.log2(40) - fitted.problem.middle) / octaves]),
            (0, "slope"): np.log([slope * octaves / slope_per_steepness(core)]),
        }
        profile = Profile(fitted, truths)
        covered += [profile.on_grid(job)[0] <= 0 for job in truths]
    # fewer or more has a chance of about 0.1 % each where 95 % are covered
    low, high = (float(binom.ppf(tail, studies, 0.95)) for tail in (0.001, 0.999))
    assert (low <= covered).all()
    assert (covered <= high).all()
