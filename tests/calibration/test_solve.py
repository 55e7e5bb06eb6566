"""From tracks to a calibration: mounts, covariances, the energy that is promised."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import UnitPose
from autd_trials.calibration.energy import predict_energy
from autd_trials.calibration.file import Calibration, load_calibration, write_calibration
from autd_trials.calibration.pose_error import energy_left
from autd_trials.calibration.report import report, report_text
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.solve import Solution, calibrate
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError
from tests.calibration.scenes import Scene, record, scene

TRUSTED = Settings(range_bias=False, range_scale_sd=0.0)
TIME = datetime(2026, 11, 24, tzinfo=UTC)
MOUNTS = [
    RigidMotion(
        Rotation.from_euler("xyz", [2, 3, 181], degrees=True).as_matrix(), np.array([280.0, 470.0, 10.0])
    ),
    RigidMotion(
        Rotation.from_euler("xyz", [-2, -2, 176], degrees=True).as_matrix(), np.array([290.0, 460.0, 5.0])
    ),
]


def solved(around: Scene, seed: int = 1, settings: Settings | None = None, bias_mm: float = 0) -> Solution:
    tracks = record(around, 0.5, 15, np.random.default_rng(seed), clock_offset_s=0.02, bias_mm=bias_mm)
    chosen = settings or replace(TRUSTED, seed=seed)
    return calibrate(tracks, chosen, time=TIME, air=Air(), mounts=MOUNTS)


def true_pose(around: Scene) -> RigidMotion:
    """Unit 2's pose in unit 1's frame, from where the sensors stand and how they are mounted."""
    return MOUNTS[0].after(around.motions[1]).after(MOUNTS[1].inverse())


def pose_error(solution: Solution, around: Scene) -> np.ndarray:
    """Error of unit 2's origin in mm and of its rotation in rad, shape (6,)."""
    true = true_pose(around)
    unit = solution.calibration.units[1]
    turn = Rotation.from_matrix(np.array(unit.rotation) @ true.rotation.T).as_rotvec()
    return np.concatenate([np.array(unit.translation_mm) - true.translation_mm, turn])


@pytest.fixture(scope="module")
def solutions() -> list[tuple[Scene, Solution]]:
    """Random scenes and what was solved from them."""
    scenes = [scene(0, 80, generator=np.random.default_rng(seed)) for seed in range(6)]
    return [(around, solved(around, seed)) for seed, around in enumerate(scenes)]


def test_the_error_at_the_units_origin_is_what_the_covariance_says(
    solutions: list[tuple[Scene, Solution]],
) -> None:
    squares = []
    for around, solution in solutions:
        error, covariance = pose_error(solution, around), np.array(solution.calibration.units[1].covariance)
        squares.append(error @ np.linalg.solve(covariance, error))
    # chi-square with 6 degrees of freedom: mean 6, sd 3.46; of 6, 1.4
    assert 2.5 < np.mean(squares) < 10


def test_the_predicted_energy_holds_the_true_one(solutions: list[tuple[Scene, Solution]]) -> None:
    inside = 0
    for around, solution in solutions:
        energy = solution.calibration.predicted_energy
        assert energy is not None
        true = true_pose(around)
        units = [
            UnitPose("unit 1", np.eye(3), np.zeros(3)),
            UnitPose("unit 2", true.rotation, true.translation_mm),
        ]
        left = energy_left(units, solution.calibration.unit_poses(), energy.target_mm, Air())
        inside += energy.low - 0.002 <= left <= energy.high + 0.002
        assert left > 0.9
    assert inside >= 5


def test_the_worse_the_pose_is_known_the_less_energy_is_promised() -> None:
    calibration = solved(scene(0, 80)).calibration
    unit = calibration.units[1]
    target = (0.0, 0.0, 1200.0)
    means = []
    for factor in (0.0, 100.0, 10_000.0):
        rows = tuple(tuple(factor * value for value in row) for row in unit.covariance or ())
        worse = unit.model_copy(update={"covariance": rows})
        changed = calibration.model_copy(update={"units": (calibration.units[0], worse)})
        energy = predict_energy(changed, target, Air(), np.random.default_rng(1), draws=40)
        assert energy is not None
        assert energy.low <= energy.mean <= energy.high
        means.append(energy.mean)
    assert means[0] == pytest.approx(1)
    assert means[0] > means[1] > means[2]
    assert means[2] < 0.5


def test_the_file_is_read_as_it_was_written_and_never_overwritten(tmp_path: Path) -> None:
    solution = solved(scene(0, 80))
    path = tmp_path / "calibration.yaml"
    write_calibration(solution.calibration, path)
    assert load_calibration(path)[0] == solution.calibration
    with pytest.raises(UsageError, match="exists already"):
        write_calibration(solution.calibration, path)
    with pytest.raises(UsageError, match="cannot be written"):
        write_calibration(solution.calibration, tmp_path / "none" / "calibration.yaml")


