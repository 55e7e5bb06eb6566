"""Poses of all units: outliers, biases, units that do not fit."""

import numpy as np
import pytest
from numpy.typing import NDArray

from autd_trials.calibration.registration import register_jointly, register_paper
from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
from autd_trials.calibration.sensor_model import SensorNoise
from autd_trials.errors import UsageError
from tests.calibration.scenes import Scene, cube, scene

NAMES = ("unit 1", "unit 2", "unit 3")


def observed(
    around: Scene, generator: np.random.Generator, bias_mm: float = 0, wrong: float = 0
) -> NDArray[np.float64]:
    cloud = cube(119, 500, generator)
    units = range(len(around.poses))
    seen = [around.seen(cloud, unit, generator, bias_mm=bias_mm) for unit in units]
    for unit in units[1:]:
        outliers = generator.random(119) < wrong
        seen[unit][outliers] = around.poses[unit].inverse().apply(cube(int(outliers.sum()), 500, generator))
    return np.array(seen)


def test_the_noise_is_not_trimmed_by_the_gate() -> None:
    scales = []
    for seed in range(20):
        generator = np.random.default_rng(seed)
        found = register_jointly(observed(scene(0, 90), generator, wrong=0.3), NAMES[:2], generator)
        assert found.joint is not None
        scales.append(found.joint.noise_scale)
    assert np.mean(scales) == pytest.approx(1, abs=0.04)


def test_a_range_bias_of_20_mm_costs_the_paper_19_mm_and_us_one() -> None:
    ours, paper = [], []
    for seed in range(20):
        generator = np.random.default_rng(seed)
        around = scene(0, 60, generator=generator)
        seen = observed(around, generator, bias_mm=20)
        found = register_jointly(seen, NAMES[:2], generator)
        ours.append(around.centre_error_mm(found.motions[1]))
        paper.append(around.centre_error_mm(register_paper(seen, NAMES, NORMAL_MAD_FACTOR).motions[1]))
    assert np.median(ours) < 1.5
    assert np.median(paper) == pytest.approx(20 * 2 * np.sin(np.radians(30)), abs=2)


def test_three_units_with_outliers_of_their_own() -> None:
    generator = np.random.default_rng(1)
    around = scene(0, 70, -70)
    found = register_jointly(observed(around, generator, wrong=0.3), NAMES, generator)
    for unit in (1, 2):
        assert around.centre_error_mm(found.motions[unit], unit) < 1.5
        assert found.inliers[unit].mean() == pytest.approx(0.7, abs=0.12)
        gaps = found.gaps_mm(unit)
        assert np.nanmax(np.abs(gaps)) < 20
        assert (np.isnan(gaps[:, 0]) == ~(found.inliers[unit] & found.inliers[0])).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_mirrored_frames_are_told(axis: int) -> None:
    generator = np.random.default_rng(2)
    seen = observed(scene(0, 90), generator)
    seen[1, :, axis] *= -1
    with pytest.raises(UsageError, match="unit 2 are a mirror image of those of unit 1"):
        register_jointly(seen, NAMES[:2], generator)


def test_points_that_have_nothing_to_do_with_each_other_are_refused() -> None:
    generator = np.random.default_rng(3)
    seen = np.array([cube(119, 500, generator) + np.array([0, 0, 1200]) for _ in range(2)])
    with pytest.raises(UsageError, match="no pose brings the points of unit 2 and unit 1 together"):
        register_jointly(seen, NAMES[:2], generator)


def test_too_few_common_points_are_refused() -> None:
    generator = np.random.default_rng(4)
    seen = observed(scene(0, 90), generator)
    seen[1, 5:] = np.nan
    with pytest.raises(UsageError, match="have 5 points in common"):
        register_jointly(seen, NAMES[:2], generator)
    with pytest.raises(UsageError, match="have 5 points in common"):
        register_paper(seen, NAMES, NORMAL_MAD_FACTOR)


def test_perfect_points_are_no_problem() -> None:
    generator = np.random.default_rng(5)
    around = scene(0, 90)
    cloud = cube(50, 500, generator)
    seen = np.array([around.seen(cloud, unit, generator, SensorNoise(0, 0)) for unit in (0, 1)])
    found = register_jointly(seen, NAMES[:2], generator)
    assert around.centre_error_mm(found.motions[1]) < 1e-6
    assert found.inliers.all()
