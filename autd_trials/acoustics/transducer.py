"""The transducer of an AUTD3 device: how much it emits, and where to.

It is a Nippon Ceramic T4010A1, 40 kHz, 10 mm across.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from autd_trials.stimulus import DRIVE_STEPS

ULTRASOUND_HZ = 40_000.0
RADIUS_MM = 5.0

FULL_PRESSURE_PA_MM = 4386.0
"""Peak pressure on axis times distance at full drive, as the AUTD3 SDK's field simulation has it: 200 x
275.574 / (4 pi), which is 3.10 Pa rms, or 103.8 dB SPL, at 1 m."""

DIRECTIVITY_TABLE = {
    0: 1.0,
    10: 1.0,
    20: 1.0,
    30: 0.891,
    40: 0.708,
    50: 0.501,
    60: 0.355,
    70: 0.251,
    80: 0.200,
    90: 0.178,
}
"""Pressure relative to that on axis by the angle from the axis in degrees, as read off the data sheet's polar
diagram (0, 0, 0, -1, -3, -6, -9, -12, -14, -15 dB)."""

_DEGREE = 6
_PULSE_WIDTHS = 512


@lru_cache
def directivity_polynomial() -> tuple[float, ...]:
    """Return the directivity as a polynomial in the cosine of the angle, lowest power first.

    It is fitted by least squares to the table, interpolated evenly in angle by monotone cubics, and stays
    within 0.6 % of the table. In front of the transducer only; nothing is emitted backwards.
    """
    from scipy.interpolate import PchipInterpolator

    angles_deg = np.arange(91)
    table = PchipInterpolator(list(DIRECTIVITY_TABLE), list(DIRECTIVITY_TABLE.values()))(angles_deg)
    fit = np.polynomial.Polynomial.fit(np.cos(np.radians(angles_deg)), table, _DEGREE, domain=[-1, 1])
    return tuple(float(coefficient) for coefficient in fit.coef)


def relative_amplitude(intensity: int | NDArray[np.integer]) -> NDArray[np.float64]:
    """Return the pressure amplitude for an intensity byte, relative to full drive.

    Parameters
    ----------
    intensity
        0 to 255, any shape.

    Returns
    -------
    ndarray of float64
        sin(pi w / 512), with the pulse width w = 512 / pi arcsin(intensity / 255), rounded, that the firmware
        makes of the intensity: the amplitude is in proportion to the byte but for that rounding.
    """
    width = np.rint(_PULSE_WIDTHS / np.pi * np.arcsin(np.asarray(intensity) / DRIVE_STEPS))
    amplitude: NDArray[np.float64] = np.sin(np.pi * width / _PULSE_WIDTHS)
    return amplitude
