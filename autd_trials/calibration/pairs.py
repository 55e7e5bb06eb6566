"""Points that are paired already, a row a point in two frames: no times, and so no clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import Vectors
from autd_trials.calibration.provenance import Source
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.sightings import Sightings
from autd_trials.calibration.solve import Solution, solve
from autd_trials.calibration.track import refuse_other_units_of_measure
from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, read_quantities

COLUMNS = ("x1_mm", "y1_mm", "z1_mm", "x2_mm", "y2_mm", "z2_mm")
"""Columns of a file of pairs: a point in the first unit's frame, and in the other one's."""

_FEWEST_POINTS = 4


@dataclass(frozen=True, eq=False)
class PairedPoints:
    """The same points in the frames of two units.

    Attributes
    ----------
    first, second
        Numbers of the units, from 1.
    points_first_mm, points_second_mm
        Where each frame has them, both (n, 3), in the order in which they were taken.
    """

    first: int
    second: int
    points_first_mm: Vectors
    points_second_mm: Vectors


def read_pairs(path: Path, second: int) -> PairedPoints:
    """Read a file of points in the frames of unit 1 and of another one (CSV).

    Raises
    ------
    UsageError
        The file cannot be read, has other columns or values, fewer than 4 points, or distances that cannot be
        millimetres.
    """
    rows = read_quantities(path, "file of pairs", list(map(Quantity, COLUMNS)), advice="mm in both frames")
    if len(rows) < _FEWEST_POINTS:
        raise UsageError(
            f"there are {len(rows)} pairs of points",
            where=str(path),
            do=f"give 100 or more all over the workspace; at least {_FEWEST_POINTS} are needed for a pose",
        )
    for points_mm in (rows[:, :3], rows[:, 3:]):
        refuse_other_units_of_measure(points_mm, path)
    return PairedPoints(1, second, rows[:, :3], rows[:, 3:])


def solve_pairs(
    pairs: Sequence[PairedPoints],
    names: Sequence[str],
    settings: Settings,
    *,
    time: datetime,
    air: Air,
    mounts: Sequence[RigidMotion] | None = None,
    inputs: dict[str, str] | None = None,
    sources: Sequence[Source] = (),
) -> Solution:
    """Return where the units stand; other parameters as for `autd_trials.calibration.solve.calibrate`.

    The frames are taken as without a viewpoint unless the settings say otherwise.

    Parameters
    ----------
    pairs
        Every unit but the first must be paired with the first one.
    names
        Of the units.

    Raises
    ------
    UsageError
        Pairs name units that do not exist or do not hold as many points in both frames; or as for tracks.
    """
    sightings = Sightings(names, _stacked(pairs, len(names)), viewpoint=False)
    return solve(sightings, settings, time=time, air=air, mounts=mounts, inputs=inputs, sources=sources)


def _stacked(pairs: Sequence[PairedPoints], units: int) -> NDArray[np.float64]:
    """Return all points in every unit's frame, shape (units, n, 3), NaN where a unit has none."""
    blocks = []
    for each in pairs:
        numbers = (each.first, each.second)
        if each.first == each.second or not all(1 <= number <= units for number in numbers):
            raise UsageError(f"points are paired between units {each.first} and {each.second} of {units}")
        if each.points_first_mm.shape != each.points_second_mm.shape:
            raise UsageError(f"units {each.first} and {each.second} have different numbers of paired points")
        block = np.full((units, len(each.points_first_mm), 3), np.nan)
        block[each.first - 1], block[each.second - 1] = each.points_first_mm, each.points_second_mm
        blocks.append(block)
    return np.concatenate(blocks, axis=1)
