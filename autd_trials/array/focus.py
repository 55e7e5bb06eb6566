"""Phases that bring all transducers of all units to one focus."""

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.transducer import ULTRASOUND_HZ
from autd_trials.array.geometry import Vectors

PHASE_STEPS = 256


def focus_phases(
    transducers_mm: Vectors, target_mm: tuple[float, float, float], speed_of_sound_m_s: float
) -> NDArray[np.uint8]:
    """Return the phases with which all contributions arrive in phase at the target.

    Parameters
    ----------
    transducers_mm
        Positions of the transducers in mm, shape (devices, 249, 3).
    target_mm
        The focus in mm, in the same frame.
    speed_of_sound_m_s
        Speed of sound in m/s.

    Returns
    -------
    ndarray of uint8
        Phases in steps of 1/256 turn, shape (devices, 249), in the SDK's sense: a larger phase emits later,
        so the phase is minus the distance in wavelengths. Computed in float64: at 2 m the distance is 233
        turns, and float32 would lose a step.
    """
    wavelength_mm = 1000 * speed_of_sound_m_s / ULTRASOUND_HZ
    distance_mm = np.linalg.norm(transducers_mm - np.asarray(target_mm), axis=-1)
    steps = -np.rint(distance_mm / wavelength_mm * PHASE_STEPS).astype(np.int64)
    phases: NDArray[np.uint8] = (steps % PHASE_STEPS).astype(np.uint8)
    return phases
