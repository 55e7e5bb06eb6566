"""From a calibration and what a microphone heard to a refined calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from autd_trials.acoustics.air import Air
from autd_trials.calibration.acoustic.heard import Heard
from autd_trials.calibration.acoustic.refine import Refined, refine
from autd_trials.calibration.energy import predict_energy
from autd_trials.calibration.file import CalibratedUnit, Calibration
from autd_trials.calibration.provenance import Source, provenance


@dataclass(frozen=True, eq=False)
class Change:
    """By how much the refinement moved a unit: its middle in mm, and its direction in degrees."""

    name: str
    shift_mm: float
    turn_deg: float


def refine_calibration(
    calibration: Calibration,
    heard: Sequence[Heard],
    *,
    air: Air,
    microphone_sd_mm: float,
    target_mm: tuple[float, float, float],
    seed: int,
    time: datetime,
    inputs: dict[str, str],
    before: Source,
    sound: Source,
) -> tuple[Calibration, Refined, list[Change]]:
    """Return the refined calibration, what was fitted, and what changed.

    Parameters
    ----------
    calibration
        To start from, right within 40 mm and 3 degrees.
    heard
        What the microphone heard of its units.
    air
        For the speed of sound, which is fitted too.
    microphone_sd_mm
        How well each coordinate of the microphone's points is known.
    target_mm
        Where the energy is predicted.
    seed
        Of all that is random.
    time
        When this is computed; aware.
    inputs
        SHA-256 of each file that was read.
    before
        Where the calibration to start from comes from. If every unit but the first was heard, no pose is kept
        from it, and its age is of no account.
    sound
        Where the sound comes from.

    Raises
    ------
    UsageError
        A unit was heard that is not in the calibration, or the phases fit no pose.
    """
    generator = np.random.default_rng(seed)
    refined = refine(
        calibration.unit_poses(),
        heard,
        speed_of_sound_m_s=air.speed_of_sound_m_s,
        microphone_sd_mm=microphone_sd_mm,
        generator=generator,
    )
    way = "phases" if heard[0].synchronised else "amplitudes at four phase steps"
    what = "simulated microphone" if sound.origin == "simulated" else "microphone"
    all_heard = all(covariance is not None for covariance in refined.covariances[1:])
    start = before.model_copy(update={"what": "start" if all_heard else "calibration"})
    units = [_unit(number, calibration, refined) for number in range(len(calibration.units))]
    result = Calibration(
        frame=calibration.frame,
        **provenance([start, sound]),
        method=f"{calibration.method}; refined by {way} at a {what}",
        time=time,
        inputs=inputs,
        settings={
            "microphone_sd_mm": microphone_sd_mm,
            "expected speed_of_sound_m_s": round(air.speed_of_sound_m_s, 3),
            "fitted speed_of_sound_m_s": round(refined.speed_of_sound_m_s, 3),
            "residual_rad": round(refined.residual_rad, 4),
            "sources": sum(len(each.sources) for each in heard),
            "points": sum(len(each.points_mm) for each in heard),
            "seed": seed,
        },
        units=tuple(units),
    )
    energy = predict_energy(result, target_mm, air, generator)
    return result.model_copy(update={"predicted_energy": energy}), refined, _changes(calibration, result)


def _unit(number: int, calibration: Calibration, refined: Refined) -> CalibratedUnit:
    covariance = refined.covariances[number]
    before = calibration.units[number]
    if covariance is None:
        return before
    pose = refined.units[number]
    return CalibratedUnit.model_validate(
        {
            "name": before.name,
            "rotation": tuple(tuple(map(float, row)) for row in pose.rotation),
            "translation_mm": tuple(map(float, pose.translation_mm)),
            "covariance": tuple(tuple(map(float, row)) for row in covariance),
        }
    )


def _changes(before: Calibration, after: Calibration) -> list[Change]:
    from scipy.spatial.transform import Rotation

    changes = []
    for old, new in zip(before.unit_poses(), after.unit_poses(), strict=True):
        turn = Rotation.from_matrix(new.rotation @ old.rotation.T).magnitude()
        shift_mm = float(np.linalg.norm(new.centre_mm - old.centre_mm))
        changes.append(Change(new.name, round(shift_mm, 4), round(float(np.degrees(turn)), 5)))
    return changes
