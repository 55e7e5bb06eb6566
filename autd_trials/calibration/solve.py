"""From tracks to a calibration: pair in time, register, and say how well the poses are known."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import Vectors
from autd_trials.calibration.cloud import Cloud, examine_cloud
from autd_trials.calibration.energy import predict_energy
from autd_trials.calibration.file import CalibratedUnit, Calibration, Counts, RangeError, Residuals
from autd_trials.calibration.joint import JointEstimate, SensorNoise, Wand
from autd_trials.calibration.pairing import pair_interpolated, pair_nearest
from autd_trials.calibration.provenance import Source, provenance
from autd_trials.calibration.registration import Registered, register_jointly, register_paper
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError

FRAME = (
    "unit 1's: origin at transducer 0 of its device 0 (a corner), x to the right, y up, z out along the "
    "emission; mm"
)

_BIAS_SD = 3.0  # a bias this many standard deviations from 0 is worth a warning
_LONGEST_LAG = 50


@dataclass(frozen=True)
class Settings:
    """How to calibrate.

    Attributes
    ----------
    method
        ``joint`` (robust start, maximum likelihood) or ``paper`` (equations 1 to 10).
    pairing
        ``interpolated`` (with the clocks' offset) or ``nearest`` (the paper's).
    mad_factor
        Of the paper's equation 10.
    range_bias
        Whether to estimate a constant error of every sensor's range; not by the paper's method.
    noise
        Of the sensors; its shape matters, its size is estimated.
    target_mm
        Where the energy is predicted, in the calibrated frame; the cloud's centre if None.
    seed
        Of all that is random.
    """

    method: Literal["joint", "paper"] = "joint"
    pairing: Literal["interpolated", "nearest"] = "interpolated"
    mad_factor: float = NORMAL_MAD_FACTOR
    range_bias: bool = True
    noise: SensorNoise = field(default_factory=SensorNoise)
    target_mm: tuple[float, float, float] | None = None
    seed: int = 1


@dataclass(frozen=True, eq=False)
class Solution:
    """A calibration and what it rests on.

    Attributes
    ----------
    calibration
        What goes into the file.
    time_s
        The first unit's times, shape (n,).
    places_mm
        Where each unit saw the target then, shape (units, n, 3), in the calibrated frame; NaN for outliers.
    sensors_mm
        Where the sensors stand, shape (units, 3).
    clock_offsets_s
        What was added to the first unit's times to get each unit's.
    cloud
        The right points.
    warnings
        What a person should know, and do.
    """

    calibration: Calibration
    time_s: NDArray[np.float64]
    places_mm: NDArray[np.float64]
    sensors_mm: Vectors
    clock_offsets_s: Vectors
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
    generator = np.random.default_rng(settings.seed)
    observed_mm, velocities_mm_s, offsets_s = _paired(tracks, settings, generator)
    names = [track.name for track in tracks]
    registered = _registered(observed_mm, velocities_mm_s, names, settings, wands, generator)
    offsets_s = offsets_s + registered.clock_steps_s
    mounted = list(mounts) if mounts else [RigidMotion.identity()] * len(tracks)
    first = mounted[0]
    right = np.where(registered.inliers[..., None], registered.places_mm, np.nan)
    places_mm = first.apply(right)
    sensors_mm = np.array([first.apply(motion.translation_mm) for motion in registered.motions])
    both = registered.inliers[0] & registered.inliers[1:].any(axis=0)
    cloud = examine_cloud(np.nanmean(places_mm[:, both], axis=0), sensors_mm)
    units = [_unit(unit, names[unit], registered, mounted) for unit in range(len(tracks))]
    calibration = Calibration(
        frame=FRAME,
        **provenance(sources),
        method=_method(settings, wands),
        time=time,
        inputs=inputs or {},
        settings=_record(settings, registered, names, offsets_s),
        units=tuple(units),
    )
    target_mm = settings.target_mm or _triple(cloud.centre_mm.round(1))
    _refuse_behind(calibration, target_mm)
    energy = predict_energy(calibration, target_mm, air, generator)
    calibration = calibration.model_copy(update={"predicted_energy": energy})
    warnings = [*cloud.warnings, *_range_warnings(observed_mm, registered, names, settings, wands, generator)]
    if mounts is None:
        warnings.append(
            "no mounts were given: each sensor's frame is taken as its unit's, which no residual can check; "
            "give --mounts, or refine with --acoustic"
        )
    return Solution(calibration, tracks[0].time_s, places_mm, sensors_mm, offsets_s, cloud, tuple(warnings))


def _refuse_behind(calibration: Calibration, target_mm: tuple[float, float, float]) -> None:
    for unit in calibration.unit_poses():
        if (np.array(target_mm) - unit.centre_mm) @ unit.axis <= 0:
            raise UsageError(
                "the target ({:.0f}, {:.0f}, {:.0f}) mm".format(*target_mm) + f" lies behind {unit.name}",
                do="correct the mounts: sensors look along their unit's z, out along the emission",
            )


def _paired(
    tracks: Sequence[Track], settings: Settings, generator: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, Vectors]:
    """Return points and velocities at the first unit's times, (units, n, 3), and the clocks' offsets."""
    observed, offsets_s = [tracks[0].points_mm], [0.0]
    velocities_mm_s = [np.zeros_like(tracks[0].points_mm)]
    for track in tracks[1:]:
        if settings.pairing == "nearest":
            pairs = pair_nearest(tracks[0], track)
        else:
            pairs = pair_interpolated(tracks[0], track, generator)
        observed.append(pairs.points_mm)
        velocities_mm_s.append(pairs.velocities_mm_s)
        offsets_s.append(pairs.clock_offset_s)
    known = settings.pairing == "interpolated"
    return np.array(observed), np.array(velocities_mm_s) if known else None, np.array(offsets_s)


def _registered(
    observed_mm: NDArray[np.float64],
    velocities_mm_s: NDArray[np.float64] | None,
    names: Sequence[str],
    settings: Settings,
    wands: Sequence[Wand],
    generator: np.random.Generator,
) -> Registered:
    if settings.method == "paper":
        return register_paper(observed_mm, names, settings.mad_factor)
    return register_jointly(
        observed_mm,
        names,
        generator,
        settings.noise,
        velocities_mm_s=velocities_mm_s,
        range_bias=settings.range_bias,
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
    """Move the covariance from the cloud's centre to the unit's origin, and into the calibrated frame.

    Successive points of a track may err alike; their errors' autocorrelation makes the covariance larger.
    """
    if registered.joint is None:
        return None
    turned = np.kron(np.eye(2), first_mount.rotation)
    at_centre = turned @ registered.joint.pose_covariance(unit) @ turned.T
    x, y, z = pose.translation_mm - first_mount.apply(registered.joint.centre_mm)
    shift = np.eye(6)
    shift[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    covariance: NDArray[np.float64] = shift @ at_centre @ shift.T * _repetition(registered.gaps_mm(unit))
    return covariance


def _repetition(gaps_mm: NDArray[np.float64]) -> float:
    """Return how many points tell as much as one independent one: 1 + 2 x sum of autocorrelations."""
    centred = np.nan_to_num(gaps_mm - np.nanmean(gaps_mm, axis=0))
    there = (~np.isnan(gaps_mm[:, 0])).astype(np.float64)
    variance = float((centred**2).sum() / there.sum())
    total = 1.0
    for lag in range(1, min(_LONGEST_LAG, len(centred) // 4)):
        pairs = float((there[lag:] * there[:-lag]).sum())
        correlation = float((centred[lag:] * centred[:-lag]).sum()) / max(pairs, 1.0) / variance
        if correlation < 2 / np.sqrt(3 * max(pairs, 1.0)):  # no longer told from noise
            break
        total += 2 * correlation
    return total


def _range_error(unit: int, joint: JointEstimate | None) -> RangeError | None:
    if joint is None or not joint.bias_sd_mm.any():
        return None
    return RangeError(
        bias_mm=float(joint.range_errors.biases_mm[unit]),
        bias_sd_mm=float(joint.bias_sd_mm[unit]),
        scale=float(joint.range_errors.scales[unit]),
        scale_sd=float(joint.scale_sd[unit]),
    )


def _range_warnings(
    observed_mm: NDArray[np.float64],
    registered: Registered,
    names: Sequence[str],
    settings: Settings,
    wands: Sequence[Wand],
    generator: np.random.Generator,
) -> list[str]:
    """Say when the points show range biases that nobody asked for, and what else looks like one."""
    if settings.method == "paper" or wands:
        return []
    if registered.bias_scale_correlations is not None:
        strongest = float(registered.bias_scale_correlations.min())
        return [
            f"range biases were estimated as constant; a bias and a range scale look alike (correlation "
            f"{strongest:.2f}), and only a wand of known length tells them apart (--wand)"
        ]
    kept = np.where(registered.inliers[..., None], observed_mm, np.nan)
    joint = register_jointly(kept, names, generator, settings.noise, range_bias=True).joint
    assert joint is not None
    biases_mm, sd_mm = joint.range_errors.biases_mm, joint.bias_sd_mm
    if (np.abs(biases_mm) < _BIAS_SD * sd_mm).all():
        return []
    found = ", ".join(f"{n} {b:+.1f} +- {s:.1f} mm" for n, b, s in zip(names, biases_mm, sd_mm, strict=True))
    return [f"the points show errors of the sensors' ranges ({found}); leave out --no-range-bias"]


def _method(settings: Settings, wands: Sequence[Wand]) -> str:
    pairing = {
        "interpolated": "interpolated in time with the clocks' offset estimated",
        "nearest": "nearest time stamps",
    }[settings.pairing]
    if settings.method == "paper":
        factor = f"{settings.mad_factor:g}"
        return f"paper's equations 1 to 10 (SVD with Tukey weights, MAD factor {factor}); {pairing}"
    extra = "; range bias and scale by a wand" if wands else "; range biases" if settings.range_bias else ""
    return f"robust start and joint maximum likelihood with noise along the viewing rays{extra}; {pairing}"


def _record(
    settings: Settings, registered: Registered, names: Sequence[str], offsets_s: Vectors
) -> dict[str, str | int | float | bool]:
    record: dict[str, str | int | float | bool] = {
        "method": settings.method,
        "pairing": settings.pairing,
        "range_bias": settings.range_bias,
        "seed": settings.seed,
        "noise_along_mm": settings.noise.along_mm,
        "noise_across_mm": settings.noise.across_mm,
    }
    if registered.joint is None:
        record["mad_factor"] = settings.mad_factor
    else:
        record["noise_scale"] = round(registered.joint.noise_scale, 4)
    for name, offset_s in list(zip(names, offsets_s, strict=True))[1:]:
        record[f"clock_offset_s of {name}"] = round(float(offset_s), 6)
    return record


def _triple(vector: Vectors) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
