"""Where the transducers are: units of 3 x 3 devices, posed in the calibrated frame.

A unit's own frame has its origin at transducer 0 of its device 0 (a corner), x to the right, y up and z out
along the emission; right-handed, in mm. Dimensions are those of the AUTD3 device in its official SDK.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float64]

PITCH_MM = 10.16
DEVICE_WIDTH_MM = 192.0
DEVICE_HEIGHT_MM = 151.4
TRANSDUCERS_PER_DEVICE = 249
UNIT_COLUMNS = UNIT_ROWS = 3
DEVICES_PER_UNIT = UNIT_COLUMNS * UNIT_ROWS

_COLUMNS, _ROWS = 18, 14
_SCREW_HOLES = {(1, 1), (2, 1), (16, 1)}  # (column, row) on the board without a transducer


@dataclass(frozen=True, eq=False)
class DevicePose:
    """A device in the calibrated frame: its transducer 0 in mm, shape (3,), and rotation, shape (3, 3)."""

    origin_mm: Vectors
    rotation: Vectors


@dataclass(frozen=True, eq=False)
class UnitPose:
    """A unit in the calibrated frame: a point p of its own frame lies at ``rotation @ p + translation_mm``.

    Parameters
    ----------
    name
        What people call it.
    rotation
        Rotation matrix, shape (3, 3).
    translation_mm
        Place of the unit's origin in mm, shape (3,).
    """

    name: str
    rotation: Vectors
    translation_mm: Vectors

    @property
    def centre_mm(self) -> Vectors:
        """The middle of the unit's transducers in mm, shape (3,)."""
        width_mm = (UNIT_COLUMNS - 1) * DEVICE_WIDTH_MM + (_COLUMNS - 1) * PITCH_MM
        height_mm = (UNIT_ROWS - 1) * DEVICE_HEIGHT_MM + (_ROWS - 1) * PITCH_MM
        centre_mm: Vectors = self.rotation @ np.array([width_mm / 2, height_mm / 2, 0.0])
        return centre_mm + self.translation_mm

    @property
    def axis(self) -> Vectors:
        """The direction of emission, a unit vector, shape (3,)."""
        return self.rotation[:, 2]


def device_poses(units: Sequence[UnitPose]) -> list[DevicePose]:
    """Return the devices of all units as they are wired: unit by unit, row by row from below."""
    return [
        DevicePose(unit.rotation @ corner_mm + unit.translation_mm, unit.rotation)
        for unit in units
        for corner_mm in _device_corners_mm()
    ]


def transducer_positions_mm(units: Sequence[UnitPose]) -> Vectors:
    """Return the transducers' positions in mm in the calibrated frame, shape (devices, 249, 3)."""
    places_mm = transducer_places_mm()
    return np.array([places_mm @ pose.rotation[:, :2].T + pose.origin_mm for pose in device_poses(units)])


def transducer_places_mm() -> Vectors:
    """Return the transducers' places on a device in mm, from transducer 0 on, shape (249, 2)."""
    places = [
        (column * PITCH_MM, row * PITCH_MM)
        for row in range(_ROWS)
        for column in range(_COLUMNS)
        if (column, row) not in _SCREW_HOLES
    ]
    return np.array(places)


def moved(unit: UnitPose, shift_mm: Vectors, rotation_deg: Vectors) -> UnitPose:
    """Return a unit turned about its centre and then shifted.

    Parameters
    ----------
    unit
        The unit.
    shift_mm
        Shift in mm in the calibrated frame, shape (3,).
    rotation_deg
        Rotation vector in degrees in the calibrated frame, shape (3,).
    """
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(rotation_deg, degrees=True).as_matrix()
    translation_mm = turn @ (unit.translation_mm - unit.centre_mm) + unit.centre_mm + shift_mm
    return UnitPose(unit.name, turn @ unit.rotation, translation_mm)


def is_rotation(matrix: Vectors, tolerance: float = 1e-6) -> bool:
    """Return whether a (3, 3) matrix is a proper rotation: orthonormal rows and determinant +1."""
    orthonormal = np.allclose(matrix @ matrix.T, np.eye(3), rtol=0, atol=tolerance)
    return bool(orthonormal and abs(np.linalg.det(matrix) - 1) <= tolerance)


def _device_corners_mm() -> Iterator[Vectors]:
    for row in range(UNIT_ROWS):
        for column in range(UNIT_COLUMNS):
            yield np.array([column * DEVICE_WIDTH_MM, row * DEVICE_HEIGHT_MM, 0.0])
