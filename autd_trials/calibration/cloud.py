"""The cloud of points that a calibration rests on: how large, how flat, where, and what it lacks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.errors import UsageError

ADVISED_HALF_EXTENT_MM = 250.0
ADVISED_ANGLE_DEG = 30.0
ADVISED_POINTS = 50
CELLS = 3
"""A workspace is looked at in 3 x 3 x 3 cells."""

_SPAN = (2.5, 97.5)  # percentiles: a few stray points make no cloud larger
_LINE_RATIO, _PLANE_RATIO = 0.1, 0.15
_LEAST_HALF_EXTENT_MM = 40.0
_LEAST_POINTS_IN_A_CELL = 5


@dataclass(frozen=True, eq=False)
class Cloud:
    """The right points of a calibration.

    `half_extents_mm` (3,) along the principal axes, the longest first; `angle_deg` is between the directions
    in which the two most different units look at the centre; None if they have no viewpoint.
    """

    points: int
    centre_mm: Vectors
    half_extents_mm: Vectors
    angle_deg: float | None

    @property
    def warnings(self) -> list[str]:
        """What the points see badly, and what to do."""
        warnings = []
        longest, middle, shortest = self.half_extents_mm
        if middle < ADVISED_HALF_EXTENT_MM:
            spans = " x ".join(f"{2 * half:.0f}" for half in self.half_extents_mm)
            warnings.append(
                f"the points span {spans} mm; wave the target over {2 * ADVISED_HALF_EXTENT_MM:.0f} mm in "
                "every direction, or the rotation stays uncertain"
            )
        if shortest < _PLANE_RATIO * longest:
            warnings.append(
                "the points lie almost in a plane; wave the target towards the units and away too"
            )
        if self.angle_deg is not None and self.angle_deg < ADVISED_ANGLE_DEG:
            warnings.append(
                f"the units look at the points from directions only {self.angle_deg:.0f} deg apart; "
                f"errors of the range are not seen well below {ADVISED_ANGLE_DEG:.0f} deg"
            )
        if self.points < ADVISED_POINTS:
            warnings.append(
                f"there are only {self.points} right points; {ADVISED_POINTS} or more are advised"
            )
        return warnings


def examine_cloud(places_mm: Vectors, sensors_mm: Vectors | None) -> Cloud:
    """Return what the cloud of right points is like.

    Parameters
    ----------
    places_mm
        The points in mm, shape (n, 3).
    sensors_mm
        Where the sensors stand in the same frame, shape (units, 3); None without viewpoints.

    Raises
    ------
    UsageError
        The points lie on a line or in one place, so that they do not give a pose.
    """
    centre_mm = places_mm.mean(axis=0)
    axes = np.linalg.svd(places_mm - centre_mm, full_matrices=False)[2]
    along = (places_mm - centre_mm) @ axes.T
    low, high = np.percentile(along, _SPAN, axis=0)
    half = np.sort((high - low) / 2)[::-1]
    _refuse_degenerate(half)
    angle_deg = None if sensors_mm is None else _largest_angle_deg(centre_mm - sensors_mm)
    return Cloud(len(places_mm), centre_mm, half, angle_deg)


def coverage(places_mm: Vectors, centre_mm: Vectors, half_mm: float) -> NDArray[np.int64]:
    """Return how many points lie in each cell of a cubic workspace, shape (3, 3, 3) over x, y, z.

    Parameters
    ----------
    places_mm
        The points in mm, shape (n, 3).
    centre_mm
        The workspace's centre in mm, shape (3,).
    half_mm
        Half its edge in mm.
    """
    edges = [np.linspace(middle - half_mm, middle + half_mm, CELLS + 1) for middle in centre_mm]
    return np.histogramdd(places_mm, bins=edges)[0].astype(np.int64)


def lacking_parts(cells: NDArray[np.int64], looked_at: float = 1.0) -> list[str]:
    """Name the faces of a workspace where most cells lack points, in the directions of unit 1's frame.

    Parameters
    ----------
    cells
        Points in each cell, shape (3, 3, 3).
    looked_at
        Share of all points that were counted.
    """
    enough = max(1.0, _LEAST_POINTS_IN_A_CELL * looked_at)
    names = (("left (-x)", "right (+x)"), ("low (-y)", "high (+y)"), ("near (-z)", "far (+z)"))
    lacking = []
    for axis, (first, last) in enumerate(names):
        for name, index in ((first, 0), (last, CELLS - 1)):
            face = np.take(cells, index, axis=axis)
            if (face < enough).sum() > face.size // 2:
                lacking.append(name)
    return lacking


def _refuse_degenerate(half_mm: Sequence[float] | Vectors) -> None:
    longest, middle, _ = half_mm
    if longest < _LEAST_HALF_EXTENT_MM:
        raise UsageError(
            f"all points lie within {2 * longest:.0f} mm: they do not tell how the units are turned",
            do=f"wave the target over {2 * ADVISED_HALF_EXTENT_MM:.0f} mm in every direction",
        )
    if middle < _LINE_RATIO * longest:
        raise UsageError(
            f"the points lie on a line ({2 * longest:.0f} mm long, {2 * middle:.0f} mm thick): a turn about "
            "it leaves them where they are",
            do=f"wave the target over {2 * ADVISED_HALF_EXTENT_MM:.0f} mm in every direction",
        )


def _largest_angle_deg(directions: Vectors) -> float:
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    cosines = np.clip(unit @ unit.T, -1, 1)
    return float(np.degrees(np.arccos(cosines.min())))
