"""Compiled loops of the field solver for grids (numba): interpolation within tiles.

A device's envelope (see `kernels`) varies slowly. On a grid it is evaluated at Chebyshev nodes of each tile
and interpolated; only the carrier is computed at every point. Importing this module loads numba, which keeps
what it compiled by this file's time alone: after a change to `kernels`, touch this file too.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from autd_trials.acoustics.kernels import (
    COSINE,
    SINE,
    TRANSDUCER_RADIUS_MM,
    Devices,
    Float32s,
    Float64s,
    Waves,
    device_pressure,
    envelope,
)

MOST_NODES = 16
"""Most Chebyshev nodes along an axis of a tile; tiles that need more are computed point by point."""

_LEAST_DISTANCE_MM = 60.0  # closer to a device's rim than this, its envelope is not smooth enough
_LEAST_NODES = 4
_NODE_ERROR = 2e-5  # of one device's outermost transducers; over all of them some 1e-6
_F = np.float32
_ONE, _HALF = _F(1), _F(0.5)
_S0, _S1, _S2, _S3, _S4, _S5 = SINE
_C0, _C1, _C2, _C3, _C4, _C5, _C6 = COSINE


class Tiling(NamedTuple):
    """A grid of three axes cut into equal tiles, the last ones cut short.

    `steps_mm` (3, 3), `counts`, `tile` points and `tiles` along each axis, `reach_mm` from a tile's middle
    along each axis and `radius_mm` to its corners; `nodes` (n, node) on -1..1 and `weights` (axis, n, node,
    point).
    """

    origin_mm: Float64s
    steps_mm: Float64s
    counts: NDArray[np.int64]
    tile: NDArray[np.int64]
    tiles: NDArray[np.int64]
    reach_mm: Float64s
    radius_mm: float
    nodes: Float64s
    weights: Float32s


@njit(parallel=True, error_model="numpy", cache=True)
def tiles_pressure(
    devices: Devices,
    waves: Waves,
    tiling: Tiling,
    first: int,
    last: int,
    pressure: NDArray[np.complex128],
) -> None:
    """Write the complex pressure of the tiles from `first` to before `last` into the grid's (n0, n1, n2)."""
    for number in prange(first, last):
        begin = np.empty(3, np.int64)
        begin[2] = number % tiling.tiles[2] * tiling.tile[2]
        begin[1] = number // tiling.tiles[2] % tiling.tiles[1] * tiling.tile[1]
        begin[0] = number // (tiling.tiles[1] * tiling.tiles[2]) * tiling.tile[0]
        size = np.minimum(tiling.tile, tiling.counts - begin)
        real = np.zeros((size[0], size[1], size[2]), np.float32)
        imaginary = np.zeros((size[0], size[1], size[2]), np.float32)
        for device in range(len(devices.centres_mm)):
            _add_device(devices, waves, tiling, device, begin, size, real, imaginary)
        for i in range(size[0]):
            for j in range(size[1]):
                for k in range(size[2]):
                    value = complex(real[i, j, k], imaginary[i, j, k])
                    pressure[begin[0] + i, begin[1] + j, begin[2] + k] = value


@njit(error_model="numpy", cache=True)
def _add_device(
    devices: Devices,
    waves: Waves,
    tiling: Tiling,
    device: int,
    begin: NDArray[np.int64],
    size: NDArray[np.int64],
    real: Float32s,
    imaginary: Float32s,
) -> None:
    """Add one device to a tile: interpolated where that is exact and cheaper, else point by point."""
    rotation = devices.rotations[device]
    steps = tiling.steps_mm @ rotation
    first = (tiling.origin_mm - devices.centres_mm[device]) @ rotation + begin * 1.0 @ steps
    middle = first + (tiling.tile - 1) / 2 @ steps
    if middle[2] + tiling.radius_mm <= -TRANSDUCER_RADIUS_MM:
        return
    nodes = _nodes(devices, waves, tiling, middle)
    if nodes[0] == 0 or nodes.prod() >= size.prod():
        _add_directly(devices, waves, device, first, steps, size, real, imaginary)
    else:
        _add_interpolated(devices, waves, tiling, device, first, middle, steps, nodes, size, real, imaginary)


