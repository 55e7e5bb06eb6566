"""Whether a calibration is fit for a rig: measured, not too old, and good enough."""

from datetime import UTC, datetime
from pathlib import Path

from autd_trials.calibration.file import Calibration
from autd_trials.calibration.provenance import refuse_future
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.rig.schema import Rig

_CLOCK_NEVER_SET = datetime(2026, 1, 1, tzinfo=UTC)
"""Before this program was written: a computer that says so has lost its time."""


def refuse_unfit(calibration: Calibration, rig: Rig, path: Path, now: datetime) -> None:
    """Refuse a calibration that a rig must not use.

    Parameters
    ----------
    calibration
        The calibration.
    rig
        The rig; a real array takes measured data only.
    path
        The calibration's file, for messages.
    now
        Against which its age is judged; aware.

    Raises
    ------
    UsageError
        It is older or worse than the rig allows, or from the future; or the computer's clock is not set.
    UnsafeError
        The array is real and the calibration is simulated, made up, or does not say where it comes from or
        when its data were taken.
    """
    if not rig.emulated:
        _refuse_unreal(calibration, rig, path)
    _refuse_old(calibration, rig, path, now)
    _refuse_little_energy(calibration, rig, path)


def _refuse_unreal(calibration: Calibration, rig: Rig, path: Path) -> None:
    origin = calibration.capture.origin
    if origin != "measured":
        worst = ", ".join(each.file for each in calibration.sources if each.origin == origin)
        reason = f"of {origin} origin" if origin == "unknown" else origin
        raise UnsafeError(
            f"this calibration is {reason}{f' ({worst})' if worst else ''}; rig {rig.name!r} has a real "
            "array, whose focus would be elsewhere",
            where=str(path),
            do="calibrate the units"
            + ("; of data from elsewhere, say --measured-by and --taken" if origin == "unknown" else ""),
        )
    if calibration.taken is None:
        raise UnsafeError(
            f"this calibration does not say when its data were taken; rig {rig.name!r} has a real array, and "
            "units that were moved since miss the target",
            where=str(path),
            do="calibrate the units",
        )


def _refuse_old(calibration: Calibration, rig: Rig, path: Path, now: datetime) -> None:
    """Refuse by age; an emulated rig's files, which nobody took, count from when they were computed."""
    oldest_days = rig.calibration.oldest_days
    if rig.emulated and oldest_days is None:
        return
    if now < _CLOCK_NEVER_SET:
        raise UsageError(
            f"the clock of this computer says {now.isoformat(timespec='seconds')}, so the calibration's age "
            "is unknown",
            where=str(path),
            do="set the clock",
        )
    taken = calibration.taken or calibration.time
    refuse_future(taken, now, str(path))
    age_days = max(0.0, (now - taken).total_seconds() / 86400)
    if oldest_days is not None and age_days > oldest_days:
        raise UsageError(
            f"the calibration is {age_days:.1f} days old; rig {rig.name!r} allows {oldest_days:g}",
            where=str(path),
            do="calibrate again: units that were moved since miss the target",
        )


def _refuse_little_energy(calibration: Calibration, rig: Rig, path: Path) -> None:
    least = rig.calibration.least_energy_left
    if least is None:
        return
    energy = calibration.predicted_energy
    if energy is None:
        raise UsageError(
            f"the calibration does not predict the energy at the target; rig {rig.name!r} asks for {least:g}",
            where=str(path),
            do="calibrate with `autd-trials calibrate`, whose covariances give it",
        )
    if energy.low < least:
        raise UsageError(
            f"the calibration leaves {energy.low:.2f} of the energy at the target (5 % quantile; mean "
            f"{energy.mean:.2f}); rig {rig.name!r} asks for {least:g}",
            where=str(path),
            do="calibrate again with a wand, or with --range-scale-sd 0 if the sensors' scale was checked; "
            "with more points over a larger space",
        )
