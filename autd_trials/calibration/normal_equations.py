"""The normal equations of the joint estimate: observations of the same unknown points by several sensors.

Parameters stand in one vector: six of the pose of every unit but the first, then a range bias of every unit,
a range scale of every unit, and a clock step of every unit but the first. The points are eliminated.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.long_run import long_run_covariance
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensor_model import Sensor
from autd_trials.errors import UsageError

POSE = 6
TUKEY_CHI2 = 36.0
"""Where a point's weight reaches 0: its squared distance in standard deviations, 3 degrees of freedom."""

_MOST_ITERATIONS = 200
_CONVERGED = 1e-4  # length of a step in standard deviations
_NEVER_ZERO_MM = 1e-9
_LEAST_NOISE = 1e-4  # in assumed standard deviations


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
class State:
    """Where the search stands: what is estimated, and the points, shape (n, 3), in the first one's frame."""

    motions: list[RigidMotion]
    biases_mm: Vectors
    scales: Vectors
    clock_steps_s: Vectors
    points_mm: Vectors
    noise_scale: float

    @cached_property
    def centre_mm(self) -> Vectors:
        """The cloud's centre."""
        centre: Vectors = self.points_mm.mean(axis=0)
        return centre


@dataclass(frozen=True, eq=False)
class _Terms:
    """What each point says, the point eliminated, in assumed standard deviations.

    Residuals (n, 3 units), their derivatives (n, 3 units, parameters), misfits (n,); and the points' own
    steps: ``roots`` (n, 3, 3) times the step is ``pulls`` (n, 3) less ``drags`` (n, 3, parameters) times the
    parameters' step.
    """

    residuals: NDArray[np.float64]
    derivatives: NDArray[np.float64]
    misfits: NDArray[np.float64]
    roots: NDArray[np.float64]
    pulls: NDArray[np.float64]
    drags: NDArray[np.float64]


