"""Compiled loops of the field solver (numba): float32 within a device, float64 between devices.

A device's contribution at a point is split into a carrier, ``exp(2 pi i r0 / lambda - alpha r0)`` with the
distance r0 to the device's middle, and an envelope that varies slowly from point to point. With
``s = |x|^2 - 2 p . x`` for a transducer's place x and the point p, both from the device's middle, its
distance is ``r = sqrt(r0^2 + s)``, and ``r - r0 = s / (r + r0)`` holds in float32 without cancellation. On a
grid the envelope is evaluated at Chebyshev nodes of each tile and interpolated; only the carrier is computed
at every point.

The sums are functions of their own under `fastmath`: only so does the compiler use vector instructions.
Importing this module loads numba.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

Float32s = NDArray[np.float32]
Float64s = NDArray[np.float64]
Point = tuple[float, float, float]

MOST_NODES = 16
"""Most Chebyshev nodes along an axis of a tile; tiles that need more are computed point by point."""

_TRANSDUCER_RADIUS_MM = 5.0
_LEAST_DISTANCE_MM = 60.0  # closer to a device's rim than this, its envelope is not smooth enough
_LEAST_NODES = 3
_NODE_ERROR = 1e-4  # of one device's outermost transducers; over all of them some 1e-6
_F = np.float32
_ONE, _HALF = _F(1), _F(0.5)


class Devices(NamedTuple):
    """The sources as the loops need them, from the middle of each device.

    `centres_mm` (devices, 3), `rotations` (devices, 3, 3); `x_mm`, `y_mm` and `square_mm2` (places), padded
    with silent transducers to whole vectors; `phases_turns` and `amplitudes` (devices, places); `radius_mm`
    of the outermost transducer, `half_x_mm` and `half_y_mm` of the rectangle that holds all.
    """

    centres_mm: Float64s
    rotations: Float64s
    x_mm: Float32s
    y_mm: Float32s
    square_mm2: Float32s
    phases_turns: Float32s
    amplitudes: Float32s
    radius_mm: float
    half_x_mm: float
    half_y_mm: float


class Waves(NamedTuple):
    """Wave number, absorption and the directivity's seven coefficients."""

    turns_per_mm: float
    nepers_per_mm: float
    directivity: Float32s


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


def _sine_and_cosine() -> tuple[list[np.float32], list[np.float32]]:
    """Fit sin(2 pi t) / t and cos(2 pi t) by polynomials in t^2 for |t| <= 1/2, to 2e-7 and 1e-8."""
    turns = np.cos(np.linspace(0, np.pi, 4000)) / 2  # none is 0
    square = np.polynomial.Chebyshev.fit
    sine = square(turns**2, np.sin(2 * np.pi * turns) / turns, 5, domain=[0, 0.25])
    cosine = square(turns**2, np.cos(2 * np.pi * turns), 6, domain=[0, 0.25])
    polynomials = [p.convert(kind=np.polynomial.Polynomial) for p in (sine, cosine)]
    sine_terms, cosine_terms = ([_F(c) for c in p.coef] for p in polynomials)
    return sine_terms, cosine_terms


(_S0, _S1, _S2, _S3, _S4, _S5), (_C0, _C1, _C2, _C3, _C4, _C5, _C6) = _sine_and_cosine()


