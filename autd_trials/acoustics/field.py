"""The pressure field of posed devices, fast: at any points, or on grids."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.grid import Grid
from autd_trials.acoustics.sources import Medium, Sources, Vectors, refuse_wrong_array
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from autd_trials.acoustics.kernels import Devices, Waves
    from autd_trials.acoustics.tile_kernels import Tiling

Pressures = NDArray[np.complex128]
Progress = Callable[[float], None]
"""Told the share of the work that is done, 0 to 1."""

_PAIRS_AT_ONCE = 100_000_000
_POINTS_AT_ONCE = 4_000_000
_TILE_MM = 40.0
_VECTOR = 32
_DIRECTIVITY_TERMS = 7


def pressure(
    sources: Sources, medium: Medium, points_mm: Vectors, progress: Progress | None = None
) -> Pressures:
    """Return the complex pressure at points.

    Parameters
    ----------
    sources, medium
        What emits, and what the sound goes through.
    points_mm
        Points in mm, shape (n, 3).
    progress
        Told how far it is.

    Returns
    -------
    ndarray of complex128
        Peak pressure in Pa, shape (n,). It differs from `reference_pressure` by less than 1e-5 of the largest
        value at the points; if the contributions cancel at all of them, by less than 5e-6 of the sum of the
        contributions' magnitudes.

    Raises
    ------
    UsageError
        If the points have a wrong shape, are none, are not finite, or lie inside a transducer.
    """
    from autd_trials.acoustics import kernels

    refuse_wrong_array("points_mm", points_mm, (len(points_mm), 3))
    points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
    devices, waves = _compiled(sources, medium)
    result = np.empty(len(points_mm), np.complex128)
    at_once = max(1, _PAIRS_AT_ONCE // max(1, sources.phases_turns.size))
    for begin in range(0, len(points_mm), at_once):
        part = slice(begin, begin + at_once)
        kernels.points_pressure(devices, waves, points_mm[part], result[part])
        _tell(progress, begin + at_once, len(points_mm))
    _refuse_inside(result, lambda index: points_mm[index])
    return result


def grid_pressure(
    sources: Sources, medium: Medium, grid: Grid, progress: Progress | None = None
) -> Pressures:
    """Return the complex pressure on a grid; like `pressure` at its points, and much faster.

    Parameters
    ----------
    sources, medium
        What emits, and what the sound goes through.
    grid
        Where.
    progress
        Told how far it is.

    Returns
    -------
    ndarray of complex128
        Peak pressure in Pa, in the shape of the grid's counts. It differs from `reference_pressure` by less
        than 1e-4 of the field's largest value.

    Raises
    ------
    UsageError
        If points lie inside a transducer.
    """
    from autd_trials.acoustics import tile_kernels

    devices, waves = _compiled(sources, medium)
    tiling = _tiling(grid)
    result = np.empty(tuple(tiling.counts), np.complex128)
    tiles = int(tiling.tiles.prod())
    at_once = max(2, _POINTS_AT_ONCE // int(tiling.tile.prod()))
    for begin in range(0, tiles, at_once):
        tile_kernels.tiles_pressure(devices, waves, tiling, begin, min(begin + at_once, tiles), result)
        _tell(progress, begin + at_once, tiles)
    result = result.reshape(grid.counts)
    _refuse_inside(
        result, lambda index: grid.origin_mm + np.array(np.unravel_index(index, grid.counts)) @ grid.steps_mm
    )
    return result


def _compiled(sources: Sources, medium: Medium) -> "tuple[Devices, Waves]":
    """Return sources and medium as the compiled loops need them."""
    from autd_trials.acoustics.kernels import Devices, Waves

    if len(medium.directivity) > _DIRECTIVITY_TERMS:
        raise UsageError("the directivity has too many terms", do=f"give at most {_DIRECTIVITY_TERMS}")
    middle_mm = (sources.places_mm.min(axis=0) + sources.places_mm.max(axis=0)) / 2
    places_mm = sources.places_mm - middle_mm
    half_x_mm, half_y_mm = np.abs(places_mm).max(axis=0)
    padding = -len(places_mm) % _VECTOR
    x_mm, y_mm = np.pad(places_mm, ((0, padding), (0, 0))).T
    silent = ((0, 0), (0, padding))
    devices = Devices(
        centres_mm=sources.origins_mm + sources.rotations[:, :, :2] @ middle_mm,
        rotations=np.ascontiguousarray(sources.rotations, dtype=np.float64),
        x_mm=x_mm.astype(np.float32),
        y_mm=y_mm.astype(np.float32),
        phases_turns=np.pad(sources.phases_turns % 1.0, silent).astype(np.float32),
        amplitudes=np.pad(sources.amplitudes_pa_mm, silent).astype(np.float32),
        radius_mm=float(np.linalg.norm(places_mm, axis=1).max()),
        half_x_mm=float(half_x_mm),
        half_y_mm=float(half_y_mm),
    )
    directivity = np.zeros(_DIRECTIVITY_TERMS, np.float32)
    directivity[: len(medium.directivity)] = medium.directivity
    return devices, Waves(medium.turns_per_mm, medium.nepers_per_mm, directivity)


def _tiling(grid: Grid) -> "Tiling":
    from autd_trials.acoustics.tile_kernels import Tiling

    missing = 3 - len(grid.counts)
    steps_mm = np.vstack([np.zeros((missing, 3)), grid.steps_mm])
    counts = np.array([1] * missing + list(grid.counts), dtype=np.int64)
    lengths_mm = np.linalg.norm(steps_mm, axis=1)
    whole = np.where(lengths_mm > 0, np.ceil(_TILE_MM / np.maximum(lengths_mm, 1e-9)), counts)
    tile = np.minimum(counts, np.maximum(whole, 1)).astype(np.int64)
    halves_mm = steps_mm * (tile[:, None] - 1) / 2
    corners = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1]]) @ halves_mm
    nodes, weights = _interpolation(tile)
    return Tiling(
        origin_mm=np.asarray(grid.origin_mm, dtype=np.float64),
        steps_mm=steps_mm,
        counts=counts,
        tile=tile,
        tiles=-(-counts // tile),
        reach_mm=np.linalg.norm(halves_mm, axis=1),
        radius_mm=float(np.linalg.norm(corners, axis=1).max()),
        nodes=nodes,
        weights=weights,
    )


def _interpolation(tile: NDArray[np.int64]) -> tuple[Vectors, NDArray[np.float32]]:
    """Return Chebyshev nodes for each count of them, and the weights from them to a tile's points."""
    from autd_trials.acoustics.tile_kernels import MOST_NODES

    nodes = np.zeros((MOST_NODES + 1, MOST_NODES))
    weights = np.zeros((3, MOST_NODES + 1, MOST_NODES, int(tile.max())), np.float32)
    for count in range(1, MOST_NODES + 1):
        nodes[count, :count] = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        at_nodes = np.polynomial.chebyshev.chebvander(nodes[count, :count], count - 1)
        for axis, points in enumerate(tile):
            places = np.linspace(-1, 1, points) if points > 1 else np.zeros(1)
            at_places = np.polynomial.chebyshev.chebvander(places, count - 1)
            weights[axis, count, :count, :points] = np.linalg.solve(at_nodes.T, at_places.T)
    return nodes, weights


def _refuse_inside(result: Pressures, point_mm: Callable[[int], Any]) -> None:
    inside = np.flatnonzero(np.isnan(result))
    if inside.size:
        place = ", ".join(f"{x:g}" for x in point_mm(int(inside[0])))
        raise UsageError(
            f"{inside.size} points lie inside a transducer, the first at ({place}) mm",
            do="keep 5 mm away from the transducers",
        )


def _tell(progress: Progress | None, done: int, of: int) -> None:
    if progress:
        progress(min(1.0, done / of))
