"""The limits that protect people: what goes over them is refused, never clipped."""

from collections.abc import Sequence

import numpy as np

from autd_trials.array.driver import Stimulus
from autd_trials.array.geometry import UnitPose
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.stimulus import (
    DUTY_WINDOW_S,
    Excess,
    Limits,
    duty_until,
    earliest_onset_s,
    exposure_s,
    total_exposure_s,
)

NEAREST_MM, FARTHEST_MM = 200.0, 2500.0
STEEPEST_DEG = 60.0


class ExposureMeter:
    """Keeps account of a session's exposure and refuses what would pass the limits.

    Parameters
    ----------
    limits
        The limits.
    used_s, daily_used_s
        Exposure that the session, and its participant in the 24 h before, have already used, in s at full
        drive (for a resumed session, and for a second one on a day).
    earlier_bursts
        When earlier bursts began and ended, on the host's clock; the newest last.
    """

    def __init__(
        self,
        limits: Limits,
        used_s: float = 0.0,
        *,
        daily_used_s: float = 0.0,
        earlier_bursts: Sequence[tuple[float, float]] = (),
    ) -> None:
        self._limits = limits
        self._used_s = used_s
        self._daily_used_s = daily_used_s
        self._bursts = list(earlier_bursts)

    @property
    def used_s(self) -> float:
        """Exposure used so far, in s at full drive."""
        return self._used_s

    def refuse_unsafe(self, stimuli: Sequence[Stimulus]) -> None:
        """Raise UnsafeError unless all of these bursts may still be emitted, one after the other."""
        for stimulus in stimuli:
            self._refuse_burst(stimulus)
        planned_s = total_exposure_s(stimuli)
        _refuse(self._limits.excess("session_exposure_s", self._used_s + planned_s))
        _refuse(self._limits.excess("daily_exposure_s", self._daily_used_s + planned_s))

    def earliest_s(self, stimulus: Stimulus, onset_s: float) -> float:
        """Return the earliest time from `onset_s` on at which the share of on-time allows the burst."""
        if stimulus.drive == 0:
            return onset_s
        return earliest_onset_s(self._bursts, stimulus.duration_s, self._limits.largest_duty, onset_s)

    def refuse_too_soon(self, stimulus: Stimulus, onset_s: float) -> None:
        """Raise UnsafeError if the burst, begun at `onset_s`, would make the share of on-time too large."""
        end_s = onset_s + stimulus.duration_s
        bursts = [*self._bursts, (onset_s, end_s)] if stimulus.drive > 0 else self._bursts
        _refuse(self._limits.excess("largest_duty", duty_until(bursts, end_s)))

    def charge(self, stimulus: Stimulus, onset_s: float) -> None:
        """Put a burst on the account; in full, even if it is aborted later."""
        self._used_s += exposure_s(stimulus)
        self._daily_used_s += exposure_s(stimulus)
        if stimulus.drive > 0:
            self._bursts = [burst for burst in self._bursts if burst[1] > onset_s - DUTY_WINDOW_S]
            self._bursts.append((onset_s, onset_s + stimulus.duration_s))

    def _refuse_burst(self, stimulus: Stimulus) -> None:
        if not 0 <= stimulus.drive <= 1:
            raise UsageError(f"the stimulus's drive is {stimulus.drive}", do="make drive 0 to 1")
        _refuse(self._limits.excess("largest_drive", stimulus.drive))
        _refuse(self._limits.excess("longest_burst_s", stimulus.duration_s))
        if stimulus.drive > 0:
            _refuse(self._limits.excess("largest_duty", stimulus.duration_s / DUTY_WINDOW_S))


def refuse_out_of_reach(units: Sequence[UnitPose], target_mm: tuple[float, float, float]) -> None:
    """Raise UsageError unless the target is 0.2-2.5 m from every unit and within 60 degrees of its axis."""
    for unit in units:
        way_mm = np.asarray(target_mm) - unit.centre_mm
        distance_mm = float(np.linalg.norm(way_mm))
        angle_deg = float(
            np.degrees(np.arctan2(np.linalg.norm(np.cross(unit.axis, way_mm)), unit.axis @ way_mm))
        )
        if not (NEAREST_MM <= distance_mm <= FARTHEST_MM and angle_deg <= STEEPEST_DEG):
            raise UsageError(
                f"the target ({', '.join(f'{x:g}' for x in target_mm)}) mm is out of reach of {unit.name}: "
                f"{distance_mm / 1000:.2f} m from its centre, {angle_deg:.0f} degrees off its axis",
                do=f"put it {NEAREST_MM / 1000:g} to {FARTHEST_MM / 1000:g} m from every unit, "
                f"within {STEEPEST_DEG:g} degrees of its axis; check the calibration file too",
            )


def _refuse(excess: Excess | None) -> None:
    if excess is not None:
        raise UnsafeError(
            str(excess),
            do="change the protocol; a limit is changed only by whoever answers for the participants' safety",
        )
