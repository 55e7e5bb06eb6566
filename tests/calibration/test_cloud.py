"""The cloud of points: what is refused, what is warned of, what is lacking."""

import numpy as np
import pytest

from autd_trials.calibration.cloud import coverage, examine_cloud, lacking_parts
from autd_trials.errors import UsageError

SENSORS_MM = np.array([[0.0, 0, -1200], [-1200.0, 0, 0]])


def test_a_good_cloud_has_no_warnings() -> None:
    points = np.random.default_rng(1).uniform(-400, 400, (200, 3))
    cloud = examine_cloud(points, SENSORS_MM)
    assert cloud.warnings == []
    assert cloud.angle_deg == pytest.approx(90, abs=3)
    assert cloud.half_extents_mm == pytest.approx([390, 390, 390], rel=0.12)


@pytest.mark.parametrize(
    ("scale", "sensors_mm", "count", "message"),
    [
        ((0.4, 0.4, 0.4), SENSORS_MM, 200, "wave the target over 500 mm"),
        ((1, 1, 0.1), SENSORS_MM, 200, "almost in a plane"),
        ((1, 1, 1), np.array([[0.0, 0, -1200], [-400.0, 0, -1200]]), 200, "directions only 18 deg apart"),
        ((1, 1, 1), SENSORS_MM, 40, "only 40 right points"),
    ],
)
def test_what_is_seen_badly_is_warned_of(
    scale: tuple[float, ...], sensors_mm: np.ndarray, count: int, message: str
) -> None:
    points = np.random.default_rng(2).uniform(-400, 400, (count, 3)) * scale
    (warning,) = (w for w in examine_cloud(points, sensors_mm).warnings if message in w)
    assert warning


@pytest.mark.parametrize(
    ("scale", "message"), [((1, 0.02, 0.02), "on a line"), ((0.05, 0.05, 0.05), "all points lie within")]
)
def test_what_gives_no_pose_is_refused(scale: tuple[float, ...], message: str) -> None:
    turned = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    points = (np.random.default_rng(3).uniform(-400, 400, (200, 3)) * scale) @ turned
    with pytest.raises(UsageError, match=message):
        examine_cloud(points, SENSORS_MM)


def test_the_part_that_lacks_points_is_named() -> None:
    points = np.random.default_rng(4).uniform(-300, 300, (3000, 3)) + np.array([10, 20, 30])
    cells = coverage(points, np.array([10, 20, 30]), 300)
    assert cells.sum() == 3000
    assert lacking_parts(cells) == []
    left_empty = coverage(points[points[:, 0] > -90], np.array([10, 20, 30]), 300)
    assert lacking_parts(left_empty) == ["left (-x)"]
