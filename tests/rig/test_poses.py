"""What a rig's calibrated and true poses do to the force that a simulated participant feels."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import yaml

from autd_trials.array.geometry import moved
from autd_trials.clock import VirtualClock
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.participants.traits import PREDICTED_FORCE_MN
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.schema import Protocol
from autd_trials.rig.build import Builder
from autd_trials.rig.load import load_rig
from autd_trials.yamlfile.shipped import find_file

NOW = datetime(2026, 11, 24, tzinfo=UTC)


@pytest.fixture
def protocol() -> Protocol:
    return load_protocol(find_protocol("chest"))


def write_rig(folder: Path, *, shift_z_mm: float | None = None, units: int = 2, **changes: object) -> Path:
    """Write the emulated rig with unit 2 really standing elsewhere, and return its file."""
    shipped = find_file("emulated", kind="rig", folder="rigs")
    rig = yaml.safe_load(shipped.read_text())
    calibration = yaml.safe_load(shipped.with_name("emulated-calibration.yaml").read_text())
    calibration["time"] = "2026-11-22T00:00:00Z"
    (folder / "calibration.yaml").write_text(yaml.safe_dump(calibration))
    rig["calibration"] = {"file": "calibration.yaml"}
    if shift_z_mm is not None:
        rig["calibration"]["true_file"] = "true.yaml"
        calibration["units"][-1]["translation_mm"][2] += shift_z_mm
        calibration["units"] = calibration["units"][:units]
        (folder / "true.yaml").write_text(yaml.safe_dump(calibration))
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump({**rig, **changes}))
    return path


def made_real(folder: Path, path: Path) -> Path:
    """Turn a written rig into one with a real array and a measured calibration."""
    calibration = yaml.safe_load((folder / "calibration.yaml").read_text())
    calibration |= {"made_up": False, "origin": "measured", "taken": "2026-11-22T00:00:00Z"}
    (folder / "calibration.yaml").write_text(yaml.safe_dump(calibration))
    rig = yaml.safe_load(path.read_text())
    rig["array"]["link"] = {"interface": "none0"}
    rig["array"]["limits"]["largest_ear_level_db"] = 100
    path.write_text(yaml.safe_dump(rig))
    return path


def predicted_mn(path: Path, protocol: Protocol) -> float:
    builder = Builder(load_rig(str(path), NOW), protocol, VirtualClock(NOW), virtual=True)
    return builder.predicted_force_mn()["chest"]


def test_the_emulated_rig_has_the_force_that_participants_are_tuned_for(
    tmp_path: Path, protocol: Protocol
) -> None:
    assert predicted_mn(write_rig(tmp_path), protocol) == pytest.approx(PREDICTED_FORCE_MN, rel=1e-3)


def test_a_wrong_calibration_costs_force(tmp_path: Path, protocol: Protocol) -> None:
    forces_mn = [predicted_mn(write_rig(tmp_path, shift_z_mm=shift), protocol) for shift in (0.0, 8.0, 20.0)]
    assert forces_mn == sorted(forces_mn, reverse=True)
    assert forces_mn[0] == pytest.approx(PREDICTED_FORCE_MN, rel=1e-3)
    assert forces_mn[2] < 0.65 * forces_mn[0]


def test_the_array_is_driven_by_the_calibrated_poses(tmp_path: Path, protocol: Protocol) -> None:
    loaded = load_rig(str(write_rig(tmp_path, shift_z_mm=20.0)), NOW)
    calibrated, true = loaded.calibration.unit_poses(), loaded.true_calibration.unit_poses()
    expected = moved(calibrated[1], np.array([0.0, 0.0, 20.0]), np.zeros(3))
    assert np.allclose(true[1].translation_mm, expected.translation_mm)
    assert loaded.calibration.units == load_rig("emulated", NOW).calibration.units


def test_true_poses_of_a_real_array_are_refused(tmp_path: Path) -> None:
    path = made_real(tmp_path, write_rig(tmp_path, shift_z_mm=20.0))
    with pytest.raises(UsageError, match="for emulated rigs"):
        load_rig(str(path), NOW)


def test_true_poses_of_other_units_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="a calibration of unit 1; the rig's units are unit 1, unit 2"):
        load_rig(str(write_rig(tmp_path, shift_z_mm=0.0, units=1)), NOW)


def test_a_real_array_needs_the_place_of_the_head(tmp_path: Path, protocol: Protocol) -> None:
    loaded = load_rig(str(made_real(tmp_path, write_rig(tmp_path))), NOW)
    headless = protocol.model_copy(update={"head": None})
    with pytest.raises(UnsafeError, match="does not say where the head is"):
        Builder(loaded, headless, VirtualClock(NOW), virtual=True).array()
    Builder(loaded, protocol, VirtualClock(NOW), virtual=True).array()
    Builder(load_rig("emulated", NOW), headless, VirtualClock(NOW), virtual=True).array()
