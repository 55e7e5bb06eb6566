"""Finding and loading rig files and the calibration they name."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from autd_trials.calibration.file import Calibration, load_calibration
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.rig.rules import refuse_loud
from autd_trials.rig.schema import Rig
from autd_trials.yamlfile import load_model
from autd_trials.yamlfile.shipped import find_file


@dataclass(frozen=True)
class LoadedRig:
    """A rig, and where its units are."""

    rig: Rig
    calibration: Calibration
    calibration_sha256: str
    true_calibration: Calibration
    """Where an emulated rig's units really stand: as calibrated, unless the rig file says otherwise."""


def load_rig(name_or_path: str, now: datetime) -> LoadedRig:
    """Load a rig file and its calibration.

    Parameters
    ----------
    name_or_path
        The bare name of a shipped rig, or a path.
    now
        Against which the calibration's age is judged; aware.

    Raises
    ------
    UsageError
        A file is missing or wrong, or the calibration is older or worse than the rig allows.
    UnsafeError
        The calibration is made up and the array is real, or the rig lets too much reach the ears.
    """
    path = find_file(name_or_path, kind="rig", folder="rigs")
    rig = load_model(path, Rig)
    calibration_path = path.parent / rig.calibration.file
    if not calibration_path.is_file():
        raise UsageError(
            f"the calibration file {calibration_path} does not exist",
            where=str(path),
            do="calibrate the units, or correct calibration.file",
        )
    calibration, sha256 = load_calibration(calibration_path)
    _refuse_made_up(calibration, rig, calibration_path)
    _refuse_old(calibration, rig, calibration_path, now)
    _refuse_little_energy(calibration, rig, calibration_path)
    refuse_loud(rig, str(path))
    return LoadedRig(rig, calibration, sha256, _true_calibration(rig, path, calibration))


def with_calibration(loaded: LoadedRig, path: Path) -> LoadedRig:
    """Return a rig with another calibration of its units.

    Raises
    ------
    UsageError
        The file is missing or wrong, or is about other units.
    """
    calibration, sha256 = load_calibration(path)
    _refuse_other_units(calibration, loaded.calibration, path)
    return LoadedRig(loaded.rig, calibration, sha256, calibration)


def _true_calibration(rig: Rig, path: Path, calibration: Calibration) -> Calibration:
    if rig.calibration.true_file is None:
        return calibration
    if not rig.emulated:
        raise UsageError(
            "calibration.true_file is for emulated rigs: nobody knows where real units really stand",
            where=str(path),
            do="leave it out",
        )
    true = load_calibration(path.parent / rig.calibration.true_file)[0]
    _refuse_other_units(true, calibration, path.parent / rig.calibration.true_file)
    return true


def _refuse_other_units(calibration: Calibration, known: Calibration, path: Path) -> None:
    names, wanted = ([unit.name for unit in each.units] for each in (calibration, known))
    if names != wanted:
        raise UsageError(
            f"this is a calibration of {', '.join(names)}; the rig's units are {', '.join(wanted)}",
            where=str(path),
            do="give the same units in the same order",
        )


def _refuse_made_up(calibration: Calibration, rig: Rig, path: Path) -> None:
    if calibration.made_up and not rig.emulated:
        raise UnsafeError(
            f"this calibration is made up; rig {rig.name!r} has a real array, whose focus would be elsewhere",
            where=str(path),
            do="calibrate the units",
        )


def _refuse_old(calibration: Calibration, rig: Rig, path: Path, now: datetime) -> None:
    oldest_days = rig.calibration.oldest_days
    if oldest_days is None:
        return
    age_days = (now - calibration.time.astimezone(UTC)).total_seconds() / 86400
    if age_days > oldest_days:
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
            do="calibrate again with more points over a larger space",
        )
