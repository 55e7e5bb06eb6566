"""Profile-likelihood intervals of thresholds and slopes.

A value lies in the interval if the best function that has it loses less than 1.92 of log likelihood, which is
half the 95 % point of chi-squared with one degree of freedom. D. J. Venzon and S. H. Moolgavkar (1988), Appl.
Stat. 37, 87-94. The profile is looked at on a grid, so that the outermost crossings are found whatever its
form; the values nearest to them are then refined.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.psychometric.fit import Fit
from analysis.psychometric.functions import Array, predictor_at_threshold, slope_per_steepness
from analysis.psychometric.likelihood import QUICK
from analysis.psychometric.starts import grid_log_likelihood, threshold_grid, width

PROFILE_INTERVAL = "95 % profile-likelihood interval"

_Z = 1.959963984540054
_INSIDE = np.linspace(-1.0, 1.0, 25)
_OUTSIDE = np.geomspace(0.1, 20.0, 12)
"""Distances from the levels, in half ranges; where the profile is still near its top at the farthest one, an
interval of thresholds is open."""
_STEEPNESSES = 28
_GENTLEST = 1e-3
_STEEPEST_WIDTH = 0.1  # of the smallest distance between levels: as good as a step
_SMALLEST_DISTANCE = 0.01  # in half ranges
_REFINEMENTS = 25
_NEAR = 1e-5
_CLOSE = 1e-9

Quantity = Literal["threshold", "slope"]


@dataclass(frozen=True)
class OpenInterval:
    """An interval either end of which may be open: None means that no end can be told from the answers."""

    low: float | None
    high: float | None


@dataclass(frozen=True)
class CurveIntervals:
    """Intervals of a curve; None where there is no function at all.

    Attributes
    ----------
    threshold
        An end is open where thresholds 10 times the range of the levels away are not excluded.
    slope
        The lower end is 0 where a flat function is not excluded, the upper end open where a step is not.
    """

    threshold: OpenInterval | None
    slope: OpenInterval | None


def profile_intervals(fitted: Fit) -> tuple[CurveIntervals, ...]:
    """Return the profile-likelihood intervals of all curves of a fit.

    Parameters
    ----------
    fitted
        The fit.

    Returns
    -------
    tuple of CurveIntervals
        In the order of the curves.
    """
    able = [number for number, each in enumerate(fitted.problem.conditions) if len(each.x) > 1]
    if not able:
        return tuple(CurveIntervals(None, None) for _ in fitted.curves)
    profile = _Profile(fitted)
    points = [_grid(fitted, number, quantity) for number in able for quantity in _QUANTITIES]
    whose = [(number, quantity) for number in able for quantity in _QUANTITIES]
    jobs = [pair for pair, grid in zip(whose, points, strict=True) for _ in grid]
    values = profile.losses(jobs, np.concatenate(points))
    ends = _ends(profile, whose, points, np.split(values, np.cumsum([len(grid) for grid in points])[:-1]))
    found = {number: CurveIntervals(None, None) for number in range(len(fitted.curves))}
    for index, number in enumerate(able):
        found[number] = CurveIntervals(
            _thresholds(fitted, ends[2 * index]), _slopes(fitted, ends[2 * index + 1])
        )
    return tuple(found[number] for number in range(len(fitted.curves)))


_QUANTITIES: tuple[Quantity, Quantity] = ("threshold", "slope")


class _Profile:
    """The profile of any condition's threshold (scaled place) or slope (log of the scaled steepness)."""

    def __init__(self, fitted: Fit) -> None:
        self.fitted, self.problem = fitted, fitted.problem
        self.design = self.problem.design()
        self.top = fitted.log_likelihood

    def losses(self, jobs: list[tuple[int, Quantity]], points: Array) -> Array:
        """Return signed distances from the intervals' ends, under 0 inside, of one point for each job.

        They are roots of deviances, which are nearly straight lines, so that ends are found in few steps.
        """
        whole = self.problem
        built = [self._restricted(*job, float(point)) for job, point in zip(jobs, points, strict=True)]
        design, offset, start, low, high = (np.array(each) for each in zip(*built, strict=True))
        felt = np.broadcast_to(whole.felt, offset.shape)
        _, values = whole.likelihood.climb(felt, design, offset, start, (low, high), QUICK)
        found: Array = np.sqrt(2 * np.maximum(0.0, self.top - values)) - _Z
        return found

    def _restricted(
        self, number: int, quantity: Quantity, point: float
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Return design, offset, start and bounds of the functions that have the value."""
        whole, own = self.problem, 2 * number
        gone = own if quantity == "threshold" else own + 1
        design = np.delete(self.design, gone, axis=1)
        start, low, high = (np.delete(each, gone) for each in (self.fitted.parameters, *whole.bounds()))
        if quantity == "threshold":
            # the steepness stays: predictor = predictor at the threshold + steepness (place - threshold)
            offset = predictor_at_threshold(whole.model.core) * self.design[:, own]
            design[:, own] = self.design[:, own + 1] - point * self.design[:, own]
        else:
            offset = math.exp(point) * self.design[:, own + 1]
        start[own] = self._coarse(number, quantity, point)
        return design, offset, start, low, high

    def _coarse(self, number: int, quantity: Quantity, point: float) -> float:
        """Return the best remaining parameter of a grid."""
        whole = self.problem
        mine = (whole.condition == number) & (whole.likelihood.stimulus > 0)
        thresholds, logs = threshold_grid(whole.levels(number)), _log_steepnesses(self.fitted, number)
        thresholds, steepness = (
            (np.full(len(logs), point), np.exp(logs))
            if quantity == "threshold"
            else (thresholds, np.full(len(thresholds), math.exp(point)))
        )
        guess, lapse = (float(rate[0]) for rate in whole.rates(number, self.fitted.parameters[None]))
        values = grid_log_likelihood(
            whole, number, whole.felt[None, mine], (guess, lapse), thresholds, steepness
        )
        best = int(values[0].argmax())
        if quantity == "threshold":
            return float(steepness[best])
        return predictor_at_threshold(whole.model.core) - math.exp(point) * float(thresholds[best])


def _log_steepnesses(fitted: Fit, number: int) -> Array:
    smallest = max(float(np.diff(fitted.problem.levels(number)).min()), _SMALLEST_DISTANCE)
    steepest = width(fitted.problem.model.core) / (_STEEPEST_WIDTH * smallest)
    return np.linspace(math.log(_GENTLEST), math.log(steepest), _STEEPNESSES)


def _grid(fitted: Fit, number: int, quantity: Quantity) -> Array:
    """Return the points at which the profile is looked at, the estimate among them if there is one."""
    whole, curve = fitted.problem, fitted.curves[number]
    levels = whole.levels(number)
    if quantity == "threshold":
        middle, reach = (levels[-1] + levels[0]) / 2, (levels[-1] - levels[0]) / 2
        inside = middle + reach * _INSIDE
        grid = np.concatenate([levels[0] - reach * _OUTSIDE, inside, levels[-1] + reach * _OUTSIDE, levels])
        if curve.threshold is not None and 0 < curve.threshold < math.inf:
            estimate = (float(whole.axis.place(np.array(curve.threshold))) - whole.middle) / whole.reach
            grid = np.append(grid, estimate)
        return np.unique(np.clip(grid, grid[: len(_OUTSIDE)].min(), (levels[-1] + reach * _OUTSIDE).max()))
    grid = _log_steepnesses(fitted, number)
    steepness = fitted.parameters[2 * number + 1]
    if steepness > 0:
        grid = np.append(grid, np.clip(math.log(steepness), grid[0], grid[-1]))
    return np.unique(grid)


def _ends(
    profile: _Profile,
    whose: list[tuple[int, Quantity]],
    points: list[Array],
    values: list[Array],
) -> list[OpenInterval]:
    """Refine the outermost crossings of all profiles together."""
    jobs: list[tuple[int, Quantity]] = []
    brackets: list[tuple[float, float, float, float]] = []
    places: list[tuple[int, int]] = []
    for index, (job, grid, value) in enumerate(zip(whose, points, values, strict=True)):
        inside = np.flatnonzero(value < 0)
        first, last = int(inside[0]), int(inside[-1])
        for side, (near, far) in enumerate(((first, first - 1), (last, last + 1))):
            if 0 <= far < len(grid):
                jobs.append(job)
                places.append((index, side))
                brackets.append((grid[near], grid[far], value[near], value[far]))
    ends: list[list[float | None]] = [[None, None] for _ in whose]
    if jobs:
        for (index, side), found in zip(places, _refine(profile, jobs, np.array(brackets)), strict=True):
            ends[index][side] = float(found)
    return [OpenInterval(low, high) for low, high in ends]


def _refine(profile: _Profile, jobs: list[tuple[int, Quantity]], brackets: Array) -> Array:
    """Return where signed distances are zero, by false position with halving (Illinois)."""
    inside, outside, value_in, value_out = brackets.T.copy()
    at = inside
    for _ in range(_REFINEMENTS):
        at = outside - value_out * (outside - inside) / (value_out - value_in)
        value = profile.losses(jobs, at)
        if float(np.abs(value).max()) < _NEAR:
            break
        within: NDArray[np.bool_] = value < 0
        # the end that is kept counts half, so that it is not kept for ever
        value_in, value_out = (
            np.where(within, value, value_in / 2),
            np.where(within, value_out / 2, value),
        )
        inside, outside = np.where(within, at, inside), np.where(within, outside, at)
        if float(np.abs(outside - inside).max()) < _CLOSE:  # a jump: at a level, where answers are separated
            break
    return at


def _thresholds(fitted: Fit, ends: OpenInterval) -> OpenInterval:
    whole = fitted.problem
    low, high = (
        None if end is None else whole.axis.stimulus(whole.middle + whole.reach * end)
        for end in (ends.low, ends.high)
    )
    return OpenInterval(low, high)


def _slopes(fitted: Fit, ends: OpenInterval) -> OpenInterval:
    scale = slope_per_steepness(fitted.problem.model.core) / fitted.problem.reach
    low, high = (None if end is None else scale * math.exp(end) for end in (ends.low, ends.high))
    return OpenInterval(0.0 if low is None else low, high)
