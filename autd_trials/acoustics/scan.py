"""Microphone scans: the grid for a scanning robot, and a measured scan laid over the prediction."""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.field import Progress, grid_pressure, pressure
from autd_trials.acoustics.grid import Grid
from autd_trials.acoustics.sources import Medium, Sources, Vectors
from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, read_quantities

COLUMNS = ("x_mm", "y_mm", "z_mm", "p_pa")
"""Columns of a scan; `p_pa` is the rms pressure."""

LARGEST_SHIFT_MM = 40.0

_FEWEST_POINTS, _MOST_POINTS = 10, 100_000
_FARTHEST_MM = 10_000.0
_QUIETEST_PA, _LOUDEST_PA = 1e-6, 1e6
_LARGEST_GRID = 10_000_000  # points of the prediction around a scan: 0.3 GB
_THINNEST_MM = 1.0  # a scan thinner than this along an axis shows no shift along it
_STEP_MM = 1.0
_COARSE_STEPS_MM = {1: 1.0, 2: 2.0, 3: 3.0}  # by the number of axes; the fringes of two units are 7 mm apart
_POINTS_IN_SEARCH = 300
_STARTS = 5
_MOST_PAIRED = 1_000  # points of which all pairs are looked at
_DIRECTIONS = 1_000
_THRESHOLD = 2**-0.25  # of the pressure: 1 / sqrt 2 of the energy


@dataclass(frozen=True, eq=False)
class Scan:
    """Rms pressures in Pa, shape (n,), at points in mm, shape (n, 3)."""

    points_mm: Vectors
    rms_pa: NDArray[np.float64]


@dataclass(frozen=True)
class ScanComparison:
    """A measured scan against the prediction.

    The measured field is the predicted one moved by `shift_mm` and multiplied by `level_db`; `residual` is
    what is left, as the rms over the rms of the measured. Along an axis in which the scan has no extent the
    shift is 0 and `axes_seen` is less than 3. Sizes are the largest distances between scanned points over
    1 / sqrt 2 of the largest energy.
    """

    points: int
    axes_seen: int
    shift_mm: tuple[float, float, float]
    level_db: float
    residual: float
    size_measured_mm: float
    size_predicted_mm: float


def read_scan(path: Path) -> Scan:
    """Read a scan.

    Raises
    ------
    UsageError
        The file cannot be read, has other columns, holds what is not a finite number or not a place or a
        pressure, has fewer than 10 or more than 100,000 points, or no sound in it.
    """
    *axes, pressure_name = COLUMNS
    values = read_quantities(
        path,
        "scan",
        [
            *(Quantity(name, -_FARTHEST_MM, _FARTHEST_MM) for name in axes),
            Quantity(pressure_name, 0, _LOUDEST_PA),
        ],
        advice="millimetres, and the rms pressure in Pa",
    )
    if not _FEWEST_POINTS <= len(values) <= _MOST_POINTS:
        raise UsageError(
            f"the scan has {len(values)} points",
            where=str(path),
            do=f"give {_FEWEST_POINTS} to {_MOST_POINTS:,}",
        )
    scan = Scan(values[:, :3], values[:, 3])
    if scan.rms_pa.max() < _QUIETEST_PA:
        raise UsageError(
            f"no pressure in the scan is over {scan.rms_pa.max():g} Pa, so nothing was heard",
            where=str(path),
            do="see that the array emitted, that the microphone was on and that p_pa is in Pa",
        )
    return scan


def compare_scan(scan: Scan, sources: Sources, medium: Medium) -> ScanComparison:
    """Find the shift and the gain that lay the predicted field over a measured scan.

    The shift is looked for within 40 mm, first on a coarse grid, then by the simplex method; the gain follows
    by least squares.

    Parameters
    ----------
    scan
        What was measured.
    sources, medium
        What is predicted.
    """
    axes = _seen_axes(scan.points_mm)
    best = _best_shift(scan, axes, sources, medium)
    exact = np.abs(pressure(sources, medium, scan.points_mm - best @ axes)) / math.sqrt(2)
    gain = _gain(scan.rms_pa, exact)
    x, y, z = (float(value) for value in best @ axes)
    return ScanComparison(
        points=len(scan.rms_pa),
        axes_seen=len(axes),
        shift_mm=(x, y, z),
        level_db=20 * math.log10(gain),
        residual=float(np.linalg.norm(scan.rms_pa - gain * exact) / np.linalg.norm(scan.rms_pa)),
        size_measured_mm=size_mm(scan.points_mm, scan.rms_pa),
        size_predicted_mm=size_mm(scan.points_mm, exact),
    )


def write_scan(
    path: Path, grid: Grid, sources: Sources, medium: Medium, progress: Progress | None = None
) -> int:
    """Write a grid for a scanning robot, to and fro, with the predicted rms pressure; return the points.

    Raises
    ------
    UsageError
        If there is such a file already, or it cannot be written.
    """
    rms_pa = np.abs(grid_pressure(sources, medium, grid, progress)) / math.sqrt(2)
    try:
        with path.open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            for index in _to_and_fro(grid.counts):
                place = grid.origin_mm + np.array(index) @ grid.steps_mm
                writer.writerow([*(f"{x:.3f}" for x in place), f"{rms_pa[index]:.3f}"])
    except FileExistsError as error:
        raise UsageError("there is such a file already", where=str(path), do="choose another name") from error
    except OSError as error:
        raise UsageError(f"the file cannot be written: {error.strerror}", where=str(path)) from error
    return rms_pa.size