class Problem:
    """The observations; parameters as for `autd_trials.calibration.joint.fit_jointly`.

    Attributes
    ----------
    biases, scales
        Which parameters are range biases and scales, shape (parameters,); none of right ranges.
    uncertain
        Which parameters are not known beforehand.
    prior_sds
        Of all parameters; infinite without a prior.
    """

    def __init__(
        self,
        observed_mm: NDArray[np.float64],
        sensors: Sequence[Sensor],
        velocities_mm_s: NDArray[np.float64] | None,
        wands: Sequence[Wand],
    ) -> None:
        seen = ~np.isnan(observed_mm[..., 0])
        self._shared = seen.sum(axis=0) > 1
        self._seen = seen[:, self._shared]
        self._observed_mm = np.where(self._seen[..., None], observed_mm[:, self._shared], 0.0)
        velocities = np.zeros_like(observed_mm) if velocities_mm_s is None else velocities_mm_s
        self._velocities_mm_s = np.where(self._seen[..., None], velocities[:, self._shared], 0.0)
        self._sensors, self._wands = sensors, wands
        units = self._units = len(sensors)
        self._excess = 3.0 * (self._seen.sum(axis=0) - 1)  # degrees of freedom of each point
        unknown = [np.inf] * units if wands else None
        self.prior_sds = np.concatenate(
            [
                np.full(POSE * (units - 1), np.inf),
                unknown or [sensor.bias_sd_mm for sensor in sensors],
                unknown or [sensor.scale_sd for sensor in sensors],
                np.full(units - 1, 0.0 if velocities_mm_s is None else np.inf),
            ]
        )
        first_bias = POSE * (units - 1)
        number = np.arange(len(self.prior_sds))
        self.uncertain = self.prior_sds > 0
        self.biases = (number >= first_bias) & (number < first_bias + units)
        self.scales = (number >= first_bias + units) & (number < first_bias + 2 * units)

    def start(self, motions: Sequence[RigidMotion]) -> State:
        """Return the state with poses to start from and right ranges."""
        places = np.array([m.apply(p) for m, p in zip(motions, self._observed_mm, strict=True)])
        share = self._seen / self._seen.sum(axis=0)
        none = np.zeros(self._units)
        points_mm = np.einsum("kn,knd->nd", share, places)
        state = State(list(motions), none, none, none, points_mm, 1.0)
        squares = self._terms(state).misfits / self._excess
        return replace(state, noise_scale=max(float(np.sqrt(np.median(squares))), _LEAST_NOISE))

    def settled(self, state: State, *, range_free: bool) -> State:
        """Return the most likely state; range errors keep their values unless they are free.

        Raises
        ------
        UsageError
            The search does not settle.
        """
        free = self.uncertain.copy()
        if not range_free:
            free &= ~(self.biases | self.scales)
        with suppress(np.linalg.LinAlgError):
            for _ in range(_MOST_ITERATIONS):
                terms = self._terms(state)
                curvature, slope = self._curvature_and_slope(terms, state)
                step = np.zeros(len(free))
                step[free] = np.linalg.solve(curvature[np.ix_(free, free)], slope[free])
                state = self._moved(state, step, terms)
                if step @ curvature @ step < _CONVERGED**2:
                    return state
        raise UsageError(
            "the poses do not settle: the points agree with many",
            do="wave the target where all sensors see it, over 500 mm in every direction",
        )

    def covariance(self, state: State) -> NDArray[np.float64]:
        """Return the robust covariance of all parameters at a settled state; zeros for what is known."""
        terms = self._terms(state)
        weights, changes = self._weights(terms, state)
        slopes = np.einsum("nrp,nr->np", terms.derivatives, terms.residuals) / state.noise_scale**2
        curvature = self._curvature_and_slope(terms, state)[0]
        bread = curvature + 2 * np.einsum("np,nq,n->pq", slopes, slopes, changes)
        scatter = self._beside_the_points(state)[0]
        rows = len(self._shared)
        residuals = np.zeros((rows, terms.residuals.shape[1]))
        derivatives = np.zeros((*residuals.shape, int(self.uncertain.sum())))
        residuals[self._shared] = weights[:, None] * terms.residuals / state.noise_scale**2
        derivatives[self._shared] = terms.derivatives[..., self.uncertain]
        kept = np.ix_(self.uncertain, self.uncertain)
        scatter[kept] += _of_few(*long_run_covariance(residuals, derivatives))
        inverse = np.linalg.inv(bread[kept])
        covariance: NDArray[np.float64] = np.zeros_like(bread)
        covariance[kept] = inverse @ scatter[kept] @ inverse
        return covariance

    def difference(self, state: State, other: State) -> Vectors:
        """Return by how much the parameters of one state differ from another's."""
        from scipy.spatial.transform import Rotation

        poses = []
        for motion, before in zip(state.motions[1:], other.motions[1:], strict=True):
            turned = motion.after(before.inverse())
            shift = turned.apply(state.centre_mm) - state.centre_mm
            poses += [shift, Rotation.from_matrix(turned.rotation).as_rotvec()]
        rest = self._vector(state) - self._vector(other)
        return np.concatenate([*poses, rest[POSE * (self._units - 1) :]])

    def log_volume(self, state: State) -> float:
        """Return the logarithm of the volume within which points scatter, per degree of freedom.

        The smaller it is, the better the assumed shape of the noise fits.
        """
        terms = self._terms(state)
        roots = np.log(np.abs(np.diagonal(terms.roots, axis1=1, axis2=2))).sum()
        sizes = [np.log(s.noise.along_mm * s.noise.across_mm**2) for s in self._sensors]
        volumes = roots + np.dot(sizes, self._seen.sum(axis=1))
        return float(volumes / self._excess.sum() + np.log(state.noise_scale))

    def _curvature_and_slope(
        self, terms: _Terms, state: State
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        weights = self._weights(terms, state)[0] / state.noise_scale**2
        curvature, slope = self._beside_the_points(state)
        pulled = terms.derivatives * weights[:, None, None]
        flat = (-1, pulled.shape[2])
        curvature = curvature + pulled.reshape(flat).T @ terms.derivatives.reshape(flat)
        slope = slope + pulled.reshape(flat).T @ terms.residuals.ravel()
        return curvature, slope

    def _beside_the_points(self, state: State) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return curvature and slope of the priors and the wands."""
        values = self._vector(state)
        with np.errstate(divide="ignore"):
            information = np.where(self.uncertain, self.prior_sds, np.inf) ** -2.0
        curvature, slope = np.diag(information), -information * values
        for unit, wand in enumerate(self._wands):
            derivatives, misses, variances = self._wand_terms(wand, unit, state)
            variances = variances * state.noise_scale**2
            curvature += np.einsum("np,nq,n->pq", derivatives, derivatives, 1 / variances)
            slope += np.einsum("np,n->p", derivatives, misses / variances)
        return curvature, slope

    def _weights(self, terms: _Terms, state: State) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return Tukey's weight of each point, and how it changes with the squared distance."""
        share = 3 / self._excess
        left = (1 - terms.misfits / state.noise_scale**2 * share / TUKEY_CHI2).clip(0)
        return left**2, -2 * left * share / TUKEY_CHI2

    def _moved(self, state: State, step: Vectors, terms: _Terms) -> State:
        """Return the state after a step of the parameters, with its points and the size of the noise."""
        from scipy.spatial.transform import Rotation

        motions = [state.motions[0]]
        for unit, motion in enumerate(state.motions[1:]):
            shift, turn = np.split(step[POSE * unit : POSE * (unit + 1)], 2)
            about = Rotation.from_rotvec(turn).as_matrix()
            arm = about @ (motion.translation_mm - state.centre_mm)
            motions.append(RigidMotion(about @ motion.rotation, arm + state.centre_mm + shift))
        later = np.linalg.solve(terms.roots, (terms.pulls - terms.drags @ step)[..., None])[..., 0]
        clocks = step[len(step) - self._units + 1 :]
        weights = self._weights(terms, state)[0]
        square = (weights * terms.misfits).sum() / ((weights * self._excess).sum() * _tukey_mean() / 3)
        return State(
            motions,
            state.biases_mm + step[self.biases],
            state.scales + step[self.scales],
            state.clock_steps_s + np.append(0.0, clocks),
            state.points_mm + later,
            max(float(np.sqrt(square)), _LEAST_NOISE),
        )

    def _vector(self, state: State) -> Vectors:
        poses = np.zeros(POSE * (self._units - 1))
        return np.concatenate([poses, state.biases_mm, state.scales, state.clock_steps_s[1:]])

    def _terms(self, state: State) -> _Terms:
        count, parameters = len(state.points_mm), len(self.prior_sds)
        residuals = np.zeros((count, self._units, 3))
        by_point = np.zeros((count, self._units, 3, 3))
        derivatives = np.zeros((count, self._units, 3, parameters))
        arms = _cross_matrices(state.points_mm - state.centre_mm)
        for unit, motion in enumerate(state.motions):
            true_mm = motion.inverse().apply(state.points_mm)
            ranges, rays = _ranges_and_rays(true_mm)
            bias_mm, scale = state.biases_mm[unit], state.scales[unit]
            across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
            change = (1 + scale) * np.eye(3) + bias_mm / np.maximum(ranges, _NEVER_ZERO_MM)[
                ..., None
            ] * across
            whitening = self._sensors[unit].noise.whitenings(rays) * self._seen[unit, :, None, None]
            then_mm = self._observed_mm[unit] + state.clock_steps_s[unit] * self._velocities_mm_s[unit]
            predicted_mm = (1 + scale) * true_mm + bias_mm * rays
            residuals[:, unit] = np.einsum("nij,nj->ni", whitening, then_mm - predicted_mm)
            moves = whitening @ change @ motion.rotation.T
            by_point[:, unit] = moves
            if unit > 0:
                first = POSE * (unit - 1)
                derivatives[:, unit, :, first : first + 3] = -moves
                derivatives[:, unit, :, first + 3 : first + POSE] = moves @ arms
                clock = parameters - self._units + unit
                velocity = self._velocities_mm_s[unit]
                derivatives[:, unit, :, clock] = -np.einsum("nij,nj->ni", whitening, velocity)
            bias, scaled = (np.flatnonzero(which)[unit] for which in (self.biases, self.scales))
            derivatives[:, unit, :, bias] = np.einsum("nij,nj->ni", whitening, rays)
            derivatives[:, unit, :, scaled] = np.einsum("nij,nj->ni", whitening, true_mm)
        return _eliminated(
            residuals.reshape(count, -1),
            by_point.reshape(count, -1, 3),
            derivatives.reshape(count, -1, parameters),
        )

    def _wand_terms(
        self, wand: Wand, unit: int, state: State
    ) -> tuple[NDArray[np.float64], Vectors, Vectors]:
        """Return the lengths' derivatives, what they miss in mm, and their assumed variances in mm^2."""
        errors = RangeErrors(state.biases_mm, state.scales)
        ends = [errors.corrected(end, unit) for end in (wand.first_mm, wand.second_mm)]
        lengths, directions = _ranges_and_rays(ends[0] - ends[1])
        spread = sum(self._sensors[unit].noise.covariances(_ranges_and_rays(end)[1]) for end in ends)
        variances = np.einsum("ni,nij,nj->n", directions, spread, directions)
        # noise across the wand makes it look longer
        longer_mm = (np.einsum("nii->n", spread) - variances) * state.noise_scale**2 / (2 * wand.length_mm)
        derivatives = np.zeros((len(lengths), len(self.prior_sds)))
        rays = [_ranges_and_rays(end)[1] for end in ends]
        for which, change in ((self.biases, rays[0] - rays[1]), (self.scales, ends[0] - ends[1])):
            along = -np.einsum("ni,ni->n", directions, change) / (1 + state.scales[unit])
            derivatives[:, np.flatnonzero(which)[unit]] = along
        return derivatives, wand.length_mm + longer_mm - lengths[:, 0], variances


def _eliminated(
    residuals: NDArray[np.float64], by_point: NDArray[np.float64], derivatives: NDArray[np.float64]
) -> _Terms:
    """Take each point's own three coordinates out of its residuals, which are first order in all steps."""
    axes, roots = np.linalg.qr(by_point)
    pulls = np.einsum("nri,nr->ni", axes, residuals)
    drags = axes.transpose(0, 2, 1) @ derivatives
    left = residuals - np.einsum("nri,ni->nr", axes, pulls)
    moving = derivatives - axes @ drags
    return _Terms(left, moving, (left**2).sum(axis=1), roots, pulls, drags)


def _of_few(scatter: NDArray[np.float64], count: float) -> NDArray[np.float64]:
    """Enlarge a covariance that was estimated from so many terms.

    So that the 95 % ellipsoid of a place by the chi-square distribution is that of Hotelling's T^2.
    """
    from scipy.stats import chi2, f

    freedom = max(count - 3, 1.0)
    factor = 3 * (freedom + 2) / freedom * f.ppf(0.95, 3, freedom) / chi2.ppf(0.95, 3)
    return scatter * float(factor)


@cache
def _tukey_mean() -> float:
    """Return the mean of a weighted chi-square variable of 3 degrees of freedom over its mean weight."""
    from scipy.stats import chi2

    first, second, third, fourth = (
        factor * chi2.cdf(TUKEY_CHI2, 3 + 2 * power)
        for power, factor in enumerate((1.0, 3.0, 15.0, 105.0))  # moments of a chi-square variable
    )
    mean = second - 2 * third / TUKEY_CHI2 + fourth / TUKEY_CHI2**2
    return float(mean / (first - 2 * second / TUKEY_CHI2 + third / TUKEY_CHI2**2))


def _ranges_and_rays(points_mm: Vectors) -> tuple[Vectors, Vectors]:
    """Return lengths, shape (..., 1), and unit vectors, shape (..., 3)."""
    ranges = np.linalg.norm(points_mm, axis=-1, keepdims=True)
    return ranges, points_mm / np.maximum(ranges, _NEVER_ZERO_MM)


def _cross_matrices(vectors: Vectors) -> NDArray[np.float64]:
    """Return the matrices of ``v x``, shape (n, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