def test_the_same_tracks_and_seed_give_the_same_calibration() -> None:
    assert solved(scene(0, 80)).calibration == solved(scene(0, 80)).calibration


def test_range_biases_are_corrected_and_an_unseen_scale_takes_from_the_promise() -> None:
    around = scene(0, 60)
    asked = solved(around, bias_mm=20, settings=Settings())
    error = asked.calibration.units[1].range_error
    assert error is not None
    assert error.bias_mm == pytest.approx(20, abs=4 * error.bias_sd_mm)
    assert np.linalg.norm(pose_error(asked, around)[:3]) < 3
    assert any("this is corrected (unit 1 +" in warning for warning in asked.warnings)
    assert any("a wand of known length" in warning for warning in asked.warnings)
    trusted = solved(around)
    assert not any("range" in warning for warning in trusted.warnings)
    assert trusted.calibration.units[1].range_error is None
    energies = [each.calibration.predicted_energy for each in (solved(around, settings=Settings()), trusted)]
    assert energies[0] is not None
    assert energies[1] is not None
    assert energies[0].low < 0.8 < energies[1].low


def test_frames_without_a_viewpoint_are_declared_or_found_out() -> None:
    tracks = record(scene(0, 80), 0.5, 15, np.random.default_rng(4))
    shifted = Track(
        "unit 2", tracks[1].time_s, tracks[1].points_mm - [0, 0, 1200]
    )  # as motion capture has it
    found_out = calibrate([tracks[0], shifted], Settings(), time=TIME, air=Air())
    assert any("unit 2 lie all around the origin" in warning for warning in found_out.warnings)
    declared = calibrate([tracks[0], shifted], Settings(viewpoint=(True, False)), time=TIME, air=Air())
    assert not any("all around" in warning for warning in declared.warnings)
    for solution in (found_out, declared):
        assert solution.calibration.settings["viewpoint of unit 1"] is True
        assert solution.calibration.settings["viewpoint of unit 2"] is False
        assert solution.calibration.predicted_energy is None
        assert solution.calibration.units[1].range_error is None
    with pytest.raises(UsageError, match="viewpoints are given for 3 units, there are 2"):
        calibrate(tracks, Settings(viewpoint=(True,) * 3), time=TIME, air=Air())


def test_the_papers_method_knows_no_covariance_and_promises_no_energy() -> None:
    solution = solved(scene(0, 80), settings=Settings(method="paper", pairing="nearest", range_bias=False))
    calibration: Calibration = solution.calibration
    assert calibration.units[1].covariance is None
    assert calibration.predicted_energy is None
    assert "paper's equations 1 to 10" in calibration.method
    assert report(solution)["predicted_energy"] is None
    assert "residuals" in report_text(report(solution))


def test_the_report_tells_residuals_coverage_and_what_points_cannot_see() -> None:
    solution = solved(scene(0, 80))
    facts = report(solution)
    (unit,) = facts["units"]
    gaps = solution.gaps_mm(1)
    assert unit["rms_mm"] == pytest.approx(np.sqrt(np.nansum(gaps**2) / unit_points(gaps)), abs=1e-3)
    assert np.linalg.norm(unit["rms_per_axis_mm"]) == pytest.approx(unit["rms_mm"], abs=1e-3)
    assert len(unit["rms_over_time_mm"]) == 6
    assert unit["clock_offset_s"] == pytest.approx(0.02, abs=0.004)
    assert np.sum(facts["coverage"]["points_in_cells"]) <= facts["points"]
    text = report_text(facts)
    for part in ("unit 2: residuals", "clock +", "energy left at", "only sound can show it"):
        assert part in text


def unit_points(gaps: np.ndarray) -> int:
    return int((~np.isnan(gaps[:, 0])).sum())


def test_sensors_without_mounts_are_warned_of() -> None:
    tracks = record(scene(0, 80), 0.5, 20, np.random.default_rng(1))
    solution = calibrate(tracks, Settings(), time=TIME, air=Air())
    assert any("no mounts were given" in warning for warning in solution.warnings)


def test_a_repeated_error_makes_the_covariance_larger() -> None:
    tracks = record(scene(0, 80), 0.5, 20, np.random.default_rng(1))
    steady = calibrate(tracks, TRUSTED, time=TIME, air=Air(), mounts=MOUNTS)
    slow_mm = np.cumsum(np.random.default_rng(2).normal(0, 1, (len(tracks[1].time_s), 3)), axis=0) * 0.3
    slow_mm -= slow_mm.mean(axis=0)
    tracks[1].points_mm[:] += slow_mm
    wandering = calibrate(tracks, TRUSTED, time=TIME, air=Air(), mounts=MOUNTS)
    variances = [np.array(each.calibration.units[1].covariance)[0, 0] for each in (steady, wandering)]
    assert variances[1] > 3 * variances[0]
