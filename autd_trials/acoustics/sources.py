"""What emits (posed devices of transducers with phases and amplitudes), and what the sound goes through."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.transducer import ULTRASOUND_HZ, directivity_polynomial
from autd_trials.errors import UsageError

Vectors = NDArray[np.float64]

_DB_PER_NEPER = 8.685889638
_ROTATION_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Sources:
    """Flat devices with the same places of transducers on each; they emit along their third axis.

    Parameters
    ----------
    origins_mm
        The devices' origins in mm, shape (devices, 3).
    rotations
        The devices' rotation matrices, shape (devices, 3, 3); a place (x, y) on a device lies at
        ``rotation @ (x, y, 0) + origin_mm``.
    places_mm
        The transducers' places on a device in mm, shape (transducers, 2).
    phases_turns
        Phases in turns, shape (devices, transducers); a larger phase is ahead.
    amplitudes_pa_mm
        Peak pressure on axis times distance, shape (devices, transducers).

    Raises
    ------
    UsageError
        If a shape does not fit, a value is not finite, or a rotation is none.
    """

    origins_mm: Vectors
    rotations: Vectors
    places_mm: Vectors
    phases_turns: Vectors
    amplitudes_pa_mm: Vectors

    def __post_init__(self) -> None:
        devices, transducers = len(self.origins_mm), len(self.places_mm)
        shapes = {
            "origins_mm": (devices, 3),
            "rotations": (devices, 3, 3),
            "places_mm": (transducers, 2),
            "phases_turns": (devices, transducers),
            "amplitudes_pa_mm": (devices, transducers),
        }
        for name, shape in shapes.items():
            refuse_wrong_array(name, getattr(self, name), shape)
        unit = np.einsum("dij,dkj->dik", self.rotations, self.rotations)
        if not np.allclose(unit, np.eye(3), rtol=0, atol=_ROTATION_TOLERANCE):
            raise UsageError("a device's rotation is no rotation matrix", do="check the poses")

    @property
    def positions_mm(self) -> Vectors:
        """The transducers' positions in mm, shape (devices, transducers, 3)."""
        on_device = np.einsum("dij,tj->dti", self.rotations[:, :, :2], self.places_mm)
        positions_mm: Vectors = on_device + self.origins_mm[:, None, :]
        return positions_mm

    def with_amplitudes(self, amplitudes_pa_mm: Vectors) -> "Sources":
        """Return the same sources with other amplitudes."""
        return replace(self, amplitudes_pa_mm=amplitudes_pa_mm)


@dataclass(frozen=True)
class Medium:
    """What the sound goes through, and how the transducers spread it.

    Parameters
    ----------
    speed_of_sound_m_s
        Speed of sound in m/s.
    absorption_db_m
        Absorption in dB/m.
    directivity
        Coefficients of a polynomial of at most degree 6 in the cosine of the angle from a transducer's axis,
        lowest power first; (1,) for the same in all directions in front.
    """

    speed_of_sound_m_s: float
    absorption_db_m: float
    directivity: tuple[float, ...]

    @classmethod
    def of(cls, air: Air) -> Self:
        """Return the medium of the air with the transducers' directivity."""
        return cls(air.speed_of_sound_m_s, air.absorption_db_m(ULTRASOUND_HZ), directivity_polynomial())

    @property
    def turns_per_mm(self) -> float:
        """Wave number in turns per mm."""
        return ULTRASOUND_HZ / (1000 * self.speed_of_sound_m_s)

    @property
    def nepers_per_mm(self) -> float:
        """Absorption of the pressure amplitude in Np/mm."""
        return self.absorption_db_m / _DB_PER_NEPER / 1000


def refuse_wrong_array(name: str, array: Vectors, shape: tuple[int, ...]) -> None:
    """Raise UsageError unless an array has this shape, is not empty, and is finite."""
    if np.shape(array) != shape or 0 in shape:
        raise UsageError(f"{name} has the shape {np.shape(array)}", do=f"give the shape {shape}, not empty")
    if not np.isfinite(array).all():
        raise UsageError(f"{name} holds values that are not finite", do="check where they come from")
