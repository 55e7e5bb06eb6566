"""Mounts files."""

from pathlib import Path

import numpy as np
import pytest

from autd_trials.calibration.mounts import load_mounts
from autd_trials.errors import UsageError

TEXT = """source: drawing of 2026-11-01
mounts:
  - unit: unit 1
    rotation: [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    translation_mm: [280, 470, 10]
"""


def test_a_mount_maps_from_the_sensor_to_the_unit(tmp_path: Path) -> None:
    path = tmp_path / "mounts.yaml"
    path.write_text(TEXT)
    mounts, sha256 = load_mounts(path)
    assert mounts.mounts[0].motion.apply(np.array([0.0, 0.0, 100.0])) == pytest.approx([280, 470, -90])
    assert len(sha256) == 64


def test_a_matrix_that_is_no_rotation_is_told_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "mounts.yaml"
    path.write_text(TEXT.replace("[0, 0, -1]]", "[0, 0, 1]]"))
    with pytest.raises(UsageError, match=r"mounts\.yaml:4:.*not a rotation matrix"):
        load_mounts(path)
