"""Maximum likelihood against R's glm and SciPy's minimisers, and answers that tell no function."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from autd_analysis.psychometric.fit import Curve, fit
from autd_analysis.psychometric.functions import Axis, Core, psychometric_function, slope_per_steepness
from autd_analysis.psychometric.model import Answers, Model, answers, axis_of
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import Bounds, differential_evolution

from tests.analysis.psychometric.conftest import CASES, CORES, OCTAVES, reference

EXACT = Model(CORES["normal"], guess=0.0, lapse=0.0)
LEVELS = (25.0, 50.0, 100.0)
INNER = answers([(25, 5, 10), (50, 8, 10), (100, 10, 10)], OCTAVES, (1, 6))
OUTER = answers([(25, 1, 10), (50, 2, 10), (100, 5, 10)], OCTAVES, (2, 6))


def curve_of(felt: Sequence[float], model: Model = EXACT, levels: Sequence[float] = LEVELS) -> Curve:
    rows = [(x, each, 10.0) for x, each in zip(levels, felt, strict=True)]
    return fit([answers(rows, OCTAVES)], model, OCTAVES).curves[0]


@pytest.mark.parametrize(("data", "core"), CASES)
def test_without_guesses_and_lapses_it_is_rs_glm(data: str, core: str) -> None:
    known = reference(data, core)
    fitted = fit([known.answers], Model(CORES[core], 0.0, 0.0), OCTAVES)
    (curve,) = fitted.curves
    assert curve.threshold is not None
    assert math.log2(curve.threshold) == pytest.approx(known.values["threshold"], abs=2e-5)
    assert curve.slope == pytest.approx(
        known.values["steepness"] * slope_per_steepness(CORES[core]), rel=1e-4
    )
    assert fitted.log_likelihood == pytest.approx(known.values["log_likelihood"], abs=1e-7)
    assert curve.notes == ()


def log_likelihood(
    core: Core, conditions: Sequence[Answers], thresholds: Sequence[float], slopes: Sequence[float],
    guesses: Sequence[float], lapses: Sequence[float],
) -> float:  # fmt: skip
    total = 0.0
    for each, octave, slope, guess, lapse in zip(
        conditions, thresholds, slopes, guesses, lapses, strict=True
    ):
        p = psychometric_function(
            core, OCTAVES, each.x, threshold=2**octave, slope=10**slope, guess=guess, lapse=lapse
        )
        p = np.clip(p, 1e-12, 1 - 1e-12)
        total += float((each.felt * np.log(p) + (each.n - each.felt) * np.log1p(-p)).sum())
        guess = max(guess, 1e-12)
        total += each.catch_felt * math.log(guess) + (each.catch_n - each.catch_felt) * math.log1p(-guess)
    return total


@pytest.mark.parametrize("core", CORES.values(), ids=CORES)
@pytest.mark.parametrize("kind", ["shared", "free"])
def test_guess_and_lapse_shared_or_free_against_a_global_search(core: Core, kind: str) -> None:
    model = Model(
        core, guess="shared" if kind == "shared" else "free", lapse="shared" if kind == "shared" else "free"
    )
    fitted = fit([INNER, OUTER], model, OCTAVES)
    rates = 1 if kind == "shared" else 2

    def loss(x: np.ndarray) -> float:
        guesses, lapses = np.resize(x[4 : 4 + rates], 2), np.resize(x[4 + rates :], 2)
        return -log_likelihood(
            core,
            [INNER, OUTER],
            x[:2].tolist(),
            x[2:4].tolist(),
            np.resize(guesses, 2).tolist(),
            np.resize(lapses, 2).tolist(),
        )

    bounds = Bounds(
        [3.0] * 2 + [-1.5] * 2 + [0.0] * 2 * rates, [9.0] * 2 + [1.5] * 2 + [0.4] * rates + [0.5] * rates
    )
    found = differential_evolution(loss, bounds, seed=1, tol=1e-10, maxiter=300, popsize=8)
    assert fitted.log_likelihood == pytest.approx(-found.fun, abs=2e-4)
    if kind == "shared":
        assert fitted.curves[0].guess == fitted.curves[1].guess
        assert fitted.curves[0].guess == pytest.approx(found.x[4], abs=0.01)


@pytest.mark.parametrize("felt", [(1, 0, 0), (0, 2, 0, 2)])
def test_answers_that_guesses_may_explain_against_a_global_search(felt: Sequence[int]) -> None:
    """There are several maxima: with guesses and hardly any rise, and with a rise and no guesses."""
    rows = [(25.0 * 2**place, float(each), 10.0) for place, each in enumerate(felt)]
    condition = answers(rows, OCTAVES, (0, 12))
    fitted = fit([condition], Model(CORES["normal"], guess="free", lapse=0.02), OCTAVES)

    def loss(x: np.ndarray) -> float:
        return -log_likelihood(CORES["normal"], [condition], [x[0]], [x[1]], [x[2]], [0.02])

    bounds = Bounds([-20.0, -3.0, 0.0], [40.0, 1.5, 0.2])
    found = differential_evolution(loss, bounds, seed=1, tol=1e-10, maxiter=300, popsize=16)
    assert fitted.log_likelihood >= -found.fun - 2e-4


def test_fixed_rates_do_not_move_and_catch_trials_do_not_count_then() -> None:
    (one, _), (other, _) = (
        fit([each, OUTER], Model(guess=0.1, lapse=0.05), OCTAVES).curves
        for each in (INNER, answers([(25, 5, 10), (50, 8, 10), (100, 10, 10)], OCTAVES))
    )
    assert one == other
    assert (one.guess, one.lapse) == (0.1, 0.05)


def test_catch_trials_tell_the_guess_rate() -> None:
    rows = [(x, 0.0, 10.0) for x in LEVELS]
    with_catch = answers(rows[:1], OCTAVES, (3, 20))
    (curve,) = fit([with_catch], Model(guess="free", lapse=0.0), OCTAVES).curves
    assert curve.guess == pytest.approx(3 / 30, abs=1e-4)  # catch trials, and a level that nobody felt


def test_a_level_of_zero_is_no_stimulus_along_octaves() -> None:
    zero = answers([(0, 2, 8), (25, 3, 10), (50, 9, 10)], OCTAVES, (1, 4))
    assert zero.x.tolist() == [25, 50]
    assert (zero.catch_felt, zero.catch_n) == (3, 12)
    assert axis_of(np.array([0.0, 0.5, 1.0])) == OCTAVES
    assert axis_of(np.array([-0.5, 0.5, 1.0])) == Axis(logarithmic=False)


def test_rows_of_a_level_are_put_together() -> None:
    scattered = answers([(50, 1, 1), (25, 0, 1), (50, 0, 1), (25, 1, 2), (100, 1, 1), (7, 0, 0)], OCTAVES)
    assert scattered.x.tolist() == [25, 50, 100]
    assert scattered.felt.tolist() == [1, 1, 1]
    assert scattered.n.tolist() == [3, 2, 1]


@pytest.mark.parametrize(
    ("felt", "side"),
    [
        ([0, 0, 0], "above"),
        ([0, 0, 1], "above"),
        ([10, 10, 10], "below"),
        ([9, 10, 10], "below"),
    ],
)
def test_all_or_nothing_only_says_where_the_threshold_is(felt: list[float], side: str) -> None:
    for model in (EXACT, Model(), Model(CORES["Weibull"])):
        curve = curve_of(felt, model)
        if curve.threshold is None:
            assert curve.slope is None
            assert side in curve.notes[0]
        else:  # with a lapse rate one of ten missed is no surprise
            assert "extrapolated" in curve.notes[0]


def test_all_and_none_have_no_threshold() -> None:
    assert curve_of([0, 0, 0]).threshold is None
    assert curve_of([10, 10, 10]).threshold is None
    assert curve_of([0, 0, 0], Model(guess="free", lapse="free")).threshold is None


def test_separated_answers_are_a_step_between_two_levels() -> None:
    for model in (EXACT, Model(), Model(CORES["logistic"], "free", "free")):
        curve = curve_of([0, 0, 10], model)
        assert curve.slope == math.inf
        assert curve.threshold == pytest.approx(math.sqrt(50 * 100))
        assert "a step between 50 and 100" in curve.notes[0]


def test_a_step_may_be_at_a_level() -> None:
    curve = curve_of([0, 4, 10])
    assert curve.slope == math.inf
    assert curve.threshold == pytest.approx(50)
    assert curve.notes == ("a step at 50 is likeliest: infinite slope",)


@pytest.mark.parametrize("felt", [[8, 4, 1], [5, 5, 5], [6, 2, 6]])
def test_answers_that_do_not_rise_have_no_threshold(felt: list[float]) -> None:
    curve = curve_of(felt)
    assert curve.threshold is None
    assert curve.slope == 0
    assert "do not rise" in curve.notes[0]


def test_a_threshold_that_would_be_very_far_away_is_none() -> None:
    rows = [(1.0, 300.0, 1000.0), (2.0, 301.0, 1000.0)]
    (curve,) = fit([answers(rows, OCTAVES)], EXACT, OCTAVES).curves
    assert curve.threshold is None
    assert curve.slope == pytest.approx(0.0011, rel=0.1)  # 0.001 / density at z(0.3) * density at 0
    assert curve.notes == ("answers rise too little along the levels: no threshold",)


def test_an_extrapolated_threshold_is_said_to_be() -> None:
    curve = curve_of([1, 2, 4])
    assert curve.threshold is not None
    assert curve.threshold > 100
    assert curve.notes == ("threshold lies above the levels tested: extrapolated",)


def test_one_level_or_no_trial_is_no_function() -> None:
    one, none = (
        fit([answers(rows, OCTAVES)], EXACT, OCTAVES).curves[0] for rows in ([(25.0, 4.0, 10.0)], [])
    )
    assert (one.threshold, one.slope) == (None, None)
    assert one.notes == ("one level only: no function",)
    assert (none.threshold, none.notes) == (None, ("no trials",))


def test_a_rate_at_its_bound_is_said() -> None:
    curve = curve_of([5, 5, 6, 10, 10], Model(guess="free", lapse=0.0), (1, 2, 4, 64, 128))
    assert curve.guess == pytest.approx(0.4)
    assert "the guess rate is at the highest allowed, 0.4" in curve.notes


@given(
    felt=st.lists(st.integers(0, 6), min_size=5, max_size=5),
    scale=st.sampled_from([0.001, 0.1, 3.0, 1000.0]),
)
def test_units_do_not_matter(felt: list[int], scale: float) -> None:
    levels = np.array([3.0, 5.0, 8.0, 13.0, 21.0])
    model = Model(CORES["logistic"], guess=0.0, lapse=0.02)
    one, other = (
        fit([answers([(x, f, 6) for x, f in zip(k * levels, felt, strict=True)], OCTAVES)], model, OCTAVES)
        for k in (1.0, scale)
    )
    assert other.log_likelihood == pytest.approx(one.log_likelihood, abs=1e-6)
    here, there = one.curves[0], other.curves[0]
    if here.threshold is not None and here.threshold < 100 and here.slope and here.slope > 0.05:
        assert there.threshold == pytest.approx(scale * here.threshold, rel=1e-2)


def test_many_trials_recover_what_was_put_in() -> None:
    generator = np.random.default_rng(3)
    x = np.geomspace(0.05, 1, 9)
    for core in CORES.values():
        p = psychometric_function(core, OCTAVES, x, threshold=0.3, slope=0.6, guess=0.08, lapse=0.03)
        rows = list(zip(x, generator.binomial(4000, p), [4000.0] * 9, strict=True))
        catch = (float(generator.binomial(4000, 0.08)), 4000.0)
        (curve,) = fit([answers(rows, OCTAVES, catch)], Model(core, "free", "free"), OCTAVES).curves
        assert curve.threshold == pytest.approx(0.3, rel=0.03)
        assert curve.slope == pytest.approx(0.6, rel=0.08)
        assert curve.guess == pytest.approx(0.08, abs=0.01)
        assert curve.lapse == pytest.approx(0.03, abs=0.01)
