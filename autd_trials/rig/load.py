"""Finding and loading rig files and the calibration they name."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from autd_trials.calibration.file import Calibration, load_calibration
from autd_trials.errors import UsageError
from autd_trials.rig.fitness import refuse_unfit
from autd_trials.rig.rules import refuse_loud
from autd_trials.rig.schema import Rig
from autd_trials.yamlfile import load_model
from autd_trials.yamlfile.shipped import find_file, is_file


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
        The array is real and the calibration is simulated, made up or of unknown origin, or the rig lets too
        much reach the ears.
    """
    path = find_file(name_or_path, kind="rig", folder="rigs")
    rig = load_model(path, Rig)
    calibration_path = path.parent / rig.calibration.file
    if not is_file(calibration_path):
        raise UsageError(
            f"the calibration file {calibration_path} does not exist",
            where=str(path),
            do="calibrate the units, or correct calibration.file",
        )
    calibration, sha256 = load_calibration(calibration_path)
    refuse_unfit(calibration, rig, calibration_path, now)
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
