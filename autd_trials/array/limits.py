"""The limits that protect people: what goes over them is refused, never clipped."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from autd_trials.array.driver import Stimulus
from autd_trials.array.geometry import UnitPose
from autd_trials.errors import UnsafeError, UsageError

DUTY_WINDOW_S = 60.0
NEAREST_MM, FARTHEST_MM = 200.0, 2500.0
STEEPEST_DEG = 60.0

_ROUNDING_S = 1e-9


@dataclass(frozen=True)
class Limits:
    """Largest drive (0..1), longest burst, largest share of on-time in any 60 s, exposure of a session.

    Exposure is the sum of drive^2 x duration: seconds at full drive, whatever the envelope.
    """

    largest_drive: float
    longest_burst_s: float
    largest_duty: float
    session_exposure_s: float

    def and_also(self, other: "Limits") -> "Limits":
        """Return the limits under which both hold (a protocol's and its rig's, say)."""
        return Limits(
            min(self.largest_drive, other.largest_drive),
            min(self.longest_burst_s, other.longest_burst_s),
            min(self.largest_duty, other.largest_duty),
            min(self.session_exposure_s, other.session_exposure_s),
        )


def exposure_s(stimulus: Stimulus) -> float:
    """Return a burst's exposure in s at full drive: drive^2 x duration."""
    return stimulus.drive**2 * stimulus.duration_s


def duty_until(bursts: Iterable[tuple[float, float]], end_s: float) -> float:
    """Return the share of on-time in the 60 s before `end_s`, given each burst's (onset_s, end_s)."""
    start_s = end_s - DUTY_WINDOW_S
    on_s = sum(max(0.0, min(off_s, end_s) - max(onset_s, start_s)) for onset_s, off_s in bursts)
    return on_s / DUTY_WINDOW_S


def largest_duty(bursts: Sequence[tuple[float, float]]) -> float:
    """Return the largest share of on-time in any 60 s; the window that holds most ends where a burst ends."""
    return max((duty_until(bursts, off_s) for _, off_s in bursts), default=0.0)


class ExposureMeter:
    """Keeps account of a session's exposure and refuses what would pass the limits.

    Parameters
    ----------
    limits
        The limits.
    used_s
        Exposure that the session has already used, in s at full drive (for a resumed session).
    """

    def __init__(self, limits: Limits, used_s: float = 0.0) -> None:
        self._limits = limits
        self._used_s = used_s
        self._bursts: list[tuple[float, float]] = []

    @property
    def used_s(self) -> float:
        """Exposure used so far, in s at full drive."""
        return self._used_s

    def refuse_unsafe(self, stimuli: Sequence[Stimulus]) -> None:
        """Raise UnsafeError unless all of these bursts may still be emitted, one after the other."""
        for stimulus in stimuli:
            self._refuse_burst(stimulus)
        total_s = self._used_s + sum(exposure_s(stimulus) for stimulus in stimuli)
        _refuse_over("the session's exposure in s at full drive", total_s, self._limits.session_exposure_s)

    def refuse_too_soon(self, stimulus: Stimulus, onset_s: float) -> None:
        """Raise UnsafeError if the burst, begun at `onset_s`, would make the share of on-time too large."""
        end_s = onset_s + stimulus.duration_s
        bursts = [*self._bursts, (onset_s, end_s)] if stimulus.drive > 0 else self._bursts
        _refuse_over("the share of on-time in 60 s", duty_until(bursts, end_s), self._limits.largest_duty)

    def charge(self, stimulus: Stimulus, onset_s: float) -> None:
        """Put a burst on the account; in full, even if it is aborted later."""
        self._used_s += exposure_s(stimulus)
        if stimulus.drive > 0:
            self._bursts = [burst for burst in self._bursts if burst[1] > onset_s - DUTY_WINDOW_S]
            self._bursts.append((onset_s, onset_s + stimulus.duration_s))

    def _refuse_burst(self, stimulus: Stimulus) -> None:
        if not 0 <= stimulus.drive <= 1:
            raise UsageError(f"the stimulus's drive is {stimulus.drive}", do="make drive 0 to 1")
        _refuse_over("the drive", stimulus.drive, self._limits.largest_drive)
        _refuse_over("the burst's length in s", stimulus.duration_s, self._limits.longest_burst_s)
        if stimulus.drive > 0:
            duty = stimulus.duration_s / DUTY_WINDOW_S
            _refuse_over("the share of on-time in 60 s", duty, self._limits.largest_duty)


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


def _refuse_over(what: str, value: float, limit: float) -> None:
    if not value <= limit + _ROUNDING_S:  # so that a NaN is refused too
        raise UnsafeError(
            f"{what} would be {value:.4g}, over the limit of {limit:.4g}",
            do="change the protocol; a limit is changed only by whoever answers for the participants' safety",
        )
