"""Calibration files: what is accepted, what is refused and where."""

from pathlib import Path

import numpy as np
import pytest

from autd_trials.array.geometry import UnitPose, transducer_positions_mm
from autd_trials.calibration.file import load_calibration
from autd_trials.errors import UsageError
from autd_trials.yamlfile.shipped import find_file

SHIPPED = find_file("emulated-calibration", kind="calibration", folder="rigs")
TARGET_MM = np.array([302.0, 225.0, 1000.0])


@pytest.fixture
def shipped_units() -> list[UnitPose]:
    return load_calibration(SHIPPED)[0].unit_poses()


def changed(tmp_path: Path, old: str, new: str) -> Path:
    text = SHIPPED.read_text()
    assert old in text
    path = tmp_path / "calibration.yaml"
    path.write_text(text.replace(old, new))
    return path


def test_the_shipped_calibration_says_that_it_is_made_up() -> None:
    calibration, sha256 = load_calibration(SHIPPED)
    assert calibration.made_up
    assert "MADE UP" in SHIPPED.read_text().splitlines()[0]
    assert len(sha256) == 64


def test_the_shipped_units_look_at_one_point_a_metre_away_under_75_degrees(
    shipped_units: list[UnitPose],
) -> None:
    first, second = shipped_units
    ways_mm = [TARGET_MM - unit.centre_mm for unit in (first, second)]
    assert [np.linalg.norm(way) for way in ways_mm] == pytest.approx([1000, 1000], abs=1)
    cosine = ways_mm[0] @ ways_mm[1] / np.linalg.norm(ways_mm[0]) / np.linalg.norm(ways_mm[1])
    assert np.degrees(np.arccos(cosine)) == pytest.approx(75, abs=0.1)
    assert np.degrees(np.arccos(first.axis @ second.axis)) == pytest.approx(75, abs=1e-6)


def test_the_shipped_units_do_not_meet(shipped_units: list[UnitPose]) -> None:
    first_mm, second_mm = (transducer_positions_mm([unit]).reshape(-1, 3) for unit in shipped_units)
    assert min(np.linalg.norm(second_mm - place, axis=1).min() for place in first_mm) > 100


def test_what_is_not_a_rotation_is_refused_at_its_line(tmp_path: Path) -> None:
    path = changed(tmp_path, "0.258819045, 0.000000000, 0.965925826", "0.258819045, 0.000000000, 0.96")
    with pytest.raises(UsageError, match=r"calibration\.yaml:\d+:\d+: .*rotation.*not a rotation matrix"):
        load_calibration(path)


def test_a_reflection_is_refused(tmp_path: Path) -> None:
    path = changed(tmp_path, "[0.000000000, 1.000000000, 0.000000000]", "[0.0, -1.0, 0.0]")
    with pytest.raises(UsageError, match="determinant"):
        load_calibration(path)


def test_the_first_unit_must_be_the_frame(tmp_path: Path) -> None:
    path = changed(tmp_path, "translation_mm: [0.0, 0.0, 0.0]", "translation_mm: [1.0, 0.0, 0.0]")
    with pytest.raises(UsageError, match="the calibrated frame is the first unit's"):
        load_calibration(path)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("name: unit 2", "name: unit 1", "name of its own"),
        ("made_up: true", "", "made_up"),
        ("made_up: true", "made_up: true\nmade_by: me", "unknown key"),
        ("2026-11-22T00:00:00Z", "2026-11-22T00:00:00", "time"),
        ("inputs: {}", "inputs: {tracks.csv: abc}", "inputs"),
        ("-742.089177910", ".nan", "translation_mm"),
        ("[0.258819045, 0.000000000, 0.965925826]", "[0.258819045, 0.965925826]", "rotation"),
    ],
)
def test_other_mistakes_are_refused_with_their_key(
    tmp_path: Path, old: str, new: str, complaint: str
) -> None:
    with pytest.raises(UsageError, match=complaint):
        load_calibration(changed(tmp_path, old, new))


def test_residuals_counts_and_covariance_are_kept(tmp_path: Path) -> None:
    row = "[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]"
    measured = (
        "name: unit 2\n"
        "    residuals: {rms_mm: 1.8, largest_mm: 4.0}\n"
        "    counts: {points: 119, outliers: 7}\n"
        f"    covariance: [{', '.join([row] * 6)}]"
    )
    calibration, _ = load_calibration(changed(tmp_path, "name: unit 2", measured))
    unit = calibration.units[1]
    assert unit.residuals is not None
    assert unit.residuals.rms_mm == 1.8
    assert unit.counts is not None
    assert (unit.counts.points, unit.counts.outliers) == (119, 7)
    assert unit.covariance is not None
    assert np.array(unit.covariance).shape == (6, 6)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        load_calibration(tmp_path / "none.yaml")
