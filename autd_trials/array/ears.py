"""The sound level at a participant's ears, predicted for every stimulus before it is emitted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.level import sound_level_db
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium
from autd_trials.acoustics.transducer import relative_amplitude
from autd_trials.array.driver import Stimulus
from autd_trials.array.emission import focused_sources
from autd_trials.array.geometry import UnitPose, Vectors
from autd_trials.errors import UnsafeError
from autd_trials.stimulus import DRIVE_STEPS

WARNING_LEVEL_DB = 100.0
"""What AGNIR (2010) recommends for the public above 25 kHz."""

NEAREST_TO_HEAD_MM = 250.0

_EAR_FROM_MIDDLE_MM = 75.0
_UNCERTAINTY_MM = np.arange(-24.0, 24.1, 8.0)  # the head moves; fringes are some 7 mm apart


@dataclass(frozen=True)
class Ears:
    """Where the ears are, what they wear, and what may reach them.

    `head_mm` is the middle between them in the calibrated frame; they lie 75 mm from it along x.
    `protection_db` is the attenuation at 40 kHz of what is worn over them.
    """

    head_mm: tuple[float, float, float]
    protection_db: float
    largest_level_db: float


class EarWatch:
    """Predicts the level at the ears and refuses what would be too loud.

    The prediction is of the free field by linear theory, at the loudest of points up to 24 mm from each ear
    along each axis: no shadow of the head, no reflection, nothing worn but `protection_db`.

    Parameters
    ----------
    units
        The units' poses in the calibrated frame.
    ears
        Where the ears are.
    air
        The air.
    """

    def __init__(self, units: Sequence[UnitPose], ears: Ears, air: Air) -> None:
        self._units = units
        self._ears = ears
        self._air = air
        self._full_drive_db: dict[tuple[float, float, float], float] = {}

    def level_db(self, stimulus: Stimulus) -> float | None:
        """Return the largest level at the ears in dB SPL, at the envelope's peak; None if it is silent."""
        amplitude = float(relative_amplitude(round(DRIVE_STEPS * stimulus.drive)))
        if amplitude == 0:
            return None
        if stimulus.target_mm not in self._full_drive_db:
            self._full_drive_db[stimulus.target_mm] = self._predict_db(stimulus.target_mm)
        return self._full_drive_db[stimulus.target_mm] + 20 * math.log10(amplitude)

    def refuse_unsafe(self, stimulus: Stimulus) -> None:
        """Raise UnsafeError if the focus is too close to the head, or too much would reach the ears."""
        away_mm = math.dist(stimulus.target_mm, self._ears.head_mm)
        if away_mm < NEAREST_TO_HEAD_MM:
            raise UnsafeError(
                f"the focus would be {away_mm:.0f} mm from the middle of the head, closer than "
                f"{NEAREST_TO_HEAD_MM:.0f} mm",
                do="put the target elsewhere, or correct the protocol's head",
            )
        level_db = self.level_db(stimulus)
        if level_db is not None and not level_db <= self._ears.largest_level_db:
            raise UnsafeError(
                f"the predicted level at the ears would be {level_db:.0f} dB SPL, over the limit of "
                f"{self._ears.largest_level_db:.0f} dB",
                do="lower the drive, move the head away from the beams, or let the participant wear hearing "
                "protection of a measured attenuation at 40 kHz (hearing_protection_db in the rig file)",
            )

    def _predict_db(self, target_mm: tuple[float, float, float]) -> float:
        sources = focused_sources(self._units, target_mm, speed_of_sound_m_s=self._air.speed_of_sound_m_s)
        pressure = reference_pressure(sources, Medium.of(self._air), _around_ears(self._ears.head_mm))
        return float(sound_level_db(pressure).max()) - self._ears.protection_db


def _around_ears(head_mm: tuple[float, float, float]) -> Vectors:
    """Return points in mm around both ears, shape (n, 3)."""
    cube = np.stack(np.meshgrid(*(_UNCERTAINTY_MM,) * 3), axis=-1).reshape(-1, 3)
    sides = [np.array([side * _EAR_FROM_MIDDLE_MM, 0.0, 0.0]) for side in (-1, 1)]
    points_mm: Vectors = np.vstack([np.array(head_mm) + side + cube for side in sides])
    return points_mm