@njit(error_model="numpy", cache=True)
def _nodes(devices: Devices, waves: Waves, tiling: Tiling, middle: Float64s) -> NDArray[np.int64]:
    """Return how many nodes a device's envelope needs along each axis of a tile; 0 if it is too close.

    The envelope's phase changes by at most `b` over half a tile, as its transducers are seen under different
    angles; the interpolation error of exp(i b t) with n nodes is about 2 (b / 2)^n / n!.
    """
    nodes = np.zeros(3, np.int64)
    clearance = math.sqrt((middle**2).sum()) - tiling.radius_mm
    if clearance < devices.radius_mm + _LEAST_DISTANCE_MM or middle[2] - tiling.radius_mm <= 0:
        return nodes
    for axis in range(3):
        if tiling.reach_mm[axis] == 0:
            nodes[axis] = 1
            continue
        phase = 2 * math.pi * waves.turns_per_mm * devices.radius_mm / clearance * tiling.reach_mm[axis]
        count, error = 1, phase
        while error > _NODE_ERROR and count < MOST_NODES:
            count += 1
            error *= phase / 2 / count
        if error > _NODE_ERROR:
            return np.zeros(3, np.int64)
        nodes[axis] = max(count, _LEAST_NODES)
    return nodes


@njit(error_model="numpy", cache=True)
def _add_directly(
    devices: Devices,
    waves: Waves,
    device: int,
    first: Float64s,
    steps: Float64s,
    size: NDArray[np.int64],
    real: Float32s,
    imaginary: Float32s,
) -> None:
    for i in range(size[0]):
        for j in range(size[1]):
            for k in range(size[2]):
                local = first + i * steps[0] + j * steps[1] + k * steps[2]
                more_real, more_imaginary = device_pressure(
                    devices, waves, device, (local[0], local[1], local[2])
                )
                real[i, j, k] += _F(more_real)
                imaginary[i, j, k] += _F(more_imaginary)


@njit(error_model="numpy", cache=True)
def _add_interpolated(
    devices: Devices,
    waves: Waves,
    tiling: Tiling,
    device: int,
    first: Float64s,
    middle: Float64s,
    steps: Float64s,
    nodes: NDArray[np.int64],
    size: NDArray[np.int64],
    real: Float32s,
    imaginary: Float32s,
) -> None:
    distance_mm = math.sqrt((middle**2).sum())
    node_real, node_imaginary = _at_nodes(devices, waves, tiling, device, middle, distance_mm, steps, nodes)
    along = tiling.weights[2, nodes[2], : nodes[2], : size[2]]
    rows_real = np.empty((nodes[1], nodes[2]), np.float32)
    rows_imaginary = np.empty((nodes[1], nodes[2]), np.float32)
    row_real = np.empty(nodes[2], np.float32)
    row_imaginary = np.empty(nodes[2], np.float32)
    envelope_real = np.empty(size[2], np.float32)
    envelope_imaginary = np.empty(size[2], np.float32)
    for i in range(size[0]):
        _mix(tiling.weights[0, nodes[0], : nodes[0], i], node_real, rows_real)
        _mix(tiling.weights[0, nodes[0], : nodes[0], i], node_imaginary, rows_imaginary)
        for j in range(size[1]):
            _mix_rows(tiling.weights[1, nodes[1], : nodes[1], j], rows_real, row_real)
            _mix_rows(tiling.weights[1, nodes[1], : nodes[1], j], rows_imaginary, row_imaginary)
            _mix_rows(row_real, along, envelope_real)
            _mix_rows(row_imaginary, along, envelope_imaginary)
            begin = first + i * steps[0] + j * steps[1]
            _add_row(
                begin[0],
                begin[1],
                begin[2],
                steps[2, 0],
                steps[2, 1],
                steps[2, 2],
                waves.turns_per_mm,
                waves.nepers_per_mm,
                distance_mm,
                envelope_real,
                envelope_imaginary,
                real[i, j],
                imaginary[i, j],
            )


