"""A simulated microphone, and which transducers and points to measure.

Simulated, not measured: waves of the T4010A1 with its directivity, no reflections; the microphone stands
where it was told to be but for normal errors; noise is normal, relative to the typical amplitude.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.transducer import FULL_PRESSURE_PA_MM, ULTRASOUND_HZ, directivity_polynomial
from autd_trials.array.geometry import (
    DEVICES_PER_UNIT,
    TRANSDUCERS_PER_DEVICE,
    UnitPose,
    Vectors,
    transducer_positions_mm,
)
from autd_trials.calibration.acoustic.heard import STEPS, Group, Heard, Phasors, heard_of

_OF_A_DEVICE = (0, 1, 18, 111, 17, 231)
"""Three neighbours in a corner, whose phases hardly wrap, the middle, and two other corners."""


@dataclass(frozen=True)
class Microphone:
    """How good the simulated measurement is.

    Attributes
    ----------
    position_sd_mm
        Standard deviation of each coordinate of a point.
    noise
        Standard deviation of real and imaginary part, relative to the median amplitude.
    source_phase_sd_rad
        By how much the transducers lag differently behind one drive.
    amplitude_only
        Whether it tells amplitudes only, so that four phase steps are measured.
    """

    position_sd_mm: float = 0.1
    noise: float = 0.01
    source_phase_sd_rad: float = 0.2
    amplitude_only: bool = False


def advised_sources() -> list[Group]:
    """Return 54 single transducers of a unit, 6 of each device."""
    devices = range(DEVICES_PER_UNIT)
    return [(TRANSDUCERS_PER_DEVICE * device + number,) for device in devices for number in _OF_A_DEVICE]


def advised_points_mm(
    centre_mm: Vectors, generator: np.random.Generator, points: int = 32, half_mm: float = 400.0
) -> Vectors:
    """Return points all over a cube, shape (points, 3)."""
    return np.asarray(centre_mm + generator.uniform(-half_mm, half_mm, (points, 3)))


def listen(
    true_units: Sequence[UnitPose],
    heard_units: Sequence[int],
    points_mm: Vectors,
    microphone: Microphone,
    speed_of_sound_m_s: float,
    generator: np.random.Generator,
    sources: Sequence[Group] | None = None,
) -> list[Heard]:
    """Return what a simulated microphone hears.

    Parameters
    ----------
    true_units
        Where the units stand.
    heard_units
        Numbers of the units that are measured, from 1.
    points_mm
        Where the microphone is assumed to be, shape (points, 3).
    microphone
        How good it is.
    speed_of_sound_m_s
        The true one.
    generator
        Where errors come from.
    sources
        What emits; the advised transducers if None.
    """
    chosen = list(sources or advised_sources())
    true_mm = points_mm + generator.normal(0, microphone.position_sd_mm, points_mm.shape)
    heard = []
    for unit in heard_units:
        waves = _waves(true_units[unit - 1], chosen, true_mm, speed_of_sound_m_s)
        waves = waves * np.exp(1j * generator.normal(0, microphone.source_phase_sd_rad, (len(chosen), 1)))
        noise = microphone.noise * float(np.median(np.abs(waves)))
        if microphone.amplitude_only:
            phasors = _by_steps(waves, noise, chosen, points_mm, generator)
        else:
            constant = np.exp(1j * generator.uniform(0, 2 * np.pi))
            phasors = _phasors(waves * constant + _noise(waves.shape, noise, generator), chosen, points_mm)
        heard.append(heard_of(unit, phasors, "simulated", synchronised=not microphone.amplitude_only))
    return heard


def _waves(
    unit: UnitPose, sources: Sequence[Group], points_mm: Vectors, speed_of_sound_m_s: float
) -> NDArray[np.complex128]:
    """Return the complex pressure of each source at each point in Pa, shape (sources, points)."""
    wave_number = 2 * np.pi * ULTRASOUND_HZ / (1000 * speed_of_sound_m_s)
    places_mm = transducer_positions_mm([unit]).reshape(-1, 3)
    waves = np.zeros((len(sources), len(points_mm)), dtype=np.complex128)
    for row, source in enumerate(sources):
        for number in source:
            away_mm = points_mm - places_mm[number]
            distances_mm = np.linalg.norm(away_mm, axis=1)
            cosines = away_mm @ unit.axis / distances_mm
            beam = np.polynomial.polynomial.polyval(cosines, directivity_polynomial()) * (cosines > 0)
            amplitude = FULL_PRESSURE_PA_MM * beam / distances_mm
            waves[row] += amplitude * np.exp(1j * wave_number * distances_mm)
    return waves


def _by_steps(
    waves: NDArray[np.complex128],
    noise: float,
    sources: Sequence[Group],
    points_mm: Vectors,
    generator: np.random.Generator,
) -> Phasors:
    """Return what four amplitudes tell of each source against the first one."""
    powers = [
        np.abs(waves[0] + waves * np.exp(0.5j * np.pi * step) + _noise(waves.shape, noise, generator)) ** 2
        for step in range(STEPS)
    ]
    behind = (powers[0] - powers[2]) + 1j * (powers[3] - powers[1])
    behind[0] = np.median(np.abs(behind))  # the first one itself
    return _phasors(behind, sources, points_mm)


def _phasors(table: NDArray[np.complex128], sources: Sequence[Group], points_mm: Vectors) -> Phasors:
    places = [(float(x), float(y), float(z)) for x, y, z in points_mm]
    return {
        (source, place): complex(table[row, column])
        for row, source in enumerate(sources)
        for column, place in enumerate(places)
    }


def _noise(shape: tuple[int, ...], sd: float, generator: np.random.Generator) -> NDArray[np.complex128]:
    noise: NDArray[np.complex128] = generator.normal(0, sd, shape) + 1j * generator.normal(0, sd, shape)
    return noise