@njit(parallel=True, error_model="numpy", cache=True)
def points_pressure(
    devices: Devices, waves: Waves, points_mm: Float64s, pressure: NDArray[np.complex128]
) -> None:
    """Write the complex pressure at points (n, 3) into (n,); NaN inside a transducer."""
    for index in prange(len(points_mm)):
        real = imaginary = 0.0
        for device in range(len(devices.centres_mm)):
            centre = devices.centres_mm[device]
            local = _into_device(
                devices,
                device,
                points_mm[index, 0] - centre[0],
                points_mm[index, 1] - centre[1],
                points_mm[index, 2] - centre[2],
            )
            more_real, more_imaginary = _device_pressure(devices, waves, device, local)
            real += more_real
            imaginary += more_imaginary
        pressure[index] = complex(real, imaginary)


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
    if middle[2] + tiling.radius_mm <= -_TRANSDUCER_RADIUS_MM:
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
                more_real, more_imaginary = _device_pressure(
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
                a, b = _envelope(devices, waves, device, (place[0], place[1], place[2]))
                node_real[i, j, k] = fading * a
                node_imaginary[i, j, k] = fading * b
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


@njit(error_model="numpy", cache=True)
def _into_device(devices: Devices, device: int, x: float, y: float, z: float) -> Point:
    """Return a vector in a device's own frame."""
    r = devices.rotations[device]
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@njit(error_model="numpy", cache=True)
def _device_pressure(devices: Devices, waves: Waves, device: int, local: Point) -> tuple[float, float]:
    """Return a device's complex pressure at a point of its own frame."""
    if _inside_transducer(devices, local):
        return math.nan, math.nan
    if local[2] <= 0:
        return 0.0, 0.0
    a, b = _envelope(devices, waves, device, local)
    r0 = math.sqrt(local[0] ** 2 + local[1] ** 2 + local[2] ** 2)
    turns = r0 * waves.turns_per_mm
    angle = 2 * math.pi * (turns - np.rint(turns))
    fading = math.exp(-waves.nepers_per_mm * r0)
    cosine, sine = fading * math.cos(angle), fading * math.sin(angle)
    return cosine * a - sine * b, cosine * b + sine * a


@njit(error_model="numpy", cache=True)
def _inside_transducer(devices: Devices, local: Point) -> bool:
    reach = _TRANSDUCER_RADIUS_MM
    if (
        abs(local[2]) >= reach
        or abs(local[0]) >= devices.half_x_mm + reach
        or abs(local[1]) >= devices.half_y_mm + reach
    ):
        return False
    for place in range(len(devices.x_mm)):
        dx, dy = local[0] - devices.x_mm[place], local[1] - devices.y_mm[place]
        if dx * dx + dy * dy + local[2] ** 2 < reach * reach:
            return True
    return False


@njit(error_model="numpy", cache=True)
def _envelope(devices: Devices, waves: Waves, device: int, local: Point) -> tuple[float, float]:
    """Return a device's complex pressure at a point of its own frame, without the carrier."""
    square = local[0] ** 2 + local[1] ** 2 + local[2] ** 2
    return _sum_over_transducers(
        devices.x_mm,
        devices.y_mm,
        devices.square_mm2,
        devices.phases_turns[device],
        devices.amplitudes[device],
        waves.directivity,
        _F(2 * local[0]),
        _F(2 * local[1]),
        _F(local[2]),
        _F(square),
        _F(math.sqrt(square)),
        _F(waves.turns_per_mm),
        _F(waves.nepers_per_mm),
    )


@njit(fastmath=True, error_model="numpy", cache=True)
def _sum_over_transducers(
    x: Float32s,
    y: Float32s,
    square: Float32s,
    phases: Float32s,
    amplitudes: Float32s,
    directivity: Float32s,
    twice_px: Any,
    twice_py: Any,
    height: Any,
    r0_square: Any,
    r0: Any,
    turns_per_mm: Any,
    nepers_per_mm: Any,
) -> tuple[Any, Any]:
    d0, d1, d2, d3, d4, d5, d6 = directivity
    real, imaginary = _F(0), _F(0)
    for i in range(x.shape[0]):
        s = square[i] - x[i] * twice_px - y[i] * twice_py
        r_square = r0_square + s
        per_r = _ONE / np.sqrt(r_square)
        beyond = s / (r_square * per_r + r0)
        turns = beyond * turns_per_mm + phases[i]
        t = turns - np.rint(turns)
        u = t * t
        sine = t * (_S0 + u * (_S1 + u * (_S2 + u * (_S3 + u * (_S4 + u * _S5)))))
        cosine = _C0 + u * (_C1 + u * (_C2 + u * (_C3 + u * (_C4 + u * (_C5 + u * _C6)))))
        c = height * per_r
        spread = d0 + c * (d1 + c * (d2 + c * (d3 + c * (d4 + c * (d5 + c * d6)))))
        loss = nepers_per_mm * beyond
        weight = amplitudes[i] * per_r * spread * (_ONE - loss + _HALF * loss * loss)
        real += weight * cosine
        imaginary += weight * sine
    return real, imaginary