@njit(error_model="numpy", cache=True)
def _at_nodes(
    devices: Devices,
    waves: Waves,
    tiling: Tiling,
    device: int,
    middle: Float64s,
    distance_mm: float,
    steps: Float64s,
    nodes: NDArray[np.int64],
) -> tuple[Float32s, Float32s]:
    """Return a device's envelope at the nodes of a tile, faded by the absorption up to the tile's middle."""
    fading = _F(math.exp(-waves.nepers_per_mm * distance_mm))
    node_real = np.empty((nodes[0], nodes[1], nodes[2]), np.float32)
    node_imaginary = np.empty((nodes[0], nodes[1], nodes[2]), np.float32)
    half = (tiling.tile - 1) / 2
    for i in range(nodes[0]):
        for j in range(nodes[1]):
            for k in range(nodes[2]):
                place = (
                    middle
                    + half[0] * tiling.nodes[nodes[0], i] * steps[0]
                    + half[1] * tiling.nodes[nodes[1], j] * steps[1]
                    + half[2] * tiling.nodes[nodes[2], k] * steps[2]
                )
                a, b = envelope(devices, waves, device, (place[0], place[1], place[2]))
                node_real[i, j, k] = fading * a
                node_imaginary[i, j, k] = fading * b
    return node_real, node_imaginary


@njit(fastmath=True, error_model="numpy", cache=True)
def _mix(weights: Float32s, sheets: Float32s, mixed: Float32s) -> None:
    """Write the weighted sum over the first axis of (n, a, b) into (a, b)."""
    mixed[:] = _F(0)
    for n in range(sheets.shape[0]):
        for a in range(sheets.shape[1]):
            for b in range(sheets.shape[2]):
                mixed[a, b] += weights[n] * sheets[n, a, b]


@njit(fastmath=True, error_model="numpy", cache=True)
def _mix_rows(weights: Float32s, rows: Float32s, mixed: Float32s) -> None:
    """Write the weighted sum over the first axis of (n, a) into (a,)."""
    mixed[:] = _F(0)
    for n in range(rows.shape[0]):
        weight = weights[n]
        row = rows[n]
        for a in range(mixed.shape[0]):
            mixed[a] += weight * row[a]


@njit(fastmath=True, error_model="numpy", cache=True)
def _add_row(
    x: float,
    y: float,
    z: float,
    step_x: float,
    step_y: float,
    step_z: float,
    turns_per_mm: float,
    nepers_per_mm: float,
    distance_mm: float,
    envelope_real: Float32s,
    envelope_imaginary: Float32s,
    real: Float32s,
    imaginary: Float32s,
) -> None:
    """Multiply the envelopes of a row of points by the carrier and add them."""
    for index in range(real.shape[0]):
        px, py, pz = x + index * step_x, y + index * step_y, z + index * step_z
        r0 = math.sqrt(px * px + py * py + pz * pz)
        turns = r0 * turns_per_mm
        t = _F(turns - np.rint(turns))
        u = t * t
        sine = t * (_S0 + u * (_S1 + u * (_S2 + u * (_S3 + u * (_S4 + u * _S5)))))
        cosine = _C0 + u * (_C1 + u * (_C2 + u * (_C3 + u * (_C4 + u * (_C5 + u * _C6)))))
        loss = _F((r0 - distance_mm) * nepers_per_mm)
        fading = _ONE - loss + _HALF * loss * loss
        a, b = fading * envelope_real[index], fading * envelope_imaginary[index]
        real[index] += a * cosine - b * sine
        imaginary[index] += a * sine + b * cosine
