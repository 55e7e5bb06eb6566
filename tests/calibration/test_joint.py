"""Joint maximum likelihood: its errors are as large as it says, for poses, biases and scales."""

import numpy as np
import pytest
from numpy.typing import NDArray

from autd_trials.calibration.joint import JointEstimate, fit_jointly
from autd_trials.calibration.normal_equations import Wand
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensor_model import Sensor, SensorNoise
from autd_trials.errors import UsageError
from tests.calibration.scenes import Scene, cube, scene

NOISE = SensorNoise(3.0, 1.0)
CAMERAS = [Sensor(NOISE)] * 3
TRUSTED = [Sensor(NOISE).trusted] * 3
CASES = 60


def observed(
    around: Scene, generator: np.random.Generator, bias_mm: float = 0, scale: float = 0, points: int = 119
) -> NDArray[np.float64]:
    cloud = cube(points, 500, generator)
    units = range(len(around.poses))
    return np.array([around.seen(cloud, unit, generator, NOISE, bias_mm, scale) for unit in units])


def wands(around: Scene, generator: np.random.Generator, bias_mm: float, scale: float) -> list[Wand]:
    middles = cube(60, 400, generator)
    directions = generator.standard_normal((60, 3))
    half = 150 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    ends = (middles + half, middles - half)
    seen = [
        [around.seen(end, unit, generator, NOISE, bias_mm, scale) for end in ends]
        for unit in range(len(around.poses))
    ]
    return [Wand(first, second, 300.0) for first, second in seen]


def centre_sd_mm(estimate: JointEstimate, around: Scene, unit: int = 1) -> float:
    x, y, z = around.poses[0].inverse().apply(np.zeros(3)) - estimate.centre_mm
    lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
    return float(np.sqrt(np.trace(lever @ estimate.pose_covariance(unit) @ lever.T)))


def test_the_errors_are_as_large_as_the_covariance_says_and_below_plain_least_squares() -> None:
    errors, sds, scales = [], [], []
    for seed in range(CASES):
        generator = np.random.default_rng(seed)
        around = scene(0, 90, generator=generator)
        estimate = fit_jointly(observed(around, generator), around.motions, TRUSTED[:2])
        errors.append(around.centre_error_mm(estimate.motions[1]))
        sds.append(centre_sd_mm(estimate, around))
        scales.append(estimate.noise_scale)
    rms = np.sqrt(np.mean(np.square(errors)))
    # the mean of CASES squares of 3 axes scatters by sqrt(2 / (3 CASES)), its root by half of that
    assert rms == pytest.approx(np.mean(sds), rel=3 * 0.5 * np.sqrt(2 / (3 * CASES)) + 0.03)
    assert np.mean(sds) == pytest.approx(
        0.394, rel=0.06
    )  # the bound of this geometry; for few points a little more
    assert np.mean(scales) == pytest.approx(1, abs=0.03)


def test_the_noise_is_estimated_from_the_points() -> None:
    generator = np.random.default_rng(3)
    around = scene(0, 90)
    half = Sensor(SensorNoise(NOISE.along_mm / 2, NOISE.across_mm / 2)).trusted
    estimate = fit_jointly(observed(around, generator), around.motions, [half, half])
    assert estimate.noise_scale == pytest.approx(2, abs=0.2)


def test_three_units_know_the_poses_better_than_two() -> None:
    generator = np.random.default_rng(4)
    three = scene(0, 60, 120)
    seen = observed(three, generator)
    both = fit_jointly(seen, three.motions, TRUSTED)
    alone = fit_jointly(seen[:2], three.motions[:2], TRUSTED[:2])
    assert centre_sd_mm(both, three) < centre_sd_mm(alone, three)
    assert three.centre_error_mm(both.motions[1]) < 1.5
    assert three.centre_error_mm(both.motions[2], unit=2) < 1.5


def test_a_unit_may_miss_points() -> None:
    generator = np.random.default_rng(5)
    around = scene(0, 60, 120)
    seen = observed(around, generator)
    for unit in (0, 1, 2):
        seen[unit, unit::4] = np.nan
    estimate = fit_jointly(seen, around.motions, TRUSTED)
    assert around.centre_error_mm(estimate.motions[2], unit=2) < 2
    assert estimate.noise_scale == pytest.approx(1, abs=0.15)


