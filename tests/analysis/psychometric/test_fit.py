"""Maximum likelihood against R's glm and SciPy's minimisers, and answers that tell no function."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pytest
from autd_analysis.psychometric.fit import NOT_AT_REST, Curve, fit
from autd_analysis.psychometric.functions import Axis, Core, psychometric_function, slope_per_steepness
from autd_analysis.psychometric.likelihood import Rate
from autd_analysis.psychometric.model import Answers, Model, answers, axis_of, problem
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import Bounds, differential_evolution
from scipy.special import xlogy

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


def highest_log_likelihood(core: Core, conditions: Sequence[Answers]) -> float:
    """Return the largest log likelihood with common guess and lapse rates, by differential evolution."""
    count = len(conditions)

    def loss(x: np.ndarray) -> float:
        rates = [[float(each)] * count for each in x[2 * count :]]
        return -log_likelihood(core, conditions, x[:count].tolist(), x[count : 2 * count].tolist(), *rates)

    bounds = Bounds([3.0] * count + [-1.5] * count + [0.0] * 2, [9.0] * count + [1.5] * count + [0.4, 0.5])
    return -float(differential_evolution(loss, bounds, seed=1, tol=1e-9, maxiter=200, popsize=8).fun)


@pytest.mark.parametrize("core", CORES.values(), ids=CORES)
@pytest.mark.parametrize("rates", ["shared", "free"])
def test_guess_and_lapse_shared_or_free_against_a_global_search(
    core: Core, rates: Literal["shared", "free"]
) -> None:
    fitted = fit([INNER, OUTER], Model(core, guess=rates, lapse=rates), OCTAVES)
    groups = [[INNER, OUTER]] if rates == "shared" else [[INNER], [OUTER]]
    highest = sum(highest_log_likelihood(core, group) for group in groups)
    assert fitted.log_likelihood == pytest.approx(highest, abs=2e-4)
    inner, outer = fitted.curves
    assert (inner.guess == outer.guess) is (rates == "shared")


AFTER_GUESSES, ALTERNATIVES = (Model(CORES["Weibull"], guess, "free") for guess in (0.25, 0.5))
LAPSE_FREE, BOTH_FREE = Model(CORES["Weibull"], 0.05, "free"), Model(CORES["logistic"], "free", "free")


@pytest.mark.parametrize(
    ("model", "felt", "n", "likeliest"),
    [
        # a step whose lapse rate is 0: steps of the common size did not let the rate move
        (LAPSE_FREE, (0, 1, 0, 0, 6), (6,) * 5, [(1, 24, 0.05), (6, 6, 1.0)]),
        # after it a lapse rate of 1 in 20
        (AFTER_GUESSES, (2, 3, 20, 18), (10, 10, 20, 20), [(5, 20, 0.25), (38, 40, 0.95)]),
        # a step with the largest lapse rate, which no coarse grid of rates knows
        (ALTERNATIVES, (17, 20, 24, 19, 23, 24), (40,) * 6, [(80, 160, 0.5), (23, 40, 0.575), (24, 40, 0.6)]),
        # nearly all felt: the flat function is likeliest, and a slightly rising one saturates
        (Model(CORES["normal"], 0.0, 0.1), (4, 5, 4), (4, 6, 5), [(13, 15, 13 / 15)]),
        # one slip in each half
        (BOTH_FREE, (1, 0, 0, 11, 12, 12), (12,) * 6, [(1, 36, 1 / 36), (35, 36, 35 / 36)]),
    ],
)  # fmt: skip
def test_steps_and_flat_functions_are_as_likely_as_their_shares(
    model: Model, felt: Sequence[int], n: Sequence[int], likeliest: Sequence[tuple[int, int, float]]
) -> None:
    rows = [(2.0**octave, float(f), float(k)) for octave, (f, k) in enumerate(zip(felt, n, strict=True))]
    fitted = fit([answers(rows, OCTAVES)], model, OCTAVES)
    expected = float(sum(xlogy(f, p) + xlogy(k - f, 1 - p) for f, k, p in likeliest))
    assert fitted.log_likelihood >= expected - 1e-7
    assert NOT_AT_REST not in fitted.curves[0].notes


def test_a_large_lapse_rate_is_found() -> None:
    x = np.geomspace(1, 64, 7)
    felt = 2000 * psychometric_function(CORES["normal"], OCTAVES, x, threshold=8, slope=0.6, lapse=0.45)
    rows = list(zip(x, felt, [2000.0] * 7, strict=True))
    (curve,) = fit([answers(rows, OCTAVES)], Model(guess=0.0, lapse="free"), OCTAVES).curves
    assert (curve.threshold, curve.slope, curve.lapse) == pytest.approx((8, 0.6, 0.45), rel=1e-4)


@settings(max_examples=50, deadline=None)
@given(
    felt=st.lists(st.integers(0, 8), min_size=3, max_size=7),
    core=st.sampled_from(list(CORES.values())),
    guess=st.sampled_from([0.0, 0.1, 0.5, "free"]),
    lapse=st.sampled_from([0.0, 0.02, 0.3, "free"]),
    seed=st.integers(0, 1000),
)
def test_no_other_function_is_likelier(
    felt: list[int], core: Core, guess: Rate, lapse: Rate, seed: int
) -> None:
    octaves = np.arange(len(felt), dtype=float)
    rows = [(2.0**octave, float(each), 8.0) for octave, each in zip(octaves, felt, strict=True)]
    model = Model(core, guess, lapse)
    fitted = fit([answers(rows, OCTAVES)], model, OCTAVES)
    generator = np.random.default_rng(seed)
    highest = model.highest_rates
    guesses, lapses = (
        generator.uniform(0, most, (500, 1)) if isinstance(rate, str) else np.full((500, 1), rate)
        for rate, most in zip((guess, lapse), highest, strict=True)
    )
    threshold, steepness = generator.uniform(-4, 10, (500, 1)), np.exp(generator.uniform(-3, 4, (500, 1)))
    p = guesses + (1 - guesses - lapses) * core.distribution(steepness * (octaves - threshold))[0]
    tried = (xlogy(felt, p) + xlogy(8 - np.array(felt), np.maximum(1 - p, 1e-300))).sum(axis=1)
    assert fitted.log_likelihood >= tried.max() - 1e-6


def test_what_is_not_at_rest_is_known() -> None:
    whole = problem([INNER], EXACT, OCTAVES)
    felt, (low, high) = whole.felt[None], whole.bounds()
    fitted = fit([INNER], EXACT, OCTAVES).parameters[None]
    assert whole.likelihood.at_rest(felt, fitted, (low[None], high[None]))[0]
    assert not whole.likelihood.at_rest(felt, fitted + np.array([0.3, 0.0]), (low[None], high[None]))[0]


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


@settings(max_examples=40, deadline=None)
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
