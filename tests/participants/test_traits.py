"""The model of simulated participants against the numbers it was specified with."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from autd_trials.participants.traits import MEDIAN_THRESHOLDS_MN, ParticipantTraits, median_threshold_mn

MEDIAN = ParticipantTraits(threshold_offset_db=0.0, inner_loss_db=-3.0, outer_loss_db=-6.5, criterion=1.65)


def test_force_follows_drive_squared_and_power_loss() -> None:
    assert MEDIAN.force_mn(1.0, ()) == pytest.approx(20.0)
    assert MEDIAN.force_mn(0.5, ()) == pytest.approx(5.0)
    assert MEDIAN.force_mn(1.0, ("inner",)) == pytest.approx(20.0 * 10**-0.3)
    assert MEDIAN.force_mn(1.0, ("inner", "outer")) == pytest.approx(20.0 * 10**-0.95)
    assert MEDIAN.force_mn(0.0, ("inner",)) == 0.0


def test_thresholds_between_are_interpolated_and_held_outside() -> None:
    for modulation_hz, threshold_mn in MEDIAN_THRESHOLDS_MN.items():
        assert median_threshold_mn(modulation_hz) == pytest.approx(threshold_mn)
    assert median_threshold_mn(math.sqrt(25.0 * 50.0)) == pytest.approx(math.sqrt(10.0 * 6.0))
    assert median_threshold_mn(math.sqrt(50.0 * 100.0)) == pytest.approx(math.sqrt(6.0 * 3.0))
    assert median_threshold_mn(1.0) == 10.0
    assert median_threshold_mn(1000.0) == pytest.approx(3.0)


@given(st.floats(0.01, 1000.0))
def test_interpolation_is_that_of_numpy_in_log_log(modulation_hz: float) -> None:
    known_hz, known_mn = np.array(list(MEDIAN_THRESHOLDS_MN)), np.array(list(MEDIAN_THRESHOLDS_MN.values()))
    expected = np.exp(np.interp(np.log(modulation_hz), np.log(known_hz), np.log(known_mn)))
    assert median_threshold_mn(modulation_hz) == pytest.approx(expected)


def test_threshold_offset_is_in_decibels_of_force() -> None:
    deaf = ParticipantTraits(threshold_offset_db=20.0, inner_loss_db=-1, outer_loss_db=-1, criterion=1.65)
    assert deaf.threshold_mn(50.0) == pytest.approx(60.0)


def test_probability_at_threshold_and_without_force() -> None:
    # d' is 1.65 at threshold, so d' - c = 0 for the mean criterion
    assert MEDIAN.detection_probability(6.0, 6.0) == pytest.approx(0.5)
    assert MEDIAN.detection_probability(0.0, 6.0) == pytest.approx(0.01 + 0.98 * stats.norm.cdf(-1.65))


@given(force_mn=st.floats(0.0, 1e3), threshold_mn=st.floats(1e-3, 1e3), criterion=st.floats(-5.0, 5.0))
def test_probability_stays_between_the_lapses(force_mn: float, threshold_mn: float, criterion: float) -> None:
    traits = ParticipantTraits(0.0, -1.0, -1.0, criterion)
    assert 0.01 <= traits.detection_probability(force_mn, threshold_mn) <= 0.99


def test_population_is_drawn_as_specified() -> None:
    generator = np.random.default_rng(1)
    people = [ParticipantTraits.draw(generator) for _ in range(20_000)]
    offsets = np.array([traits.threshold_offset_db for traits in people])
    inner = np.array([traits.inner_loss_db for traits in people])
    outer = np.array([traits.outer_loss_db for traits in people])
    criteria = np.array([traits.criterion for traits in people])
    assert stats.kstest(offsets, stats.norm(0, 3).cdf).pvalue > 1e-3
    assert stats.kstest(criteria, stats.norm(1.65, 0.3).cdf).pvalue > 1e-3
    assert stats.kstest(inner[inner < -1], stats.truncnorm(-np.inf, 2, -3, 1).cdf).pvalue > 1e-3
    assert inner.max() == outer.max() == -1.0
    assert np.mean(outer == -1.0) == pytest.approx(stats.norm(-6.5, 4).sf(-1.0), abs=0.01)
    assert abs(np.corrcoef([offsets, inner, outer, criteria]) - np.eye(4)).max() < 0.03


def test_reaction_times_are_ex_gaussian() -> None:
    generator = np.random.default_rng(2)
    answers = [MEDIAN.answer(1e6, 100.0, generator) for _ in range(20_000)]
    times_s = np.array([answer for answer in answers if answer is not None])
    assert len(times_s) / len(answers) == pytest.approx(0.99, abs=0.004)
    assert stats.kstest(times_s, stats.exponnorm(0.15 / 0.07, loc=0.45, scale=0.07).cdf).pvalue > 1e-3


def test_answers_jitter_from_trial_to_trial() -> None:
    generator = np.random.default_rng(3)
    rate = np.mean([MEDIAN.answer(6.0, 50.0, generator) is not None for _ in range(20_000)])
    jitter = np.random.default_rng(4).normal(0, 1.5, 200_000)
    expected = np.mean(0.01 + 0.98 * stats.norm.cdf(1.65 / 10 ** (jitter / 20) - 1.65))
    assert rate == pytest.approx(expected, abs=4 * 0.5 / math.sqrt(20_000))
