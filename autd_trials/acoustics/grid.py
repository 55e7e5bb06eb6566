"""Evenly spaced points on a line, a plane or in a volume, at any pose."""

import math
from dataclasses import dataclass

import numpy as np

from autd_trials.acoustics.sources import Vectors, refuse_wrong_array
from autd_trials.errors import UsageError

_DIMENSIONS = 3
_MOST_POINTS = 10_000_000  # 0.2 GB of complex pressures


@dataclass(frozen=True, eq=False)
class Grid:
    """Points ``origin_mm + i steps_mm[0] + j steps_mm[1] + ...``.

    Parameters
    ----------
    origin_mm
        The first point in mm, shape (3,).
    steps_mm
        One step along each axis in mm, shape (axes, 3), with 1 to 3 axes; any directions.
    counts
        How many points there are along each axis.

    Raises
    ------
    UsageError
        If a shape does not fit, a value is not finite, a count is less than 1, or there are over 10 million
        points.
    """

    origin_mm: Vectors
    steps_mm: Vectors
    counts: tuple[int, ...]

    def __post_init__(self) -> None:
        axes = len(self.counts)
        if not 1 <= axes <= _DIMENSIONS or min(self.counts) < 1:
            raise UsageError(
                f"the grid has {self.counts} points", do="give 1 to 3 axes with at least 1 point"
            )
        if math.prod(self.counts) > _MOST_POINTS:
            raise _too_many(f"{math.prod(self.counts):,}")
        refuse_wrong_array("the grid's origin_mm", self.origin_mm, (3,))
        refuse_wrong_array("the grid's steps_mm", self.steps_mm, (axes, 3))

    @property
    def points_mm(self) -> Vectors:
        """All points in mm, shape (n, 3), the last axis running fastest."""
        indices = np.indices(self.counts).reshape(len(self.counts), -1)
        points_mm: Vectors = self.origin_mm + indices.T @ self.steps_mm
        return points_mm


def box_grid(centre_mm: Vectors, axes: Vectors, *, width_mm: float, step_mm: float) -> Grid:
    """Return a line, square or cube around a point, which is one of its points.

    Parameters
    ----------
    centre_mm
        Its middle in mm, shape (3,).
    axes
        Unit vectors along its axes, shape (axes, 3).
    width_mm
        Least length of its sides in mm.
    step_mm
        Distance between neighbours in mm.
    """
    if not (0 < width_mm < math.inf and 0 < step_mm < math.inf):
        raise UsageError(f"a width of {width_mm:g} mm in steps of {step_mm:g} mm", do="give positive lengths")
    if width_mm / step_mm > _MOST_POINTS:
        raise _too_many(f"over {_MOST_POINTS:,}")
    half = int(np.ceil(width_mm / 2 / step_mm - 1e-9))
    steps_mm = np.asarray(axes, dtype=np.float64) * step_mm
    origin_mm = np.asarray(centre_mm, dtype=np.float64) - half * steps_mm.sum(axis=0)
    return Grid(origin_mm, steps_mm, (2 * half + 1,) * len(steps_mm))


def _too_many(points: str) -> UsageError:
    return UsageError(
        f"the grid has {points} points", do=f"give at most {_MOST_POINTS:,}: a smaller width or larger steps"
    )