def _best_shift(scan: Scan, axes: Vectors, sources: Sources, medium: Medium) -> Vectors:
    """Return the shift along the axes that the scan sees, in mm, shape (axes,)."""
    from scipy.ndimage import map_coordinates, spline_filter
    from scipy.optimize import minimize

    predicted = _around(scan.points_mm, axes)
    strength = spline_filter(np.abs(grid_pressure(sources, medium, predicted)))
    places = (scan.points_mm - predicted.origin_mm) @ axes.T / _STEP_MM

    def misfit(shift_mm: Vectors, part: slice = slice(None)) -> float:
        moved = (places[part] - shift_mm / _STEP_MM).T
        values = map_coordinates(strength, moved, order=3, prefilter=False)
        measured = scan.rms_pa[part]
        return float(((measured - _gain(measured, values) * values) ** 2).sum())

    some = slice(None, None, -(-len(places) // _POINTS_IN_SEARCH))
    starts = sorted(_coarse_shifts(len(axes)), key=lambda shift_mm: misfit(shift_mm, some))[:_STARTS]
    ends = [
        minimize(misfit, at, method="Nelder-Mead", options={"initial_simplex": _simplex(at)}) for at in starts
    ]
    best: Vectors = min(ends, key=lambda end: end.fun).x
    return best


def _seen_axes(points_mm: Vectors) -> Vectors:
    """Return unit vectors along which the points extend, shape (axes, 3)."""
    centred = points_mm - points_mm.mean(axis=0)
    directions = np.linalg.svd(centred, full_matrices=False)[2]
    extents_mm = np.ptp(centred @ directions.T, axis=0)
    seen: Vectors = directions[extents_mm > _THINNEST_MM]
    if len(seen) == 0:
        raise UsageError("all points of the scan lie in one place", do="scan a line, a plane or a volume")
    return seen


def _around(points_mm: Vectors, axes: Vectors) -> Grid:
    """Return a grid along the axes that holds the points wherever they are moved to."""
    middle_mm = points_mm.mean(axis=0)
    along = (points_mm - middle_mm) @ axes.T
    lowest = along.min(axis=0) - LARGEST_SHIFT_MM - 2 * _STEP_MM
    highest = along.max(axis=0) + LARGEST_SHIFT_MM + 2 * _STEP_MM
    counts = tuple(int(n) for n in np.ceil((highest - lowest) / _STEP_MM) + 1)
    if math.prod(counts) > _LARGEST_GRID:
        spans = " x ".join(f"{span:.0f}" for span in np.ptp(along, axis=0))
        raise UsageError(
            f"the scan spans {spans} mm, too much to lay over the prediction",
            do="compare a smaller part of it, such as 200 mm in each direction",
        )
    return Grid(middle_mm + lowest @ axes, axes * _STEP_MM, counts)


def _coarse_shifts(axes: int) -> Iterator[Vectors]:
    steps = np.arange(-LARGEST_SHIFT_MM, LARGEST_SHIFT_MM + 1e-9, _COARSE_STEPS_MM[axes])
    for index in np.ndindex((len(steps),) * axes):
        yield steps[list(index)]


def _simplex(at: Vectors) -> Vectors:
    return np.vstack([at, at + np.eye(len(at))])


def _gain(measured: NDArray[np.float64], predicted: NDArray[np.float64]) -> float:
    square = float(predicted @ predicted)
    return max(float(measured @ predicted) / square, 1e-12) if square > 0 else 1e-12


def size_mm(points_mm: Vectors, rms_pa: NDArray[np.float64]) -> float:
    """Return the largest distance in mm between points of over 1 / sqrt 2 of the largest energy.

    Of more than 1,000 such points only the outermost are looked at, which is at most 0.3 % short.
    """
    from scipy.spatial.distance import pdist

    over = points_mm[rms_pa >= _THRESHOLD * rms_pa.max()]
    if len(over) > _MOST_PAIRED:
        over = over[_outermost(over)]
    return float(pdist(over).max()) if len(over) > 1 else 0.0


def _outermost(points_mm: Vectors) -> NDArray[np.intp]:
    """Return which points lie outermost along 1,000 directions.

    They are a Fibonacci lattice on half a sphere: any direction is within 0.07 rad of one, so the largest
    distance between these points is at most 0.3 % short of that between all.
    """
    index = np.arange(_DIRECTIONS)
    height = (index + 0.5) / _DIRECTIONS
    angle = np.pi * (1 + math.sqrt(5)) * index
    radius = np.sqrt(1 - height**2)
    directions = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    ends = [end(points_mm @ direction) for direction in directions for end in (np.argmin, np.argmax)]
    return np.unique(ends)


def _to_and_fro(counts: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Yield all indices so that each is a neighbour of the one before."""
    if not counts:
        yield ()
        return
    for number, rest in enumerate(_to_and_fro(counts[:-1])):
        line = range(counts[-1]) if number % 2 == 0 else range(counts[-1] - 1, -1, -1)
        for last in line:
            yield (*rest, last)
