"""Joint maximum likelihood of all units' poses, with noise along each viewing ray, and errors of the range.

Every unit sees the same target points. With the poses given, each point's best place follows in closed form
from all units that see it; what is left is minimised over the poses (variable projection, Gauss-Newton). The
curvature there is the inverse covariance.

Clocks differ: what is left of that after pairing shifts a unit's points along their velocities.

A sensor's range may be wrong: it reads ``bias_mm + (1 + scale) * range``. A constant bias can be told from
the points alone. A common scale of all sensors cannot, as a larger world fits as well: it takes a wand of
known length.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.rigid import RigidMotion

_MOST_ITERATIONS = 50
_CONVERGED = 1e-8
_POSE = 6
_NEVER_ZERO_MM = 1e-9


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations in mm of a sensor's points along the viewing ray and across it."""

    along_mm: float = 3.0
    across_mm: float = 1.0

    def covariances(self, rays: Vectors) -> NDArray[np.float64]:
        """Return the covariances of points seen along unit vectors, shape (..., 3) to (..., 3, 3)."""
        outer = rays[..., :, None] * rays[..., None, :]
        covariances: NDArray[np.float64] = self.across_mm**2 * np.eye(3)
        return covariances + (self.along_mm**2 - self.across_mm**2) * outer


@dataclass(frozen=True, eq=False)
class Wand:
    """A stick with two markers as one sensor saw it: its ends in mm in the sensor's frame, both (n, 3)."""

    first_mm: Vectors
    second_mm: Vectors
    length_mm: float


@dataclass(frozen=True, eq=False)
class RangeErrors:
    """What every sensor's range is wrong by, shape (units,): a constant in mm, and a share of the range."""

    biases_mm: Vectors
    scales: Vectors

    def corrected(self, observed_mm: Vectors, unit: int) -> Vectors:
        """Return a unit's points, shape (n, 3), as a right sensor would see them."""
        ranges, rays = _ranges_and_rays(observed_mm)
        corrected: Vectors = rays * (ranges - self.biases_mm[unit]) / (1 + self.scales[unit])
        return corrected


@dataclass(frozen=True, eq=False)
class JointEstimate:
    """Poses of all units' sensors in the first one's frame, and how well they are known.

    Attributes
    ----------
    motions
        From each sensor's frame to the first one's; the first is the identity.
    range_errors
        Zeros if they were not estimated.
    covariance
        Of x, y, z in mm and the rotation vector in rad about the cloud's centre for each unit but the first,
        in the first one's frame; then of biases, scales and clock steps, those that were estimated.
    centre_mm
        The cloud's centre in the first sensor's frame, about which the rotations are counted.
    bias_sd_mm, scale_sd
        Standard deviations of the range errors, shape (units,); zeros if they were not estimated.
    noise_scale
        By how much the points scatter more than the assumed noise.
    clock_steps_s
        By how much later each unit should have been looked at, shape (units,); zeros if not estimated.
    """

    motions: tuple[RigidMotion, ...]
    range_errors: RangeErrors
    covariance: NDArray[np.float64]
    centre_mm: Vectors
    bias_sd_mm: Vectors
    scale_sd: Vectors
    noise_scale: float
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
        part = slice(_POSE * (unit - 1), _POSE * unit)
        return self.covariance[part, part]


def fit_jointly(
    observed_mm: NDArray[np.float64],
    start: Sequence[RigidMotion],
    noise: SensorNoise,
    *,
    velocities_mm_s: NDArray[np.float64] | None = None,
    range_bias: bool = False,
    wands: Sequence[Wand] = (),
) -> JointEstimate:
    """Return the most likely poses of all units' sensors.

    Parameters
    ----------
    observed_mm
        Each unit's points in its own sensor's frame, the sensor at the origin, in mm, shape (units, n, 3);
        NaN where a unit did not see a point. Outliers must have been taken out.
    start
        Poses to start from, one for each unit; the first is taken as the identity.
    noise
        The sensors' noise; only its shape matters, its size is estimated.
    velocities_mm_s
        The points' velocities in the sensors' frames, to estimate what is left of the clocks' differences.
    range_bias
        Whether to estimate a constant error of the range for every sensor too.
    wands
        What each unit saw of a wand, in the units' order. Then bias and scale of every sensor are estimated.
    """
    problem = _Problem(
        observed_mm, noise, wands, velocities_mm_s, bias=range_bias or bool(wands), scale=bool(wands)
    )
    motions = list(start)
    clock_steps_s = np.zeros(len(start))
    errors = RangeErrors(np.zeros(len(start)), np.zeros(len(start)))
    for _ in range(_MOST_ITERATIONS):
        system = problem.linearised(motions, errors, clock_steps_s)
        step: Vectors = np.linalg.solve(system.curvature, system.slope).astype(np.float64)
        motions, errors = problem.moved(motions, errors, step, system.centre_mm)
        clock_steps_s = problem.later(clock_steps_s, step)
        if np.abs(step).max() < _CONVERGED:
            break
    system = problem.linearised(motions, errors, clock_steps_s)
    scale = np.sqrt(system.misfit / max(1, problem.degrees_of_freedom))
    covariance = np.linalg.inv(system.curvature) * scale**2
    bias_sd_mm, scale_sd = problem.range_sds(np.sqrt(np.diag(covariance)))
    return JointEstimate(
        motions=tuple(motions),
        range_errors=errors,
        covariance=covariance,
        bias_sd_mm=bias_sd_mm,
        scale_sd=scale_sd,
        centre_mm=system.centre_mm,
        noise_scale=float(scale),
        clock_steps_s=clock_steps_s,
    )


