"""The poses of any number of units' sensors from paired points: the project's own method, and the paper's."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from autd_trials.calibration.joint import JointEstimate, fit_jointly
from autd_trials.calibration.normal_equations import TUKEY_CHI2, Wand
from autd_trials.calibration.pairing import LARGEST_OFFSET_S
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.robust import register_as_the_paper, register_robustly
from autd_trials.calibration.sensor_model import Sensor
from autd_trials.errors import UsageError

_ENOUGH_FOR_THE_NOISE = 1000  # points
_GATE_PASSES = 3
_SETTLED_SHARE = 2e-3  # of the points may change sides: those at the gate hardly weigh anything
_FEWEST_INLIERS = 6
_NO_COMMON_MOTION_MM = 50.0  # right pairs were seen to scatter by 25 mm with a bad sensor
_MIRRORED_RATIO = 0.5
_LEAST_SHARE = 0.3  # of the points must agree
_OTHER_UNIT_OF_LENGTH = 2.0  # times as far spread


@dataclass(frozen=True, eq=False)
class Registered:
    """Where the sensors stand, and the points that say so.

    Attributes
    ----------
    motions
        From each sensor's frame to the first one's.
    inliers
        Which of a unit's points count, shape (units, n).
    places_mm
        Where the units saw the points, shape (units, n, 3), in the first sensor's frame.
    joint
        The estimate with its covariance; None for the paper's method, which has none.
    clock_steps_s
        By how much later each unit should have been looked at, shape (units,).
    """

    motions: tuple[RigidMotion, ...]
    inliers: NDArray[np.bool_]
    places_mm: NDArray[np.float64]
    joint: JointEstimate | None
    clock_steps_s: NDArray[np.float64]

    def gaps_mm(self, unit: int) -> NDArray[np.float64]:
        """Return where a unit saw points less where the first one did, shape (n, 3); NaN for outliers."""
        both = self.inliers[unit] & self.inliers[0]
        return np.where(both[:, None], self.places_mm[unit] - self.places_mm[0], np.nan)


def register_jointly(
    observed_mm: NDArray[np.float64],
    names: Sequence[str],
    generator: np.random.Generator,
    sensors: Sequence[Sensor] | None = None,
    *,
    velocities_mm_s: NDArray[np.float64] | None = None,
    wands: Sequence[Wand] = (),
) -> Registered:
    """Register robustly, then by maximum likelihood over all units.

    Parameters
    ----------
    observed_mm
        Each unit's points in its own sensor's frame in mm, shape (units, n, 3), in the order of time; NaN
        where it saw none.
    names
        What the units are called, for messages.
    generator
        For the robust start.
    sensors
        What is known of each unit's sensor; depth cameras if None.
    velocities_mm_s
        The points' velocities in the sensors' frames, to let the clocks' offsets vary with the poses.
    wands
        What each unit saw of a wand, to estimate bias and scale of every sensor's range.

    Raises
    ------
    UsageError
        No motion brings the points together, or one frame is the mirror image of the other.
    """
    motions = [RigidMotion.identity()]
    inliers = np.zeros(observed_mm.shape[:2], dtype=bool)
    for unit in range(1, len(observed_mm)):
        motion, kept = _register_pair(observed_mm[unit], observed_mm[0], (names[unit], names[0]), generator)
        motions.append(motion)
        inliers[unit] = kept
    inliers[0] = inliers[1:].any(axis=0)
    known, estimate = _with_fitting_noise(
        np.where(inliers[..., None], observed_mm, np.nan),
        motions,
        sensors or [Sensor()] * len(observed_mm),
        velocities_mm_s,
    )
    for number in range(_GATE_PASSES):
        then_mm = observed_mm
        if velocities_mm_s is not None:
            then_mm = observed_mm + estimate.clock_steps_s[:, None, None] * velocities_mm_s
        new = _consistent(then_mm, estimate, known)
        if number > 0 and (new != inliers).mean() < _SETTLED_SHARE:
            break
        inliers = new
        counted = np.where(inliers[..., None], observed_mm, np.nan)
        estimate = fit_jointly(counted, estimate.motions, known, velocities_mm_s=velocities_mm_s, wands=wands)
    return Registered(estimate.motions, inliers, estimate.places(then_mm), estimate, estimate.clock_steps_s)


def register_paper(observed_mm: NDArray[np.float64], names: Sequence[str], mad_factor: float) -> Registered:
    """Register each unit with the first one by the paper's equations 1 to 10; same parameters.

    Points with no weight count as outliers.
    """
    motions = [RigidMotion.identity()]
    inliers = np.zeros(observed_mm.shape[:2], dtype=bool)
    for unit in range(1, len(observed_mm)):
        both = _seen_by_both(observed_mm[unit], observed_mm[0], (names[unit], names[0]))
        motion, weights = register_as_the_paper(observed_mm[unit][both], observed_mm[0][both], mad_factor)
        motions.append(motion)
        inliers[unit, both] = weights > 0
    inliers[0] = inliers[1:].any(axis=0)
    places = np.array([motion.apply(points) for motion, points in zip(motions, observed_mm, strict=True)])
    return Registered(tuple(motions), inliers, places, None, np.zeros(len(motions)))


def _register_pair(
    source_mm: NDArray[np.float64],
    target_mm: NDArray[np.float64],
    names: tuple[str, str],
    generator: np.random.Generator,
) -> tuple[RigidMotion, NDArray[np.bool_]]:
    both = _seen_by_both(source_mm, target_mm, names)
    source, target = source_mm[both], target_mm[both]
    found = register_robustly(source, target, generator)
    mirrored = register_robustly(source * [-1, 1, 1], target, generator)
    if mirrored.noise_mm < _MIRRORED_RATIO * found.noise_mm:
        raise UsageError(
            f"the points of {names[0]} are a mirror image of those of {names[1]}",
            do="one sensor's frame is left-handed: negate one axis in its track "
            "(x to the right, y down, z forward is right-handed, and so is x right, y up, z backward)",
        )
    if found.noise_mm > _NO_COMMON_MOTION_MM:
        raise UsageError(
            f"no pose brings the points of {names[0]} and {names[1]} together: even the best pairs are "
            f"{found.noise_mm:.0f} mm apart",
            do=_likely_cause(source, target, names),
        )
    share = float(found.inliers.mean())
    if share < _LEAST_SHARE:
        raise UsageError(
            f"only {share:.0%} of the points of {names[0]} and {names[1]} agree on a pose",
            do=_likely_cause(source, target, names),
        )
    kept = np.zeros(len(both), dtype=bool)
    kept[both] = found.inliers
    return found.motion, kept


def _likely_cause(
    source_mm: NDArray[np.float64], target_mm: NDArray[np.float64], names: tuple[str, str]
) -> str:
    spreads = [
        float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))
        for points in (source_mm, target_mm)
    ]
    ratio = max(spreads) / max(min(spreads), 1e-9)
    if ratio > _OTHER_UNIT_OF_LENGTH:
        larger, smaller = names if spreads[0] > spreads[1] else names[::-1]
        return (
            f"the points of {larger} spread {ratio:.3g} times as far as those of {smaller}: give both in mm "
            "(an inch is 25.4 mm)"
        )
    return (
        "see that both sensors watched the same target at the same time, and that its times are right: "
        f"clocks may differ by {LARGEST_OFFSET_S:g} s"
    )


def _seen_by_both(
    first_mm: NDArray[np.float64], second_mm: NDArray[np.float64], names: tuple[str, str]
) -> NDArray[np.bool_]:
    both: NDArray[np.bool_] = ~np.isnan(first_mm[:, 0]) & ~np.isnan(second_mm[:, 0])
    if both.sum() < _FEWEST_INLIERS:
        raise UsageError(
            f"{names[0]} and {names[1]} have {both.sum()} points in common, too few for a pose",
            do="wave the target where both sensors see it",
        )
    return both


def _with_fitting_noise(
    observed_mm: NDArray[np.float64],
    motions: Sequence[RigidMotion],
    sensors: Sequence[Sensor],
    velocities_mm_s: NDArray[np.float64] | None,
) -> tuple[Sequence[Sensor], JointEstimate]:
    """Return the sensors, with isotropic noise if that fits better, and a first fit."""
    step = -(-observed_mm.shape[1] // _ENOUGH_FOR_THE_NOISE)
    some_mm = observed_mm[:, ::step]
    velocities = None if velocities_mm_s is None else velocities_mm_s[:, ::step]
    shapes = [list(sensors), [replace(sensor, noise=sensor.noise.isotropic) for sensor in sensors]]
    fits = [
        fit_jointly(some_mm, motions, [sensor.trusted for sensor in shape], velocities_mm_s=velocities)
        for shape in shapes[: 1 if shapes[0] == shapes[1] else 2]
    ]
    best = int(np.argmin([fit.log_volume for fit in fits]))
    return shapes[best], fits[best]


def _consistent(
    observed_mm: NDArray[np.float64], estimate: JointEstimate, sensors: Sequence[Sensor]
) -> NDArray[np.bool_]:
    """Return which points have a weight beside the first unit's, (units, n)."""
    places = estimate.places(observed_mm)
    spreads = []
    for motion, points_mm, sensor in zip(estimate.motions, observed_mm, sensors, strict=True):
        rays = points_mm / np.linalg.norm(points_mm, axis=-1, keepdims=True)
        spreads.append(motion.rotation @ sensor.noise.covariances(rays) @ motion.rotation.T)
    inliers = np.zeros(observed_mm.shape[:2], dtype=bool)
    for unit in range(1, len(observed_mm)):
        gaps = places[unit] - places[0]
        information = np.linalg.inv((spreads[unit] + spreads[0]) * estimate.noise_scale**2)
        with np.errstate(invalid="ignore"):  # NaN where one did not see the point: not consistent
            inliers[unit] = np.einsum("ni,nij,nj->n", gaps, information, gaps) < TUKEY_CHI2
    inliers[0] = inliers[1:].any(axis=0)
    return inliers
