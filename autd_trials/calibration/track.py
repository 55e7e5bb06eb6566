"""Tracks: where a unit's sensor saw the target, and when; and wands, as one sensor saw them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.normal_equations import Wand
from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, read_quantities

COLUMNS = ("t_s", "x_mm", "y_mm", "z_mm")
"""Columns of a track file; a column `quality` may follow."""

WAND_COLUMNS = ("ax_mm", "ay_mm", "az_mm", "bx_mm", "by_mm", "bz_mm")
"""Columns of a wand file: its two markers, either first."""

_FEWEST_POINTS = 10
_LARGEST_IN_METRES = 12.0
_NEAREST_MM, _FARTHEST_MM = 50.0, 30_000.0
_SMALLEST_IN_MICROMETRES = 100_000.0
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
    refuse_other_units_of_measure(rows[:, 1:], path)
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
    refuse_other_units_of_measure(rows[:, :3], path)
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


def refuse_other_units_of_measure(points_mm: Vectors, path: Path) -> None:
    """Refuse coordinates that cannot be millimetres, and say what they look like.

    What counts is how far the points lie from the origin or, where that lies among them as in frames of
    motion capture, how far they spread.

    Raises
    ------
    UsageError
        They look like another unit of length.
    """
    away = float(np.median(np.linalg.norm(points_mm, axis=1)))
    spread = float(np.ptp(np.quantile(points_mm, (0.1, 0.9), axis=0), axis=0).max())
    size = max(away, spread)
    if size < _LARGEST_IN_METRES:
        what, do = "which looks like metres", "multiply x, y and z by 1000"
    elif size < _NEAREST_MM:
        what = "which looks like inches or centimetres"
        do = "multiply x, y and z by 25.4 if they are inches, by 10 if they are centimetres"
    elif size > _SMALLEST_IN_MICROMETRES:
        what, do = "which looks like micrometres", "divide x, y and z by 1000"
    elif size > _FARTHEST_MM:
        what = f"over {_FARTHEST_MM / 1000:g} m"
        do = "see that x, y and z are millimetres in the sensor's frame"
    else:
        return
    raise UsageError(f"the target is {size:.3g} mm from the sensor, {what}", where=str(path), do=do)
