"""How each unit's sensor is mounted: its pose in the unit's own frame."""

from pathlib import Path

import numpy as np
from pydantic import Field

from autd_trials.calibration.file import RotationRows, Row3, UnitName
from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.model import Model
from autd_trials.yamlfile import load_with_sha256


class Mount(Model):
    """One unit's sensor; a point p of its frame lies at ``rotation p + translation_mm`` in the unit's."""

    unit: UnitName = Field(description="Name of the unit.")
    rotation: RotationRows = Field(description="Rotation matrix, row by row.")
    translation_mm: Row3 = Field(description="The sensor's optical centre in the unit's frame, in mm.")

    @property
    def motion(self) -> RigidMotion:
        """From the sensor's frame to the unit's."""
        return RigidMotion(np.array(self.rotation), np.array(self.translation_mm))


class Mounts(Model):
    """The sensors of all units."""

    made_up: bool = Field(False, description="True for mounts that nobody measured.")
    source: str = Field(min_length=1, description="Drawing, measurement or acoustic refinement; who, when.")
    mounts: tuple[Mount, ...] = Field(min_length=1, description="One for each unit, in the order of wiring.")

    @property
    def capture(self) -> Capture:
        """Where they come from: made up, or measured as `source` says."""
        return Capture(origin="made up" if self.made_up else "measured", sensor="")


def load_mounts(path: Path) -> tuple[Mounts, str]:
    """Read a mounts file; return it and the SHA-256 of its bytes.

    Raises
    ------
    UsageError
        The file cannot be read or is wrong; the message has a line for each problem.
    """
    return load_with_sha256(path, Mounts)
