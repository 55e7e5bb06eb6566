"""Poses and the speed of sound from phases: coarse to fine, as phases are known only up to whole periods.

First the differences between transducers near to each other are fitted, which hardly wrap however wrong the
pose is; then those of transducers farther and farther apart; at last the phases themselves, together with
small errors of the microphone's positions and of the transducers' own lags. All of it is least squares with
Gauss-Newton steps.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.transducer import ULTRASOUND_HZ
from autd_trials.array.geometry import UnitPose
from autd_trials.calibration.acoustic.heard import Heard
from autd_trials.calibration.acoustic.model import HeardUnit, modelled
from autd_trials.errors import UsageError

BASELINES_MM = (15.0, 95.0, 200.0, 400.0, 700.0)
SPEED_SD_M_S = 1.5
"""How well the speed of sound is known beforehand: 2.5 degrees Celsius."""

SOURCE_PHASE_SD_RAD = 0.2
"""By how much transducers lag differently behind one drive; assumed, as nobody measured it here."""

_POSE = 6
_ITERATIONS = 15
_CONVERGED = 1e-7
_MOST_PAIRS = 300
_OUTLIER_SD = 6.0
_LEAST_NOISE_RAD = 1e-3
_LEAST_POSITION_SD_MM = 1e-3
_LARGEST_RESIDUAL_RAD = 0.8

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Refined:
    """Units where they were heard to be.

    Attributes
    ----------
    units
        All units' poses in the first one's frame; those that were not heard as they were.
    covariances
        For each unit, of its origin in mm and the rotation vector about it in rad, (6, 6); None for the first
        one and for those that were not heard.
    speed_of_sound_m_s
        As fitted.
    residual_rad
        Scatter of what is left of the phases (from its median absolute deviation).
    """

    units: tuple[UnitPose, ...]
    covariances: tuple[Array | None, ...]
    speed_of_sound_m_s: float
    residual_rad: float


def refine(
    units: Sequence[UnitPose],
    heard: Sequence[Heard],
    *,
    speed_of_sound_m_s: float,
    microphone_sd_mm: float,
    generator: np.random.Generator,
) -> Refined:
    """Return the units' poses as a microphone heard them.

    Parameters
    ----------
    units
        All units' poses in the calibrated frame, right within 40 mm and 3 degrees.
    heard
        What was heard of them. If the first unit is among them, the microphone's points need only be right
        relative to each other; else they must be right in the first unit's frame.
    speed_of_sound_m_s
        By the air's temperature; it is fitted too.
    microphone_sd_mm
        How well each coordinate of the microphone's points is known.
    generator
        Chooses pairs of transducers.

    Raises
    ------
    UsageError
        A unit was heard that is not there, or the phases do not fit any pose.
    """
    for each in heard:
        if each.unit > len(units):
            raise UsageError(f"unit {each.unit} was heard; the calibration has {len(units)} units")
    fit = _Fit(units, heard, speed_of_sound_m_s, microphone_sd_mm)
    for baseline_mm in BASELINES_MM:
        fit.follow_differences(baseline_mm, generator)
    residual_rad = fit.follow_phases()
    if residual_rad > _LARGEST_RESIDUAL_RAD:
        raise UsageError(
            f"the phases fit no pose: {residual_rad:.1f} rad are left",
            do="check the transducers' order, the phases' sign (a lag is positive) and the points, and start "
            "within 40 mm and 3 degrees",
        )
    return fit.result(residual_rad)


class _Fit:
    """What is known so far: poses, speed of sound, the microphone's displacements, the sources' own lags."""

    def __init__(
        self,
        units: Sequence[UnitPose],
        heard: Sequence[Heard],
        speed_of_sound_m_s: float,
        microphone_sd_mm: float,
    ) -> None:
        self._known = units
        self._units = list(units)
        self._heard = heard
        self._expected_m_s = self._speed_m_s = speed_of_sound_m_s
        self._microphone_sd_mm = microphone_sd_mm
        every = np.concatenate([each.points_mm for each in heard])
        self._points_mm, which = np.unique(every, axis=0, return_inverse=True)
        counts = np.cumsum([len(each.points_mm) for each in heard])[:-1]
        self._which_point = np.split(which.ravel(), counts)
        self._pivot_mm = self._points_mm.mean(axis=0)
        self._displacements_mm = np.zeros_like(self._points_mm)
        self._source_lags_rad = [np.zeros(len(each.sources)) for each in heard]
        self._speed = _POSE * len(heard)
        self._covariance = np.zeros((self._speed, self._speed))

    def follow_differences(self, baseline_mm: float, generator: np.random.Generator) -> None:
        """Fit the phase differences of sources at most so far apart."""
        models = [self._model(number) for number in range(len(self._heard))]
        pairs = [_pairs(model, baseline_mm, generator) for model in models]
        for _ in range(_ITERATIONS):
            rows, misses = [], []
            for number, (each, (first, second)) in enumerate(zip(self._heard, pairs, strict=True)):
                model = self._model(number)
                errors = _wrapped(each.lags_rad - model.lags_rad)
                misses.append(_wrapped(errors[first] - errors[second]).ravel())
                columns = self._columns(number, model)
                rows.append((columns[first] - columns[second]).reshape(-1, self._speed + 1))
            if self._step(np.concatenate(rows), np.concatenate(misses)):
                break

    def follow_phases(self) -> float:
        """Fit the phases themselves, with constants and displacements; return what is left."""
        residual_rad = 0.0
        for _ in range(_ITERATIONS):
            rows, misses = self._phase_rows()
            settled = self._step(rows, misses)
            residual_rad = _robust_sd(misses)
            if settled:
                break
        return residual_rad

    def result(self, residual_rad: float) -> Refined:
        """Return poses and covariances in the first unit's frame."""
        numbers = {each.unit for each in self._heard}
        units = [self._known[0]]
        covariances: list[Array | None] = [None]
        first = self._units[0]
        for number, unit in list(enumerate(self._units, start=1))[1:]:
            if number not in numbers:
                units.append(self._known[number - 1])
                covariances.append(None)
                continue
            inverse = first.rotation.T
            translation_mm = inverse @ (unit.translation_mm - first.translation_mm)
            units.append(UnitPose(unit.name, inverse @ unit.rotation, translation_mm))
            covariances.append(self._covariance_of(number))
        return Refined(tuple(units), tuple(covariances), self._speed_m_s, residual_rad)

    def _covariance_of(self, unit: int) -> Array:
        """Return a unit's covariance relative to the first one, at its origin, in the first's frame."""
        places = {each.unit: _POSE * number for number, each in enumerate(self._heard)}
        chooser = np.zeros((_POSE, self._speed))
        chooser[:, places[unit] : places[unit] + _POSE] = np.eye(_POSE)
        if 1 in places:
            chooser[:, places[1] : places[1] + _POSE] = -np.eye(_POSE)
        turned = np.kron(np.eye(2), self._units[0].rotation.T)
        x, y, z = self._units[0].rotation.T @ (self._units[unit - 1].translation_mm - self._pivot_mm)
        shift = np.eye(_POSE)
        shift[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        lever = shift @ turned @ chooser
        covariance: Array = lever @ self._covariance @ lever.T
        return covariance

    def _model(self, number: int) -> HeardUnit:
        each = self._heard[number]
        points_mm = each.points_mm + self._displacements_mm[self._which_point[number]]
        return modelled(
            self._units[each.unit - 1], each.sources, points_mm, self._wave_number, self._pivot_mm
        )

    @property
    def _wave_number(self) -> float:
        return 2 * np.pi * ULTRASOUND_HZ / (1000 * self._speed_m_s)

    def _columns(self, number: int, model: HeardUnit) -> Array:
        """Return how lags move with poses and the speed of sound, (sources, points, parameters)."""
        columns = np.zeros((*model.lags_rad.shape, self._speed + 1))
        columns[..., _POSE * number : _POSE * (number + 1)] = model.by_pose
        columns[..., self._speed] = -model.path_rad / self._speed_m_s
        return columns

    def _phase_rows(self) -> tuple[Array, Array]:
        """Return derivatives and misses of all phases; constants are columns of their own, at the end."""
        constants = [1 if each.synchronised else len(each.points_mm) for each in self._heard]
        sources_before = np.cumsum([0, *(len(each.sources) for each in self._heard)])
        first_source = self._speed + 1 + 3 * len(self._points_mm)
        first_constant = first_source + int(sources_before[-1])
        rows, misses = [], []
        for number, each in enumerate(self._heard):
            model = self._model(number)
            sources, points = model.lags_rad.shape
            own_lags_rad = self._source_lags_rad[number][:, None]
            errors = _wrapped(each.lags_rad - model.lags_rad - own_lags_rad)
            axis = None if each.synchronised else 0
            errors = _wrapped(errors - _circular_mean(errors, axis))
            block = np.zeros((sources, points, first_constant + sum(constants)))
            block[..., : self._speed + 1] = self._columns(number, model)
            at = np.arange(points)
            for axis_of_space in range(3):
                column = self._speed + 1 + 3 * self._which_point[number] + axis_of_space
                block[:, at, column] = model.by_point[..., axis_of_space]
            which = np.arange(sources)
            block[which, :, first_source + sources_before[number] + which] = 1.0
            own = first_constant + sum(constants[:number])
            block[:, at, own + (0 if each.synchronised else at)] = 1.0
            rows.append(block.reshape(sources * points, -1))
            misses.append(errors.ravel())
        return np.concatenate(rows), np.concatenate(misses)

    def _step(self, rows: Array, misses: Array) -> bool:
        """Do a Gauss-Newton step; return whether it was small."""
        noise_rad = max(_LEAST_NOISE_RAD, _robust_sd(misses))
        right = np.abs(misses) < _OUTLIER_SD * noise_rad  # NaN: not heard
        weights = 1 - (misses[right] / (_OUTLIER_SD * noise_rad)) ** 2  # square roots of Tukey's biweights
        rows, misses = rows[right] * weights[:, None], misses[right] * weights
        fine = rows.shape[1] > self._speed + 1
        prior, pulled = np.zeros(rows.shape[1]), np.zeros(rows.shape[1])
        prior[self._speed] = (noise_rad / SPEED_SD_M_S) ** 2
        pulled[self._speed] = self._speed_m_s - self._expected_m_s
        first_source = self._speed + 1 + 3 * len(self._points_mm)
        lags_rad = np.concatenate(self._source_lags_rad)
        moved, lagging = (
            slice(self._speed + 1, first_source),
            slice(first_source, first_source + len(lags_rad)),
        )
        if fine:
            prior[moved] = (noise_rad / max(self._microphone_sd_mm, _LEAST_POSITION_SD_MM)) ** 2
            pulled[moved] = self._displacements_mm.ravel()
            prior[lagging] = (noise_rad / SOURCE_PHASE_SD_RAD) ** 2
            pulled[lagging] = lags_rad
        curvature = rows.T @ rows + np.diag(prior) + 1e-12 * np.eye(rows.shape[1])
        step: Array = np.linalg.solve(curvature, rows.T @ misses - prior * pulled).astype(np.float64)
        self._move(step[: self._speed])
        self._speed_m_s += float(step[self._speed])
        if fine:
            self._displacements_mm = self._displacements_mm + step[moved].reshape(-1, 3)
            ends = np.cumsum([len(each.sources) for each in self._heard])[:-1]
            self._source_lags_rad = np.split(lags_rad + step[lagging], ends)
        inverse: Array = np.linalg.inv(curvature).astype(np.float64)
        self._covariance = inverse[: self._speed, : self._speed] * noise_rad**2
        return bool(np.abs(step[: self._speed]).max() < _CONVERGED)

    def _move(self, step: Array) -> None:
        from scipy.spatial.transform import Rotation

        for number, each in enumerate(self._heard):
            shift_mm, turn = np.split(step[_POSE * number : _POSE * (number + 1)], 2)
            about = Rotation.from_rotvec(turn).as_matrix()
            unit = self._units[each.unit - 1]
            translation_mm = about @ (unit.translation_mm - self._pivot_mm) + self._pivot_mm + shift_mm
            self._units[each.unit - 1] = UnitPose(unit.name, about @ unit.rotation, translation_mm)


def _pairs(
    model: HeardUnit, baseline_mm: float, generator: np.random.Generator
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs of sources at most so far apart; the nearest ones if there are none."""
    sources = len(model.centres_mm)
    first, second = np.triu_indices(sources, 1)
    apart_mm = np.linalg.norm(model.centres_mm[first] - model.centres_mm[second], axis=1)
    nearest_mm = float(np.sort(apart_mm)[sources // 2])
    chosen = np.flatnonzero(apart_mm <= max(baseline_mm, nearest_mm))
    if len(chosen) > _MOST_PAIRS:
        chosen = generator.choice(chosen, _MOST_PAIRS, replace=False)
    return first[chosen], second[chosen]


def _wrapped(phases_rad: Array) -> Array:
    wrapped: Array = (phases_rad + np.pi) % (2 * np.pi) - np.pi
    return wrapped


def _circular_mean(phases_rad: Array, axis: int | None) -> Array:
    mean: Array = np.angle(np.nansum(np.exp(1j * phases_rad), axis=axis, keepdims=True))
    return mean


def _robust_sd(misses: Array) -> float:
    return 1.4826 * float(np.nanmedian(np.abs(misses)))
