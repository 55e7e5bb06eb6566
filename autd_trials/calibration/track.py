"""Tracks: where a unit's sensor saw the target, and when; and wands, as one sensor saw them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.joint import Wand
from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, read_quantities

COLUMNS = ("t_s", "x_mm", "y_mm", "z_mm")
"""Columns of a track file; a column `quality` may follow."""

WAND_COLUMNS = ("ax_mm", "ay_mm", "az_mm", "bx_mm", "by_mm", "bz_mm")
"""Columns of a wand file: its two markers, either first."""

_FEWEST_POINTS = 10
_NEAREST_MM, _FARTHEST_MM = 50.0, 10_000.0
_WRONG_LENGTH_FACTOR = 5.0  # of the median deviation


@dataclass(frozen=True, eq=False)
class Track:
    """Times in s, shape (n,), rising, and points in mm in the sensor's own frame, shape (n, 3)."""

    name: str
    time_s: NDArray[np.float64]
    points_mm: Vectors


def read_track(path: Path, name: str) -> Track:
    """Read a track file (CSV) of the unit with a name.

    Raises
    ------
    UsageError
        The file cannot be read, has other columns, holds what is no finite number or times that do not rise,
        has fewer than 10 points, or distances that cannot be millimetres.
    """
    time_s, *places = COLUMNS
    rows = read_quantities(
        path,
        "track",
        [Quantity(time_s, rising=True), *map(Quantity, places)],
        advice="seconds and millimetres in the sensor's frame",
    )
    if len(rows) < _FEWEST_POINTS:
        raise UsageError(
            f"{name} saw the target {len(rows)} times, which is next to never",
            where=str(path),
            do="see that its sensor runs and sees the target, and wave it for three minutes",
        )
    _refuse_other_units_of_measure(rows[:, 1:], path)
    return Track(name, rows[:, 0], rows[:, 1:])


def read_wand(path: Path, length_mm: float) -> Wand:
    """Read what one unit's sensor saw of a wand (CSV); lengths far from their median are left out.

    Raises
    ------
    UsageError
        The file is wrong as for tracks, or its lengths are nowhere near the wand's.
    """
    rows = read_quantities(
        path,
        "wand file",
        [Quantity(name) for name in WAND_COLUMNS],
        advice="both markers in mm in the sensor's frame",
    )
    if len(rows) < _FEWEST_POINTS:
        raise UsageError(
            f"the wand was seen {len(rows)} times", where=str(path), do="show it in 60 poses or more"
        )
    _refuse_other_units_of_measure(rows[:, :3], path)
    lengths_mm = np.linalg.norm(rows[:, :3] - rows[:, 3:], axis=1)
    median_mm = float(np.median(lengths_mm))
    if not 0.8 * length_mm < median_mm < 1.25 * length_mm:
        raise UsageError(
            f"the markers are {median_mm:.0f} mm apart, the wand is {length_mm:g} mm long",
            where=str(path),
            do="correct --wand-length-mm: the distance between the middles of both markers",
        )
    deviations_mm = np.abs(lengths_mm - median_mm)
    right = deviations_mm <= _WRONG_LENGTH_FACTOR * np.median(deviations_mm)
    return Wand(rows[right, :3], rows[right, 3:], length_mm)


def _refuse_other_units_of_measure(points_mm: Vectors, path: Path) -> None:
    middle_mm = float(np.median(np.linalg.norm(points_mm, axis=1)))
    if middle_mm < _NEAREST_MM:
        raise UsageError(
            f"the target is {middle_mm:.3g} mm from the sensor, which looks like metres",
            where=str(path),
            do="multiply x, y and z by 1000",
        )
    if middle_mm > _FARTHEST_MM:
        raise UsageError(
            f"the target is {middle_mm / 1000:.3g} m from the sensor, which looks like micrometres",
            where=str(path),
            do="give x, y and z in millimetres",
        )
