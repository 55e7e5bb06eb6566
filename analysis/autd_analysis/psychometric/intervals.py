"""Profile-likelihood intervals of thresholds and slopes.

A value lies in the interval if the best function that has it loses less than 1.92 of log likelihood, which is
half the 95 % point of chi-squared with one degree of freedom. D. J. Venzon and S. H. Moolgavkar (1988), Appl.
Stat. 37, 87-94. The profile is looked at on a grid, so that the outermost crossings are found whatever its
form; the values nearest to them are then refined.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_analysis.psychometric.fit import FARTHEST, Fit, condition_log_likelihood
from autd_analysis.psychometric.functions import Array, slope_per_steepness
from autd_analysis.psychometric.profile import QUANTITIES, Job, Profile, Quantity, log_steepnesses
from autd_analysis.psychometric.starts import best_step

PROFILE_INTERVAL = "95 % profile-likelihood interval"

_INSIDE = np.linspace(-1.0, 1.0, 13)
_OUTSIDE = np.geomspace(0.1, FARTHEST - 1, 8)
"""Distances from the levels, in half ranges; where the profile is still near its top at the farthest one, an
interval of thresholds is open."""
_REFINEMENTS = 25
_NEAR = 1e-5
_CLOSE = 2e-6
_STEP_LOSES = 4.0  # of log likelihood, at the fitted rates; 1.92 matters at the best ones
_MOST_JUMPS = 12  # levels; with more the grid is fine enough


@dataclass(frozen=True)
class OpenInterval:
    """An interval either end of which may be open: None means that the end is undetermined."""

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
    jobs: list[Job] = [(number, quantity) for number in able for quantity in QUANTITIES]
    ends = _ends(Profile(fitted, {job: _grid(fitted, *job) for job in jobs}), jobs) if jobs else {}
    return tuple(
        CurveIntervals(_thresholds(fitted, ends[number, "threshold"]), _slopes(fitted, ends[number, "slope"]))
        if number in able
        else CurveIntervals(None, None)
        for number in range(len(fitted.curves))
    )


def _grid(fitted: Fit, number: int, quantity: Quantity) -> Array:
    """Return the points at which the profile is looked at, the estimate among them if there is one."""
    if quantity == "slope":
        grid = log_steepnesses(fitted, number)
        steepness = float(fitted.parameters[2 * number + 1])
        inside = [math.log(steepness)] if steepness > 0 else []
        return np.unique(np.clip(np.append(grid, inside), grid[0], grid[-1]))
    whole, curve, levels = fitted.problem, fitted.curves[number], fitted.problem.levels(number)
    middle, reach = (levels[-1] + levels[0]) / 2, (levels[-1] - levels[0]) / 2
    low, high = levels[0] - reach * _OUTSIDE, levels[-1] + reach * _OUTSIDE
    # where a step is nearly as likely the profile jumps at a level
    jumps = [levels - _CLOSE / 2, levels + _CLOSE / 2] if _may_be_step(fitted, number) else []
    estimate = (
        []
        if curve.threshold is None
        else [(float(whole.axis.place(np.array(curve.threshold))) - whole.middle) / whole.reach]
    )
    grid = np.concatenate([low, middle + reach * _INSIDE, levels, *jumps, estimate, high])
    return np.unique(np.clip(grid, low[-1], high[-1]))


def _may_be_step(fitted: Fit, number: int) -> bool:
    """Return whether a step would lose so little that it matters for an interval."""
    whole, parameters = fitted.problem, fitted.parameters[None]
    felt, guess_lapse = whole.felt[None], whole.rates(number, parameters)
    own = condition_log_likelihood(whole, number, felt, parameters)
    step, _, _ = best_step(whole.of_levels(number, felt), whole.conditions[number].n, *guess_lapse)
    few = len(whole.conditions[number].x) <= _MOST_JUMPS
    return few and bool(own[0] - step[0] < _STEP_LOSES)


def _ends(profile: Profile, jobs: Sequence[Job]) -> dict[Job, OpenInterval]:
    """Refine the outermost crossings of all profiles together."""
    ends: dict[Job, list[float | None]] = {job: [None, None] for job in jobs}
    sides: list[tuple[Job, int]] = []
    brackets: list[tuple[float, float, float, float]] = []
    for job in jobs:
        grid, distance = profile.grids[job], profile.on_grid(job)
        inside = np.flatnonzero(distance <= max(0.0, float(distance.min())))
        for side, near, far in ((0, inside[0], inside[0] - 1), (1, inside[-1], inside[-1] + 1)):
            if 0 <= far < len(grid):
                sides.append((job, side))
                brackets.append((grid[near], grid[far], distance[near], distance[far]))
    if sides:
        found = _refine(profile, [job for job, _ in sides], np.array(brackets))
        for (job, side), end in zip(sides, found, strict=True):
            ends[job][side] = float(end)
    return {job: OpenInterval(low, high) for job, (low, high) in ends.items()}


def _refine(profile: Profile, jobs: Sequence[Job], brackets: Array) -> Array:
    """Return where signed distances are zero, by false position (Illinois).

    Columns of the brackets: a point inside, a point outside, and the distances there.
    """
    found = brackets[:, 0].copy()
    left, last = np.arange(len(jobs)), np.zeros(len(jobs))
    for _ in range(_REFINEMENTS):
        going = np.abs(brackets[:, 1] - brackets[:, 0]) > _CLOSE  # closer at a jump, which has no zero
        left, last, brackets = left[going], last[going], brackets[going]
        if len(left) == 0:
            break
        inside, outside, value_in, value_out = brackets.T
        at = outside - value_out * (outside - inside) / (value_out - value_in)
        value = profile.between([jobs[int(index)] for index in left], at)
        found[left] = at
        side = np.where(np.abs(value) < _NEAR, 0.0, np.sign(value))
        # an end that is kept a second time counts half, so that it is not kept for ever
        brackets = np.column_stack(
            [
                np.where(side <= 0, at, inside),
                np.where(side >= 0, at, outside),
                np.where(side <= 0, value, np.where(last > 0, value_in / 2, value_in)),
                np.where(side >= 0, value, np.where(last < 0, value_out / 2, value_out)),
            ]
        )
        last = side
    return found


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
