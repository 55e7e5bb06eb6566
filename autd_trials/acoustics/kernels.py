"""Compiled loops of the field solver (numba): one device at one point, in float32; points in float64.

A device's contribution at a point is split into a carrier, ``exp(2 pi i r0 / lambda - alpha r0)`` with the
distance r0 to the device's middle, and an envelope that varies slowly from point to point. With
``s = |x|^2 - 2 p . x`` for a transducer's place x and the point p, both from the device's middle, its
difference of distances is ``r - r0 = s / (r + r0)``, which holds in float32 without cancellation.

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

TRANSDUCER_RADIUS_MM = 5.0

_F = np.float32
_ONE, _HALF = _F(1), _F(0.5)


class Devices(NamedTuple):
    """The sources as the loops need them, from the middle of each device.

    `centres_mm` (devices, 3), `rotations` (devices, 3, 3); `x_mm` and `y_mm` (places), padded with silent
    transducers to whole vectors; `phases_turns` and `amplitudes` (devices, places); `radius_mm`
    of the outermost transducer, `half_x_mm` and `half_y_mm` of the rectangle that holds all.
    """

    centres_mm: Float64s
    rotations: Float64s
    x_mm: Float32s
    y_mm: Float32s
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


def _sine_and_cosine() -> tuple[list[np.float32], list[np.float32]]:
    """Fit sin(2 pi t) / t and cos(2 pi t) by polynomials in t^2 for |t| <= 1/2, to 2e-7 and 1e-8."""
    turns = np.cos(np.linspace(0, np.pi, 4000)) / 2  # none is 0
    square = np.polynomial.Chebyshev.fit
    sine = square(turns**2, np.sin(2 * np.pi * turns) / turns, 5, domain=[0, 0.25])
    cosine = square(turns**2, np.cos(2 * np.pi * turns), 6, domain=[0, 0.25])
    polynomials = [p.convert(kind=np.polynomial.Polynomial) for p in (sine, cosine)]
    sine_terms, cosine_terms = ([_F(c) for c in p.coef] for p in polynomials)
    return sine_terms, cosine_terms


SINE, COSINE = _sine_and_cosine()
"""Coefficients of sin(2 pi t) / t and of cos(2 pi t) in t^2, lowest power first."""

_S0, _S1, _S2, _S3, _S4, _S5 = SINE
_C0, _C1, _C2, _C3, _C4, _C5, _C6 = COSINE


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
            more_real, more_imaginary = device_pressure(devices, waves, device, local)
            real += more_real
            imaginary += more_imaginary
        pressure[index] = complex(real, imaginary)


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
def device_pressure(devices: Devices, waves: Waves, device: int, local: Point) -> tuple[float, float]:
    """Return a device's complex pressure at a point of its own frame."""
    if _inside_transducer(devices, local):
        return math.nan, math.nan
    if local[2] <= 0:
        return 0.0, 0.0
    a, b = envelope(devices, waves, device, local)
    r0 = math.sqrt(local[0] ** 2 + local[1] ** 2 + local[2] ** 2)
    turns = r0 * waves.turns_per_mm
    angle = 2 * math.pi * (turns - np.rint(turns))
    fading = math.exp(-waves.nepers_per_mm * r0)
    cosine, sine = fading * math.cos(angle), fading * math.sin(angle)
    return cosine * a - sine * b, cosine * b + sine * a


@njit(error_model="numpy", cache=True)
def _inside_transducer(devices: Devices, local: Point) -> bool:
    reach = TRANSDUCER_RADIUS_MM
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
def envelope(devices: Devices, waves: Waves, device: int, local: Point) -> tuple[float, float]:
    """Return a device's complex pressure at a point of its own frame, without the carrier."""
    square = local[0] ** 2 + local[1] ** 2 + local[2] ** 2
    return _sum_over_transducers(
        devices.x_mm,
        devices.y_mm,
        devices.phases_turns[device],
        devices.amplitudes[device],
        waves.directivity,
        _F(local[0]),
        _F(local[1]),
        _F(local[2]),
        _F(math.sqrt(square)),
        _F(waves.turns_per_mm),
        _F(waves.nepers_per_mm),
    )


@njit(fastmath=True, error_model="numpy", cache=True)
def _sum_over_transducers(
    x: Float32s,
    y: Float32s,
    phases: Float32s,
    amplitudes: Float32s,
    directivity: Float32s,
    px: Any,
    py: Any,
    height: Any,
    r0: Any,
    turns_per_mm: Any,
    nepers_per_mm: Any,
) -> tuple[Any, Any]:
    d0, d1, d2, d3, d4, d5, d6 = directivity
    height_square = height * height
    real, imaginary = _F(0), _F(0)
    for i in range(x.shape[0]):
        dx, dy = x[i] - px, y[i] - py
        s = x[i] * (dx - px) + y[i] * (dy - py)
        r_square = dx * dx + dy * dy + height_square  # r0^2 + s would cancel close to a transducer
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