def test_range_biases_that_the_points_show_are_corrected_with_their_uncertainty() -> None:
    errors, ratios = [], []
    for seed in range(CASES // 2):
        generator = np.random.default_rng(100 + seed)
        around = scene(0, 60, generator=generator)
        known = [Sensor(NOISE, scale_sd=0.0)] * 2
        estimate = fit_jointly(observed(around, generator, bias_mm=20), around.motions, known)
        assert estimate.range_corrected
        ratios.append((estimate.range_errors.biases_mm - 20) / estimate.bias_sd_mm)
        errors.append(around.centre_error_mm(estimate.motions[1]))
    assert np.abs(np.mean(ratios)) < 0.45
    assert np.std(ratios) == pytest.approx(1, abs=0.25)
    assert np.median(errors) < 1.5  # 20 mm with the ranges as they are read


def test_a_range_bias_that_is_not_there_changes_nothing_but_what_is_claimed() -> None:
    for seed in range(10):
        generator = np.random.default_rng(300 + seed)
        around = scene(0, 20, generator=generator)
        seen = observed(around, generator)
        blind = fit_jointly(seen, around.motions, TRUSTED[:2])
        aware = fit_jointly(seen, around.motions, [Sensor(NOISE, scale_sd=0.0)] * 2)
        assert not aware.range_corrected
        assert aware.motions[1].translation_mm == pytest.approx(blind.motions[1].translation_mm, abs=1e-3)
        assert centre_sd_mm(aware, around) > 1.5 * centre_sd_mm(blind, around)


def test_a_scale_of_all_ranges_is_invisible_and_so_it_is_claimed_to_be_unknown() -> None:
    generator = np.random.default_rng(8)
    around = scene(0, 90)
    estimate = fit_jointly(observed(around, generator, 2, 0.005), around.motions, CAMERAS[:2])
    error_mm = around.centre_error_mm(estimate.motions[1])
    assert error_mm > 5
    assert error_mm < 2 * centre_sd_mm(estimate, around)
    assert estimate.scale_sd == pytest.approx(0.005, rel=0.5)


def test_a_bias_that_no_sensor_has_is_refused() -> None:
    generator = np.random.default_rng(9)
    around = scene(0, 90)
    with pytest.raises(UsageError, match="ask for a range that is wrong by"):
        fit_jointly(observed(around, generator, bias_mm=200), around.motions, CAMERAS[:2])


@pytest.mark.parametrize(("points", "seed"), [(60, 0), (60, 2)])
def test_a_fit_that_does_not_settle_is_refused(points: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    nothing_alike = np.array([cube(points, 500, generator) + np.array([0, 0, 1200]) for _ in range(2)])
    with pytest.raises(UsageError, match="the poses do not settle"):
        fit_jointly(nothing_alike, scene(0, 90).motions, CAMERAS[:2])


def test_a_wand_tells_bias_and_scale_apart() -> None:
    errors, blind = [], []
    for seed in range(20):
        generator = np.random.default_rng(200 + seed)
        around = scene(0, 90, generator=generator)
        seen = observed(around, generator, bias_mm=5, scale=0.02)
        seen_wands = wands(around, generator, 5, 0.02)
        estimate = fit_jointly(seen, around.motions, CAMERAS[:2], wands=seen_wands)
        assert np.abs(estimate.range_errors.scales - 0.02).max() < 4 * estimate.scale_sd.max()
        errors.append(around.centre_error_mm(estimate.motions[1]))
        blind.append(around.centre_error_mm(fit_jointly(seen, around.motions, TRUSTED[:2]).motions[1]))
    assert np.median(errors) < 3
    assert np.median(blind) > 20


def test_a_start_far_away_ends_in_the_same_place() -> None:
    generator = np.random.default_rng(7)
    around = scene(0, 90)
    seen = observed(around, generator)
    near = fit_jointly(seen, around.motions, TRUSTED[:2])
    off = RigidMotion(around.motions[1].rotation, around.motions[1].translation_mm + np.array([100, -50, 80]))
    far = fit_jointly(seen, [around.motions[0], off], TRUSTED[:2])
    assert far.motions[1].translation_mm == pytest.approx(near.motions[1].translation_mm, abs=1e-3)
