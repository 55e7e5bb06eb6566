"""What the waving hand is told."""

import numpy as np

from autd_trials.calibration.guidance import Guidance, guide
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.track import Track
from tests.calibration.scenes import DISTANCE_MM, record, scene

CENTRE_MM = np.array([0.0, 0.0, DISTANCE_MM])


def guidance(tracks: list[Track], half_mm: float = 200) -> Guidance:
    return guide(tracks, RigidMotion.identity(), CENTRE_MM, half_mm, np.random.default_rng(1))


def test_plenty_of_good_points_lack_nothing() -> None:
    tracks = record(scene(0, 80), 0.5, 120, np.random.default_rng(1))
    told = guidance(tracks, half_mm=150)
    assert told.missing == ()
    assert told.overlap > 0.9
    # 9 + 1 + 1 mm^2 from the first sensor, and from the second a half to all of it, as it is interpolated
    assert told.residual_mm is not None
    assert np.sqrt(16) < told.residual_mm < np.sqrt(22)


def test_an_empty_part_is_named() -> None:
    tracks = record(scene(0, 80), 0.5, 60, np.random.default_rng(1))
    right = tracks[0].points_mm[:, 0] > 0
    half = Track(tracks[0].name, tracks[0].time_s[right], tracks[0].points_mm[right])
    assert "wave it further: left (-x)" in guidance([half, tracks[1]]).missing


def test_units_that_saw_little_are_named() -> None:
    first, second = record(scene(0, 80), 0.5, 10, np.random.default_rng(1))
    few = Track(second.name, second.time_s[:20], second.points_mm[:20])
    told = guidance([first, few])
    assert told.missing == ("show the target to unit 2",)
    assert told.points == (300, 20)
    assert told.residual_mm is None


def test_what_hinders_a_pose_is_told_in_words() -> None:
    first, second = record(scene(0, 80), 0.5, 20, np.random.default_rng(1))
    told = guidance([first, Track(second.name, second.time_s + 100, second.points_mm)])
    assert "points in common" in told.missing[0]
    mirrored = Track(second.name, second.time_s, second.points_mm * np.array([-1.0, 1.0, 1.0]))
    assert "mirror image" in guidance([first, mirrored]).missing[0]
