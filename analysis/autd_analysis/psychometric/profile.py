"""The profile likelihood of thresholds and slopes: the best function that has a given one."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from autd_analysis.psychometric.fit import Fit
from autd_analysis.psychometric.functions import Array, predictor_at_threshold
from autd_analysis.psychometric.likelihood import QUICK
from autd_analysis.psychometric.starts import grid_log_likelihood, rates_to_try, threshold_grid, width

Quantity = Literal["threshold", "slope"]
Job = tuple[int, Quantity]
"""Number of a condition, and what is profiled."""

QUANTITIES: tuple[Quantity, Quantity] = ("threshold", "slope")

Z = 1.959963984540054
_STEEPNESSES = 28
_GENTLEST = 1e-3
_STEEPEST_WIDTH = 0.1  # of the smallest distance between levels: as good as a step
_SMALLEST_DISTANCE = 0.01  # in half ranges
_NEAREST = 1e-9


class Profile:
    """The profile of any condition's threshold (scaled place) or slope (log of the scaled steepness)."""

    def __init__(self, fitted: Fit) -> None:
        self.fitted, self.whole = fitted, fitted.problem
        self.design = self.whole.design()
        fitted_rates = fitted.parameters[2 * len(self.whole.conditions) :]
        self._rates = [fitted_rates, *(rates_to_try(self.whole) if len(fitted_rates) else [])]

    def distances(self, jobs: Sequence[Job], points: Array) -> Array:
        """Return signed distances from the intervals' ends, under 0 inside.

        They are roots of deviances, which are nearly straight lines, so that ends are found in few steps.

        Parameters
        ----------
        jobs, points
            One point for each job; jobs may come again.
        """
        whole = self.whole
        built = [self._restricted(*job, float(point)) for job, point in zip(jobs, points, strict=True)]
        design, offset, low, high = (np.array(each) for each in zip(*built, strict=True))
        starts = self._starts(jobs, points)
        count = len(starts)
        again = np.tile(np.arange(len(points)), count)
        _, values = whole.likelihood.climb(
            np.broadcast_to(whole.felt, (len(again), len(whole.felt))),
            design[again],
            offset[again],
            starts.reshape(len(again), -1),
            (low[again], high[again]),
            QUICK,
        )
        best = values.reshape(count, -1).max(axis=0)
        found: Array = np.sqrt(2 * np.maximum(0.0, self.fitted.log_likelihood - best)) - Z
        return found

    def _restricted(self, number: int, quantity: Quantity, point: float) -> tuple[Array, Array, Array, Array]:
        """Return design, offset and bounds of the functions that have the value."""
        own = 2 * number
        gone = own + QUANTITIES.index(quantity)
        design = np.delete(self.design, gone, axis=1)
        low, high = (np.delete(each, gone) for each in self.whole.bounds())
        if quantity == "slope":
            return design, math.exp(point) * self.design[:, own + 1], low, high
        # the steepness stays: predictor = predictor at the threshold + steepness (place - threshold)
        design[:, own] = self.design[:, own + 1] - point * self.design[:, own]
        offset = predictor_at_threshold(self.whole.model.core) * self.design[:, own]
        return design, offset, low, high

    def _starts(self, jobs: Sequence[Job], points: Array) -> Array:
        """Return remaining parameters to begin with, shape (starts, points, size - 1)."""
        found = np.empty((2 * len(self._rates), len(points), self.whole.size - 1))
        for job in dict.fromkeys(jobs):
            mine = [index for index, each in enumerate(jobs) if each == job]
            for number, rates in enumerate(self._rates):
                found[2 * number : 2 * number + 2, mine] = self._two_starts(job, points[mine], rates)
        return found

    def _two_starts(self, job: Job, points: Array, rates: Array) -> Array:
        """Return the fitted parameters with these rates, and two of the condition from halves of a grid."""
        (number, quantity), whole = job, self.whole
        mine = whole.stimuli(number)
        full = np.concatenate([self.fitted.parameters[: 2 * len(whole.conditions)], rates])
        guess, lapse = (float(rate[0]) for rate in whole.rates(number, full[None]))
        others = self._others(job, points)
        given = np.broadcast_to(points[:, None], others.shape)
        threshold, steepness = (given, others) if quantity == "threshold" else (others, np.exp(given))
        felt = whole.felt[None, mine]
        values = grid_log_likelihood(
            whole, number, felt, (guess, lapse), threshold.ravel(), steepness.ravel()
        ).reshape(others.shape)
        half, row = others.shape[1] // 2, np.arange(len(points))
        halves = values[:, :half].argmax(axis=1), half + values[:, half:].argmax(axis=1)
        best = np.array([others[row, each] for each in halves])
        found = np.tile(np.delete(full, 2 * number + QUANTITIES.index(quantity)), (2, len(points), 1))
        at_threshold = predictor_at_threshold(whole.model.core)
        found[:, :, 2 * number] = best if quantity == "threshold" else at_threshold - np.exp(points) * best
        return found

    def _others(self, job: Job, points: Array) -> Array:
        """Return what to try for each point: steepnesses of a threshold, thresholds of a steepness."""
        (number, quantity), levels = job, self.whole.levels(job[0])
        if quantity == "slope":
            return np.tile(threshold_grid(levels), (len(points), 1))
        usual = np.tile(np.exp(log_steepnesses(self.fitted, number)), (len(points), 1))
        # so steep that F is intermediate at the nearest level alone
        nearest = np.abs(levels - points[:, None]).min(axis=1, keepdims=True)
        steep = np.array([0.15, 0.5]) * width(self.whole.model.core) / np.maximum(nearest, _NEAREST)
        return np.hstack([usual, steep])


def log_steepnesses(fitted: Fit, number: int) -> Array:
    """Return logarithms of scaled steepnesses, from flat to as good as a step."""
    smallest = max(float(np.diff(fitted.problem.levels(number)).min()), _SMALLEST_DISTANCE)
    steepest = width(fitted.problem.model.core) / (_STEEPEST_WIDTH * smallest)
    return np.linspace(math.log(_GENTLEST), math.log(steepest), _STEEPNESSES)
