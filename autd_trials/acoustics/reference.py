"""The pressure field, computed plainly in float64: what the fast path is judged by."""

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.sources import Medium, Sources, Vectors

_MOST_PAIRS = 4_000_000


def reference_pressure(sources: Sources, medium: Medium, points_mm: Vectors) -> NDArray[np.complex128]:
    """Return the complex pressure as the sum over all transducers.

    Each adds ``A D(cos theta) / r exp(-alpha r) exp(2 pi i (r / lambda + phase))``, A its amplitude, D the
    directivity, r the distance, alpha the absorption; nothing behind it.

    Parameters
    ----------
    sources, medium
        What emits, and what the sound goes through.
    points_mm
        Points in mm, shape (n, 3).

    Returns
    -------
    ndarray of complex128
        Peak pressure in Pa, shape (n,).
    """
    points_at_once = max(1, _MOST_PAIRS // sources.places_mm.shape[0])
    positions_mm = sources.positions_mm
    pressure = np.zeros(len(points_mm), np.complex128)
    for begin in range(0, len(points_mm), points_at_once):
        part = slice(begin, begin + points_at_once)
        for device in range(len(sources.origins_mm)):
            ways_mm = points_mm[part, None, :] - positions_mm[device]
            pressure[part] += _device_pressure(sources, medium, device, ways_mm)
    return pressure


def _device_pressure(
    sources: Sources, medium: Medium, device: int, ways_mm: Vectors
) -> NDArray[np.complex128]:
    distances_mm = np.linalg.norm(ways_mm, axis=-1)
    cosines = ways_mm @ sources.rotations[device][:, 2] / distances_mm
    directivity = np.polynomial.polynomial.polyval(cosines, medium.directivity)
    amplitudes_pa = np.where(cosines > 0, directivity, 0.0) * sources.amplitudes_pa_mm[device] / distances_mm
    turns = distances_mm * medium.turns_per_mm + sources.phases_turns[device]
    waves = np.exp(-medium.nepers_per_mm * distances_mm + 2j * np.pi * turns)
    pressure: NDArray[np.complex128] = (amplitudes_pa * waves).sum(axis=1)
    return pressure
