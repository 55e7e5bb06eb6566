"""What a pressure means: energy density, sound level, radiation force, and where linear theory ends."""

import math

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.transducer import ULTRASOUND_HZ

_REFERENCE_PA = 20e-6
_NONLINEARITY = 1.2
"""Coefficient of nonlinearity of air, (gamma + 1) / 2 with gamma 1.4 (Hamilton and Blackstock, 1998)."""


def energy_density_j_m3(pressure_pa: NDArray[np.complex128], air: Air) -> NDArray[np.float64]:
    """Return the acoustic energy density e = p_rms^2 / (rho c^2) in J/m3 (the paper's equation 13).

    Parameters
    ----------
    pressure_pa
        Complex or real **peak** pressure in Pa, any shape; the rms is smaller by sqrt 2. The paper does not
        say which it takes; with the peak its values would be twice these.
    air
        Density and speed of sound.
    """
    mean_square: NDArray[np.float64] = np.abs(pressure_pa) ** 2 / 2
    return mean_square / (air.density_kg_m3 * air.speed_of_sound_m_s**2)


def sound_level_db(pressure_pa: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the sound pressure level in dB re 20 uPa rms, of complex or real peak pressures in Pa."""
    rms_pa = np.abs(pressure_pa) / math.sqrt(2)
    level_db: NDArray[np.float64] = 20 * np.log10(np.maximum(rms_pa, 1e-12) / _REFERENCE_PA)
    return level_db


def disc_force_mn(mean_energy_density_j_m3: float, diameter_mm: float) -> float:
    """Return the radiation force on a disc in mN, with the energy density taken as the pressure.

    That is the paper's rough estimate (100 J/m3 are 100 Pa). A plane wave that is wholly reflected at normal
    incidence presses with twice that.
    """
    area_mm2 = math.pi / 4 * diameter_mm**2
    return mean_energy_density_j_m3 * area_mm2 / 1000


def shock_distance_mm(peak_pressure_pa: float, air: Air) -> float:
    """Return how far a plane wave of this pressure travels until it is a shock, in mm.

    rho c^3 / (beta omega p), with beta = 1.2 in air. Where a focus is longer than this, air saturates: linear
    theory then gives an upper bound.
    """
    omega = 2 * math.pi * ULTRASOUND_HZ
    cubed = air.density_kg_m3 * air.speed_of_sound_m_s**3
    return 1000 * cubed / (_NONLINEARITY * omega * max(peak_pressure_pa, 1e-12))


def force_harmonics(relative_amplitude: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return mean, fundamental and second harmonic of the force, relative to that at full drive.

    Parameters
    ----------
    relative_amplitude
        Pressure amplitude over exactly one period of the modulation, evenly sampled, 0 to 1; radiation
        pressure goes with its square.
    """
    spectrum = np.abs(np.fft.rfft(relative_amplitude**2)) / len(relative_amplitude)
    return float(spectrum[0]), float(2 * spectrum[1]), float(2 * spectrum[2])