def bias_scale_correlations(
    observed_mm: NDArray[np.float64], estimate: JointEstimate, noise: SensorNoise
) -> Vectors:
    """Return the correlation of each sensor's range bias with its own range scale, were that one free too.

    Near -1: a bias and a scale look the same from these points. Of the scales only one is let free at a time,
    as their common part cannot be seen at all.
    """
    problem = _Problem(observed_mm, noise, (), None, bias=True, scale=True)
    units = len(estimate.motions)
    curvature = problem.linearised(estimate.motions, estimate.range_errors, np.zeros(units)).curvature
    first_bias = _POSE * (units - 1)
    correlations = np.zeros(units)
    for unit in range(units):
        kept = [*range(first_bias + units), first_bias + units + unit]
        covariance = np.linalg.inv(curvature[np.ix_(kept, kept)])
        bias = first_bias + unit
        correlations[unit] = covariance[bias, -1] / np.sqrt(covariance[bias, bias] * covariance[-1, -1])
    return correlations


@dataclass(frozen=True, eq=False)
class _System:
    curvature: NDArray[np.float64]
    slope: NDArray[np.float64]
    misfit: float
    centre_mm: Vectors


class _Problem:
    """The observations, and the normal equations of their misfit."""

    def __init__(
        self,
        observed_mm: NDArray[np.float64],
        noise: SensorNoise,
        wands: Sequence[Wand],
        velocities_mm_s: NDArray[np.float64] | None,
        *,
        bias: bool,
        scale: bool,
    ) -> None:
        self._seen = ~np.isnan(observed_mm[..., 0])
        self._shared = self._seen.sum(axis=0) > 1
        self._observed_mm = np.where(self._seen[..., None], observed_mm, 0.0)
        self._rays = _ranges_and_rays(self._observed_mm)[1]
        self._noise = noise
        self._information = np.linalg.inv(noise.covariances(self._rays))
        self._wands = wands
        self._bias, self._scale = bias, scale
        self._clocks = velocities_mm_s is not None
        self._velocities_mm_s = np.zeros_like(observed_mm) if velocities_mm_s is None else velocities_mm_s
        self._velocities_mm_s = np.where(self._seen[..., None], self._velocities_mm_s, 0.0)
        self._units = len(observed_mm)
        self._first_bias = _POSE * (self._units - 1)
        self._first_scale = self._first_bias + self._units * bias
        self._first_clock = self._first_scale + self._units * scale
        self._parameters = self._first_clock + (self._units - 1) * self._clocks

    @property
    def degrees_of_freedom(self) -> int:
        """Measured numbers less unknown ones."""
        measured = 3 * int(self._seen[:, self._shared].sum()) + sum(len(w.first_mm) for w in self._wands)
        return measured - 3 * int(self._shared.sum()) - self._parameters

    def linearised(
        self, motions: Sequence[RigidMotion], errors: RangeErrors, clock_steps_s: Vectors
    ) -> _System:
        """Return curvature and slope of half the misfit over poses, range errors and clock steps."""
        rotations = np.array([motion.rotation for motion in motions])
        then_mm = self._observed_mm + clock_steps_s[:, None, None] * self._velocities_mm_s
        true_mm = np.array([errors.corrected(each, unit) for unit, each in enumerate(then_mm)])
        places = np.array([motion.apply(points) for motion, points in zip(motions, true_mm, strict=True)])
        weight = np.einsum("kia,knab,kjb->knij", rotations, self._information, rotations)
        weight = weight * self._seen[..., None, None]
        spread = np.linalg.inv(weight.sum(axis=0) + 1e-12 * np.eye(3))
        best = np.einsum("nij,knjl,knl->ni", spread, weight, places)
        centre_mm = best[self._shared].mean(axis=0)
        gaps = np.where(self._shared[None, :, None], best[None] - places, 0.0)
        jacobian = self._jacobian(rotations, places - centre_mm, true_mm, errors)
        pulled = np.einsum("knij,knjp->knip", weight, jacobian) * self._shared[None, :, None, None]
        summed = pulled.sum(
            axis=0
        )  # what one unit's parameters do to another's misfit through the common point
        curvature = np.einsum("knip,kniq->pq", jacobian, pulled)
        curvature -= np.einsum("nip,nij,njq->pq", summed, spread, summed)
        slope = np.einsum("knip,kni->p", pulled, gaps)
        misfit = float(np.einsum("kni,knij,knj->", gaps, weight, gaps))
        for unit, wand in enumerate(self._wands):
            derivatives, misses, variances = self._wand_terms(wand, unit, errors)
            curvature += np.einsum("np,nq,n->pq", derivatives, derivatives, 1 / variances)
            slope += np.einsum("np,n->p", derivatives, misses / variances)
            misfit += float((misses**2 / variances).sum())
        return _System(curvature, slope, misfit, centre_mm)

    def moved(
        self, motions: Sequence[RigidMotion], errors: RangeErrors, step: Vectors, centre_mm: Vectors
    ) -> tuple[list[RigidMotion], RangeErrors]:
        """Return poses and range errors after a step."""
        from scipy.spatial.transform import Rotation

        new = [motions[0]]
        for unit, motion in enumerate(motions[1:]):
            shift, turn = np.split(step[_POSE * unit : _POSE * (unit + 1)], 2)
            about = Rotation.from_rotvec(turn).as_matrix()
            translation = about @ (motion.translation_mm - centre_mm) + centre_mm + shift
            new.append(RigidMotion(about @ motion.rotation, translation))
        biases_mm, scales = errors.biases_mm, errors.scales
        if self._bias:
            biases_mm = biases_mm + step[self._first_bias : self._first_bias + self._units]
        if self._scale:
            scales = scales + step[self._first_scale : self._first_clock]
        return new, RangeErrors(biases_mm, scales)

    def range_sds(self, sds: Vectors) -> tuple[Vectors, Vectors]:
        """Return the standard deviations of biases and scales among those of all parameters."""
        none = np.zeros(self._units)
        biases = sds[self._first_bias : self._first_scale]
        scales = sds[self._first_scale : self._first_clock]
        return biases if self._bias else none, scales if self._scale else none

    def later(self, clock_steps_s: Vectors, step: Vectors) -> Vectors:
        """Return clock steps after a step; the first unit's clock is the reference."""
        if not self._clocks:
            return clock_steps_s
        later_s: Vectors = clock_steps_s + np.append(0.0, step[self._first_clock :])
        return later_s

    def _jacobian(
        self, rotations: Vectors, arms: Vectors, true_mm: Vectors, errors: RangeErrors
    ) -> NDArray[np.float64]:
        """Return how each observation's place moves with the parameters, shape (units, n, 3, parameters)."""
        jacobian = np.zeros((*arms.shape, self._parameters))
        for unit in range(self._units):
            first = _POSE * (unit - 1)
            if unit > 0:
                jacobian[unit, :, :, first : first + 3] = np.eye(3)
                jacobian[unit, :, :, first + 3 : first + _POSE] = -_cross_matrices(arms[unit])
            derivatives = self._range_derivatives(true_mm[unit], unit, errors)
            if self._clocks and unit > 0:
                derivatives[..., self._first_clock + unit - 1] = self._velocities_mm_s[unit]
            jacobian[unit] += np.einsum("ij,njp->nip", rotations[unit], derivatives)
        return jacobian

    def _range_derivatives(self, true_mm: Vectors, unit: int, errors: RangeErrors) -> NDArray[np.float64]:
        """Return how corrected points move in the sensor's frame, shape (n, 3, parameters)."""
        derivatives = np.zeros((*true_mm.shape, self._parameters))
        if self._bias:
            rays = _ranges_and_rays(true_mm)[1]
            derivatives[..., self._first_bias + unit] = -rays / (1 + errors.scales[unit])
        if self._scale:
            derivatives[..., self._first_scale + unit] = -true_mm / (1 + errors.scales[unit])
        return derivatives

    def _wand_terms(
        self, wand: Wand, unit: int, errors: RangeErrors
    ) -> tuple[NDArray[np.float64], Vectors, Vectors]:
        """Return the lengths' derivatives, what they miss in mm, and their variances in mm^2."""
        ends = [errors.corrected(end, unit) for end in (wand.first_mm, wand.second_mm)]
        lengths, directions = _ranges_and_rays(ends[0] - ends[1])
        spread = sum(self._noise.covariances(_ranges_and_rays(end)[1]) for end in ends)
        variances = np.einsum("ni,nij,nj->n", directions, spread, directions)
        # noise across the wand makes it look longer
        longer_mm = (np.einsum("nii->n", spread) - variances) / (2 * wand.length_mm)
        change = self._range_derivatives(ends[0], unit, errors)
        change = change - self._range_derivatives(ends[1], unit, errors)
        derivatives = np.einsum("ni,nip->np", directions, change)
        return derivatives, wand.length_mm + longer_mm - lengths[:, 0], variances


def _ranges_and_rays(points_mm: Vectors) -> tuple[Vectors, Vectors]:
    """Return lengths, shape (..., 1), and unit vectors, shape (..., 3)."""
    ranges = np.linalg.norm(points_mm, axis=-1, keepdims=True)
    return ranges, points_mm / np.maximum(ranges, _NEVER_ZERO_MM)


def _cross_matrices(vectors: Vectors) -> NDArray[np.float64]:
    """Return the matrices of ``v x``, shape (n, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
