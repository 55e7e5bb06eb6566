"""Results that cannot be, and their likely cause."""

from datetime import UTC, datetime

import numpy as np
import pytest

from autd_trials.acoustics.air import Air
from autd_trials.calibration.pairing import pair_interpolated
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.solve import calibrate
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError
from tests.calibration.scenes import record, scene

TIME = datetime(2026, 11, 24, tzinfo=UTC)


def refusal(tracks: list[Track], settings: Settings | None = None) -> str:
    with pytest.raises(UsageError) as caught:
        calibrate(tracks, settings or Settings(), time=TIME, air=Air())
    return str(caught.value)


@pytest.mark.parametrize("method", ["joint", "paper"])
def test_one_sensor_for_two_units(method: str) -> None:
    """Two recordings of one sensor: the noise differs, the place does not."""
    tracks = record(scene(0, 0), 0.5, 20, np.random.default_rng(1))
    text = refusal(tracks, Settings(method="paper" if method == "paper" else "joint"))
    assert "unit 1 and unit 2 would stand in one place" in text
    assert "same sensor" in text


@pytest.mark.parametrize("viewpoint", [True, False])
def test_one_file_given_twice(viewpoint: bool) -> None:
    (track, _) = record(scene(0, 90), 0.5, 20, np.random.default_rng(2))
    twin = Track("unit 2", track.time_s, track.points_mm)
    assert "the same file was not given twice" in refusal([track, twin], Settings(viewpoint=viewpoint))


@pytest.mark.parametrize("step_s", [-0.4, 0.15, 0.6])
def test_a_clock_that_steps_in_mid_recording(step_s: float) -> None:
    tracks = record(scene(0, 90), 0.5, 40, np.random.default_rng(3), clock_offset_s=0.1)
    time_s = tracks[1].time_s + np.where(tracks[1].time_s > 15, step_s, 0.0)
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(time_s)) > 0])
    stepped = Track("unit 2", time_s[rising], tracks[1].points_mm[rising])
    assert "the clock of unit 2 is not steady" in refusal([tracks[0], stepped])


def test_milliseconds_for_seconds() -> None:
    tracks = record(scene(0, 90), 0.5, 20, np.random.default_rng(4))
    slow = Track("unit 2", tracks[1].time_s * 1000, tracks[1].points_mm)
    assert "the points of unit 2 follow each other every 33.3 s, which looks like milliseconds" in refusal(
        [tracks[0], slow]
    )


def test_inches_for_millimetres() -> None:
    tracks = record(scene(0, 90), 0.5, 20, np.random.default_rng(5))
    inches = Track("unit 2", tracks[1].time_s, tracks[1].points_mm / 25.4)
    text = refusal([tracks[0], inches])
    assert "the points of unit 1 spread 25" in text


def test_a_clock_beyond_the_search_names_the_limit() -> None:
    tracks = record(scene(0, 90), 0.5, 40, np.random.default_rng(6), clock_offset_s=9.0)
    assert "clocks may differ by 5 s" in refusal(tracks)


def test_clocks_a_second_and_a_half_apart_are_found() -> None:
    for seed in range(3):
        generator = np.random.default_rng(seed)
        tracks = record(scene(0, 90), 0.5, 30, generator, clock_offset_s=1.5)
        pairs = pair_interpolated(tracks[0], tracks[1], generator)
        assert pairs.clock_offset_s == pytest.approx(1.5, abs=0.004)
