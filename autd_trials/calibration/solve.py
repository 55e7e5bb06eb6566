"""From what the units saw to a calibration: where they stand, and how well that is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import Vectors
from autd_trials.calibration.cloud import Cloud, examine_cloud
from autd_trials.calibration.energy import predict_energy
from autd_trials.calibration.file import CalibratedUnit, Calibration, Counts, RangeError, Residuals
from autd_trials.calibration.impossible import refuse_impossible
from autd_trials.calibration.joint import JointEstimate
from autd_trials.calibration.normal_equations import Wand
from autd_trials.calibration.provenance import Source, provenance
from autd_trials.calibration.registration import Registered, register_jointly, register_paper
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensor_model import Sensor
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.sightings import Sightings, paired, sensors_of
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError

FRAME = (
    "unit 1's: origin at transducer 0 of its device 0 (a corner), x to the right, y up, z out along the "
    "emission; mm"
)


@dataclass(frozen=True, eq=False)
class Solution:
    """A calibration and what it rests on.

    Attributes
    ----------
    calibration
        What goes into the file.
    time_s
        The first unit's times, shape (n,); None if nobody knows them.
    places_mm
        Where each unit saw the target then, shape (units, n, 3), in the calibrated frame; NaN for outliers.
    sensors_mm
        Where the sensors stand, shape (units, 3).
    clock_offsets_s
        What was added to the first unit's times to get each unit's; None without times.
    cloud
        The right points.
    warnings
        What a person should know, and do.
    """

    calibration: Calibration
    time_s: NDArray[np.float64] | None
    places_mm: NDArray[np.float64]
    sensors_mm: Vectors
    clock_offsets_s: Vectors | None
    cloud: Cloud
    warnings: tuple[str, ...]

    def gaps_mm(self, unit: int) -> NDArray[np.float64]:
        """Return where a unit saw the target less where the first one did, shape (n, 3)."""
        gaps: NDArray[np.float64] = self.places_mm[unit] - self.places_mm[0]
        return gaps


def calibrate(
    tracks: Sequence[Track],
    settings: Settings,
    *,
    time: datetime,
    air: Air,
    mounts: Sequence[RigidMotion] | None = None,
    wands: Sequence[Wand] = (),
    inputs: dict[str, str] | None = None,
    sources: Sequence[Source] = (),
) -> Solution:
    """Return where the units stand.

    Parameters
    ----------
    tracks
        What each unit's sensor saw, the first unit's first; their names are the units'.
    settings
        How to calibrate.
    time
        When this is computed; aware.
    air
        The air, for the prediction of the energy.
    mounts
        From each sensor's frame to its unit's; None takes the frames as the same.
    wands
        What each unit saw of a wand of known length, to estimate errors of the range.
    inputs
        SHA-256 of each file that was read.
    sources
        Where each of them comes from; unknown if there are none.

    Raises
    ------
    UsageError
        The tracks have too little in common, do not fit together or do not give a pose, or the target
        would lie behind a unit.
    """
    sightings = paired(tracks, settings, np.random.default_rng(settings.seed))
    return solve(
        sightings, settings, time=time, air=air, mounts=mounts, wands=wands, inputs=inputs, sources=sources
    )


def solve(
    sightings: Sightings,
    settings: Settings,
    *,
    time: datetime,
    air: Air,
    mounts: Sequence[RigidMotion] | None = None,
    wands: Sequence[Wand] = (),
    inputs: dict[str, str] | None = None,
    sources: Sequence[Source] = (),
) -> Solution:
    """Return where the units stand, from points that are paired; other parameters as for `calibrate`.

    Raises
    ------
    UsageError
        The points do not fit together, do not give a pose or give one that cannot be.
    """
    generator = np.random.default_rng(settings.seed)
    names = sightings.names
    sensors, strange = sensors_of(sightings, settings)
    registered = _registered(sightings, settings, sensors, wands, generator)
    offsets_s = None
    if sightings.clock_offsets_s is not None:
        offsets_s = sightings.clock_offsets_s + registered.clock_steps_s
    mounted = list(mounts) if mounts else [RigidMotion.identity()] * len(names)
    first = mounted[0]
    places_mm = first.apply(np.where(registered.inliers[..., None], registered.places_mm, np.nan))
    sensors_mm = np.array([first.apply(motion.translation_mm) for motion in registered.motions])
    both = registered.inliers[0] & registered.inliers[1:].any(axis=0)
    cameras = [sensor.viewpoint for sensor in sensors]
    cloud = examine_cloud(np.nanmean(places_mm[:, both], axis=0), sensors_mm if all(cameras) else None)
    refuse_impossible(registered, names, cameras)
    calibration = Calibration(
        frame=FRAME,
        **provenance(sources),
        method=_method(sightings, settings, wands, registered.joint),
        time=time,
        inputs=inputs or {},
        settings=_record(sightings, settings, cameras, registered, offsets_s),
        units=tuple(_unit(unit, names[unit], registered, mounted) for unit in range(len(names))),
    )
    if all(cameras) or mounts:  # else the frames are not the units'
        target_mm = settings.target_mm or _triple(cloud.centre_mm.round(1))
        _refuse_behind(calibration, target_mm)
        energy = predict_energy(calibration, target_mm, air, generator)
        calibration = calibration.model_copy(update={"predicted_energy": energy})
    warnings = [*strange, *cloud.warnings, *_range_warnings(registered, names, settings, wands)]
    if mounts is None:
        warnings.append(
            "no mounts were given: each sensor's frame is taken as its unit's, which no residual can check; "
            "give --mounts, or refine with --acoustic"
        )
    return Solution(calibration, sightings.time_s, places_mm, sensors_mm, offsets_s, cloud, tuple(warnings))


def _refuse_behind(calibration: Calibration, target_mm: tuple[float, float, float]) -> None:
    for unit in calibration.unit_poses():
        if (np.array(target_mm) - unit.centre_mm) @ unit.axis <= 0:
            raise UsageError(
                "the target ({:.0f}, {:.0f}, {:.0f}) mm".format(*target_mm) + f" lies behind {unit.name}",
                do="correct the mounts: sensors look along their unit's z, out along the emission; or "
                "declare frames that are no cameras'",
            )


def _registered(
    sightings: Sightings,
    settings: Settings,
    sensors: Sequence[Sensor],
    wands: Sequence[Wand],
    generator: np.random.Generator,
) -> Registered:
    if settings.method == "paper":
        return register_paper(sightings.points_mm, sightings.names, settings.mad_factor)
    return register_jointly(
        sightings.points_mm,
        sightings.names,
        generator,
        sensors,
        velocities_mm_s=sightings.velocities_mm_s,
        wands=wands,
    )


def _unit(unit: int, name: str, registered: Registered, mounts: Sequence[RigidMotion]) -> CalibratedUnit:
    if unit == 0:
        identity = RigidMotion.identity()
        return _calibrated(name, identity, range_error=_range_error(0, registered.joint))
    pose = mounts[0].after(registered.motions[unit]).after(mounts[unit].inverse())
    gaps_mm = registered.gaps_mm(unit)
    distances_mm = np.linalg.norm(gaps_mm[~np.isnan(gaps_mm[:, 0])], axis=1)
    paired = ~np.isnan(registered.places_mm[unit, :, 0]) & ~np.isnan(registered.places_mm[0, :, 0])
    return _calibrated(
        name,
        pose,
        residuals=Residuals(
            rms_mm=round(float(np.sqrt((distances_mm**2).mean())), 4),
            largest_mm=round(float(distances_mm.max()), 4),
        ),
        counts=Counts(points=int(paired.sum()), outliers=int(paired.sum()) - len(distances_mm)),
        covariance=_covariance_at_origin(unit, registered, mounts[0], pose),
        range_error=_range_error(unit, registered.joint),
    )


def _calibrated(
    name: str,
    pose: RigidMotion,
    *,
    residuals: Residuals | None = None,
    counts: Counts | None = None,
    covariance: NDArray[np.float64] | None = None,
    range_error: RangeError | None = None,
) -> CalibratedUnit:
    rows = None if covariance is None else tuple(tuple(map(float, row)) for row in covariance)
    return CalibratedUnit.model_validate(
        {
            "name": name,
            "rotation": tuple(_triple(row) for row in pose.rotation),
            "translation_mm": _triple(pose.translation_mm),
            "residuals": residuals,
            "counts": counts,
            "covariance": rows,
            "range_error": range_error,
        }
    )


def _covariance_at_origin(
    unit: int, registered: Registered, first_mount: RigidMotion, pose: RigidMotion
) -> NDArray[np.float64] | None:
    """Move the covariance from the cloud's centre to the unit's origin, and into the calibrated frame."""
    if registered.joint is None:
        return None
    turned = np.kron(np.eye(2), first_mount.rotation)
    at_centre = turned @ registered.joint.pose_covariance(unit) @ turned.T
    x, y, z = pose.translation_mm - first_mount.apply(registered.joint.centre_mm)
    shift = np.eye(6)
    shift[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    covariance: NDArray[np.float64] = shift @ at_centre @ shift.T
    return covariance


def _range_error(unit: int, joint: JointEstimate | None) -> RangeError | None:
    if joint is None or not (joint.bias_sd_mm[unit] or joint.scale_sd[unit]):
        return None
    return RangeError(
        bias_mm=float(joint.range_errors.biases_mm[unit]),
        bias_sd_mm=float(joint.bias_sd_mm[unit]),
        scale=float(joint.range_errors.scales[unit]),
        scale_sd=float(joint.scale_sd[unit]),
    )


def _range_warnings(
    registered: Registered, names: Sequence[str], settings: Settings, wands: Sequence[Wand]
) -> list[str]:
    """Say what the ranges may be wrong by."""
    joint = registered.joint
    if joint is None or wands or not (joint.bias_sd_mm.any() or joint.scale_sd.any()):
        return []
    warnings = []
    if joint.range_corrected:
        found = ", ".join(
            f"{name} {bias_mm:+.1f} +- {sd_mm:.1f} mm"
            for name, bias_mm, sd_mm in zip(
                names, joint.range_errors.biases_mm, joint.bias_sd_mm, strict=True
            )
        )
        warnings.append(f"the points show that the sensors' ranges are wrong; this is corrected ({found})")
    if joint.scale_sd.any():
        warnings.append(
            f"points do not see a common scale of the ranges: {settings.range_scale_sd:.1%} of them "
            "(standard deviation) is counted as unknown; a wand of known length shows it"
        )
    return warnings


def _method(
    sightings: Sightings, settings: Settings, wands: Sequence[Wand], joint: JointEstimate | None
) -> str:
    pairing = {
        "interpolated": "interpolated in time with the clocks' offset estimated",
        "nearest": "nearest time stamps",
    }[settings.pairing]
    if sightings.time_s is None:
        pairing = "pairs as given"
    if joint is None:
        factor = f"{settings.mad_factor:g}"
        return f"paper's equations 1 to 10 (SVD with Tukey weights, MAD factor {factor}); {pairing}"
    extra = ""
    if wands:
        extra = "; range bias and scale by a wand"
    elif joint.range_corrected:
        extra = "; range biases corrected"
    return f"robust start and joint maximum likelihood{extra}; {pairing}"


def _record(
    sightings: Sightings,
    settings: Settings,
    cameras: Sequence[bool],
    registered: Registered,
    offsets_s: Vectors | None,
) -> dict[str, str | int | float | bool]:
    record: dict[str, str | int | float | bool] = {"method": settings.method, "seed": settings.seed}
    if sightings.time_s is not None:
        record["pairing"] = settings.pairing
    if registered.joint is None:
        record["mad_factor"] = settings.mad_factor
    else:
        record |= {
            "range_bias": settings.range_bias,
            "range_scale_sd": settings.range_scale_sd,
            "noise_along_mm": settings.noise.along_mm,
            "noise_across_mm": settings.noise.across_mm,
            "noise_scale": round(registered.joint.noise_scale, 4),
            "range_corrected": registered.joint.range_corrected,
        }
    record |= {f"viewpoint of {name}": each for name, each in zip(sightings.names, cameras, strict=True)}
    if offsets_s is None:
        return record
    names = sightings.names
    for name, offset_s in list(zip(names, offsets_s, strict=True))[1:]:
        record[f"clock_offset_s of {name}"] = round(float(offset_s), 6)
    return record


def _triple(vector: Vectors) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
