"""Pairing in time: what clocks that differ do, and how the offset is found."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.calibration.pairing import LARGEST_GAP_S, pair_interpolated, pair_nearest
from autd_trials.calibration.registration import register_jointly, register_paper
from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError
from tests.calibration.scenes import record, scene

AROUND = scene(0, 90)
NAMES = ("unit 1", "unit 2")


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), offset_s=st.floats(-0.9, 0.9))
def test_the_offset_of_the_clocks_is_found(seed: int, offset_s: float) -> None:
    generator = np.random.default_rng(seed)
    tracks = record(AROUND, 0.5, 30, generator, clock_offset_s=offset_s)
    pairs = pair_interpolated(tracks[0], tracks[1], generator)
    assert pairs.clock_offset_s == pytest.approx(offset_s, abs=0.004)


@pytest.mark.parametrize("seed", [4, 20, 21])
def test_a_slow_hand_shows_the_clocks_offset_too(seed: int) -> None:
    """A pose that is slightly wrong hides most of an offset: both must be refined together."""
    generator = np.random.default_rng(seed)
    tracks = record(AROUND, 0.15, 20, generator, clock_offset_s=0.25)
    pairs = pair_interpolated(tracks[0], tracks[1], generator)
    assert pairs.clock_offset_s == pytest.approx(0.25, abs=0.008)


def test_interpolation_beats_nearest_stamps_at_1_m_s_with_20_ms_between_the_clocks() -> None:
    ours, nearest = [], []
    for seed in range(5):
        generator = np.random.default_rng(seed)
        tracks = record(AROUND, 1.0, 30, generator, clock_offset_s=0.02, jitter_s=0.002)
        pairs = pair_interpolated(tracks[0], tracks[1], generator)
        seen = np.array([tracks[0].points_mm, pairs.points_mm])
        ours.append(AROUND.centre_error_mm(register_jointly(seen, NAMES, generator).motions[1]))
        few = Track(NAMES[0], tracks[0].time_s[::7][:119], tracks[0].points_mm[::7][:119])
        seen = np.array([few.points_mm, pair_nearest(few, tracks[1]).points_mm])
        nearest.append(AROUND.centre_error_mm(register_paper(seen, NAMES, NORMAL_MAD_FACTOR).motions[1]))
    assert np.median(ours) < 0.4
    assert np.median(nearest) > 2 * np.median(ours)


def test_other_reflectors_in_a_third_of_the_frames_do_not_spoil_the_path() -> None:
    generator = np.random.default_rng(1)
    tracks = record(AROUND, 1.0, 30, generator, clock_offset_s=0.05, outliers=0.3)
    pairs = pair_interpolated(tracks[0], tracks[1], generator)
    assert pairs.clock_offset_s == pytest.approx(0.05, abs=0.002)
    seen = np.array([tracks[0].points_mm, pairs.points_mm])
    assert AROUND.centre_error_mm(register_jointly(seen, NAMES, generator).motions[1]) < 1.0


def test_nearest_takes_the_nearest() -> None:
    time_s = np.arange(10, dtype=np.float64) / 10
    first = Track("a", time_s, np.arange(30, dtype=np.float64).reshape(10, 3))
    second = Track("b", time_s + np.float64(0.04), np.arange(30, dtype=np.float64).reshape(10, 3))
    assert pair_nearest(first, second).points_mm == pytest.approx(second.points_mm)
    later = Track("b", time_s - np.float64(0.06), np.arange(30, dtype=np.float64).reshape(10, 3))
    assert pair_nearest(first, later).points_mm[0] == pytest.approx(later.points_mm[1])


def test_nothing_is_interpolated_over_a_gap() -> None:
    generator = np.random.default_rng(2)
    first, second = record(AROUND, 0.5, 20, generator)
    silent = (second.time_s > 8) & (second.time_s < 12)
    gappy = Track("unit 2", second.time_s[~silent], second.points_mm[~silent])
    pairs = pair_interpolated(first, gappy, generator)
    unseen = np.isnan(pairs.points_mm[:, 0])
    inside = (first.time_s > 8 + LARGEST_GAP_S) & (first.time_s < 12 - LARGEST_GAP_S)
    assert unseen[inside].all()
    assert unseen[~silent[: len(unseen)]].mean() < 0.1


def test_tracks_of_different_days_are_refused() -> None:
    generator = np.random.default_rng(3)
    first, second = record(AROUND, 0.5, 20, generator)
    second = Track("unit 2", second.time_s + 86400, second.points_mm)
    message = r"unit 1 and unit 2 have 0 points in common \(unit 1 0\.\d+ to 19\.9"
    with pytest.raises(UsageError, match=message):
        pair_nearest(first, second)
    with pytest.raises(UsageError, match=message):
        pair_interpolated(first, second, generator)
