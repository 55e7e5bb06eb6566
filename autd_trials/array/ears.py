"""The sound level at the ears of everybody in the room, predicted for every stimulus before it is emitted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.level import sound_level_db
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium, Sources
from autd_trials.acoustics.transducer import relative_amplitude
from autd_trials.array.driver import Stimulus
from autd_trials.array.emission import focused_sources
from autd_trials.array.geometry import UnitPose, Vectors
from autd_trials.errors import UnsafeError
from autd_trials.stimulus import DRIVE_STEPS, drive_step

NEAREST_TO_HEAD_MM = 250.0

_EAR_FROM_MIDDLE_MM = 75.0
_UNCERTAINTY_MM = np.arange(-24.0, 24.1, 8.0)  # the head moves; fringes are some 7 mm apart
_AMPLITUDES = relative_amplitude(np.arange(DRIVE_STEPS + 1))


@dataclass(frozen=True)
class Head:
    """Whose head, and where.

    `middle_mm` is the middle between the ears in the calibrated frame; they lie 75 mm from it along x.
    `protection_db` is the attenuation at 40 kHz of what is worn over them.
    """

    who: str
    middle_mm: tuple[float, float, float]
    protection_db: float


class EarWatch:
    """Predicts the level at everybody's ears and refuses what would be too loud for anybody.

    The prediction is of the free field by linear theory, at the loudest of points up to 24 mm from each ear
    along each axis: no shadow of the head, no reflection, nothing worn but `protection_db`.

    Parameters
    ----------
    units
        The units' poses in the calibrated frame.
    heads
        Whose ears are where.
    air
        The air.
    largest_db
        The largest level that may reach any ear, in dB SPL.
    """

    def __init__(
        self, units: Sequence[UnitPose], heads: Sequence[Head], air: Air, *, largest_db: float
    ) -> None:
        self._units = units
        self._heads = tuple(heads)
        self._air = air
        self._largest_db = largest_db
        self._full_drive_db: dict[tuple[float, float, float], tuple[float, Head]] = {}

    def level_db(self, stimulus: Stimulus) -> float | None:
        """Return the largest level at any ear in dB SPL, at the envelope's peak; None if it is silent."""
        amplitude = float(_AMPLITUDES[drive_step(stimulus.drive)])
        if amplitude == 0:
            return None
        return self._loudest(stimulus.target_mm)[0] + 20 * math.log10(amplitude)

    def refuse_unsafe(self, stimulus: Stimulus) -> None:
        """Raise UnsafeError if the focus is too close to a head, or too much would reach an ear."""
        for head in self._heads:
            away_mm = math.dist(stimulus.target_mm, head.middle_mm)
            if away_mm < NEAREST_TO_HEAD_MM:
                raise UnsafeError(
                    f"the focus would be {away_mm:.0f} mm from the middle of the head ({head.who}), closer "
                    f"than {NEAREST_TO_HEAD_MM:.0f} mm",
                    do="put the target elsewhere, or correct where the head is",
                )
        level_db = self.level_db(stimulus)
        if level_db is not None and not level_db <= self._largest_db:
            full_db, head = self._loudest(stimulus.target_mm)
            raise UnsafeError(
                f"the predicted level at the ears ({head.who}) would be {level_db:.1f} dB SPL, over the "
                f"limit of {self._largest_db:g} dB; {self._largest_drive(full_db)}",
                do="lower the drive, move the head away from the beams, or wear hearing protection of a "
                "measured attenuation at 40 kHz (hearing_protection_db in the rig file)",
            )

    def _largest_drive(self, full_drive_db: float) -> str:
        """Say which drive would be allowed."""
        allowed = full_drive_db + 20 * np.log10(_AMPLITUDES[1:]) <= self._largest_db
        steps = int(np.count_nonzero(allowed))  # the level rises with the drive
        if steps == 0:
            return "not even the smallest drive of the devices would be allowed"
        return f"the largest drive allowed is {math.floor(1e4 * steps / DRIVE_STEPS) / 1e4:g}"

    def _loudest(self, target_mm: tuple[float, float, float]) -> tuple[float, Head]:
        """Return the largest level at any ear at full drive in dB SPL, and whose ear it is."""
        if target_mm not in self._full_drive_db:
            sources = focused_sources(self._units, target_mm, speed_of_sound_m_s=self._air.speed_of_sound_m_s)
            levels = [(self._predict_db(sources, head), head) for head in self._heads]
            self._full_drive_db[target_mm] = max(levels, key=lambda level: level[0])
        return self._full_drive_db[target_mm]

    def _predict_db(self, sources: Sources, head: Head) -> float:
        pressure = reference_pressure(sources, Medium.of(self._air), _around_ears(head.middle_mm))
        return float(sound_level_db(pressure).max()) - head.protection_db


def _around_ears(head_mm: tuple[float, float, float]) -> Vectors:
    """Return points in mm around both ears, shape (n, 3)."""
    cube = np.stack(np.meshgrid(*(_UNCERTAINTY_MM,) * 3), axis=-1).reshape(-1, 3)
    sides = [np.array([side * _EAR_FROM_MIDDLE_MM, 0.0, 0.0]) for side in (-1, 1)]
    points_mm: Vectors = np.vstack([np.array(head_mm) + side + cube for side in sides])
    return points_mm
