"""The poses of all units' sensors from what they saw of the same points: a robust maximum likelihood.

Every unit sees the same points, with noise along and across the viewing ray. The points are unknown too, so
that rays and derivatives are taken at the fitted points and never at the noisy ones. Gauss-Newton over poses,
points, errors of the range and clocks, the points eliminated; a point that fits badly counts less (Tukey).

The covariance is the robust one, curvature^-1 x scatter of the slopes x curvature^-1: it holds for noise of
another shape than assumed, with heavy tails, and correlated in time.

A sensor's range may be wrong: it reads ``bias_mm + (1 + scale) * range``. Points see a bias more or less well
and a common scale of all sensors not at all, as a larger world fits as well. Both have a prior. What is not
corrected still widens the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.normal_equations import POSE, Problem, RangeErrors, State, Wand
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensor_model import Sensor
from autd_trials.errors import UsageError

_PAYS_P = 1e-3
_SEEN = 0.25  # of the prior's standard deviation
_LARGEST_BIAS_SDS = 4.0


@dataclass(frozen=True, eq=False)
class JointEstimate:
    """Poses of all units' sensors in the first one's frame, and how well they are known.

    Attributes
    ----------
    motions
        From each sensor's frame to the first one's; the first is the identity.
    range_errors
        Zeros if they are not corrected.
    range_corrected
        Whether the points show the range errors well enough to correct them.
    covariance
        Of x, y, z in mm and the rotation vector in rad about the cloud's centre for each unit but the first,
        in the first one's frame; then of what else is uncertain.
    centre_mm
        The cloud's centre in the first sensor's frame, about which the rotations are counted.
    bias_sd_mm, scale_sd
        Standard deviations of the range errors, shape (units,), corrected or not; zeros for right ranges.
    noise_scale
        By how much the points scatter more than the assumed noise.
    log_volume
        Logarithm of the volume within which points scatter; smaller with better assumptions on the noise.
    clock_steps_s
        By how much later each unit should have been looked at, shape (units,); zeros if not estimated.
    """

    motions: tuple[RigidMotion, ...]
    range_errors: RangeErrors
    range_corrected: bool
    covariance: NDArray[np.float64]
    centre_mm: Vectors
    bias_sd_mm: Vectors
    scale_sd: Vectors
    noise_scale: float
    log_volume: float
    clock_steps_s: Vectors

    def places(self, observed_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where units saw points, shape (units, n, 3), in the first sensor's frame."""
        return np.array(
            [
                motion.apply(self.range_errors.corrected(points_mm, unit))
                for unit, (motion, points_mm) in enumerate(zip(self.motions, observed_mm, strict=True))
            ]
        )

    def pose_covariance(self, unit: int) -> NDArray[np.float64]:
        """Return the covariance of one unit's shift and rotation about the cloud's centre, shape (6, 6)."""
        part = slice(POSE * (unit - 1), POSE * unit)
        return self.covariance[part, part]


def fit_jointly(
    observed_mm: NDArray[np.float64],
    start: Sequence[RigidMotion],
    sensors: Sequence[Sensor],
    *,
    velocities_mm_s: NDArray[np.float64] | None = None,
    wands: Sequence[Wand] = (),
) -> JointEstimate:
    """Return the most likely poses of all units' sensors.

    Range errors are corrected only where the points see a bias to a quarter of its prior's standard deviation
    and show one that differs from 0 (p < 0.001), or where there are wands.

    Parameters
    ----------
    observed_mm
        Each unit's points in its own sensor's frame, the sensor at the origin, in mm, shape (units, n, 3), in
        the order of time; NaN where a unit did not see a point. Gross outliers must have been taken out.
    start
        Poses to start from, one for each unit; the first is taken as the identity.
    sensors
        What is known of each sensor.
    velocities_mm_s
        The points' velocities in the sensors' frames, to estimate what is left of the clocks' differences.
    wands
        What each unit saw of a wand, in the units' order. Then bias and scale of every sensor are estimated,
        without a prior.

    Raises
    ------
    UsageError
        The fit does not settle, or a range error is found that no sensor has.
    """
    problem = Problem(observed_mm, sensors, velocities_mm_s, wands)
    state = problem.settled(problem.start(start), range_free=bool(wands))
    covariance, corrected, centre_mm = problem.covariance(state), bool(wands), state.centre_mm
    if not wands and (problem.uncertain & (problem.biases | problem.scales)).any():
        aware = problem.settled(state, range_free=True)
        covariance, centre_mm = problem.covariance(aware), aware.centre_mm
        corrected = _pays(aware, covariance, problem)
        if corrected:
            _refuse_unbounded(aware, sensors)
            state = aware
        else:  # what the points say of the range errors is not followed: it counts as an error
            difference = problem.difference(aware, state)
            covariance = covariance + np.outer(difference, difference)
    sds = np.sqrt(np.diag(covariance))
    return JointEstimate(
        motions=tuple(state.motions),
        range_errors=RangeErrors(state.biases_mm, state.scales),
        range_corrected=corrected,
        covariance=covariance[np.ix_(problem.uncertain, problem.uncertain)],
        centre_mm=centre_mm,
        bias_sd_mm=sds[problem.biases],
        scale_sd=sds[problem.scales],
        noise_scale=state.noise_scale,
        log_volume=problem.log_volume(state),
        clock_steps_s=state.clock_steps_s,
    )


def _pays(aware: State, covariance: NDArray[np.float64], problem: Problem) -> bool:
    """Return whether the points see every bias well, and one that is not 0."""
    from scipy.stats import chi2

    kept = np.flatnonzero(problem.biases & problem.uncertain)
    if len(kept) == 0 or (np.sqrt(np.diag(covariance)[kept]) > _SEEN * problem.prior_sds[kept]).any():
        return False
    biases_mm = aware.biases_mm[problem.uncertain[problem.biases]]
    distance = biases_mm @ np.linalg.solve(covariance[np.ix_(kept, kept)], biases_mm)
    return bool(distance > chi2.isf(_PAYS_P, len(kept)))


def _refuse_unbounded(state: State, sensors: Sequence[Sensor]) -> None:
    for bias_mm, sensor in zip(state.biases_mm, sensors, strict=True):
        if abs(bias_mm) > _LARGEST_BIAS_SDS * sensor.bias_sd_mm > 0:
            raise UsageError(
                f"the points ask for a range that is wrong by {bias_mm:+.0f} mm, which no sensor's is",
                do="see that all sensors look at the same target and that x, y, z are in the sensor's own "
                "frame with its origin at the optical centre; or give --no-range-bias",
            )
