"""The profile likelihood of thresholds and slopes: the best function that has a given one."""

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.fit import Fit
from autd_analysis.psychometric.functions import Array, predictor_at_threshold
from autd_analysis.psychometric.likelihood import QUICK, Restriction
from autd_analysis.psychometric.starts import (
    grid_log_likelihood,
    rates_to_try,
    threshold_grid,
    width,
)

Quantity = Literal["threshold", "slope"]
Job = tuple[int, Quantity]
"""Number of a condition, and what is profiled."""

QUANTITIES: tuple[Quantity, Quantity] = ("threshold", "slope")

Z = 1.959963984540054
_STEEPNESSES = 20
_GENTLEST = 1e-3
_STEEPEST_WIDTH = 0.1  # of the smallest distance between levels: as good as a step
_SMALLEST_DISTANCE = 0.01  # in half ranges
_NEAREST = 1e-9
_MOST_RATES = 1  # values of the estimated rates to begin with, besides the fitted ones
_MOST_ROUNDS = 60
_GAINED = 1e-4


class Profile:
    """The profile of any condition's threshold (scaled place) or slope (log of the scaled steepness).

    Parameters
    ----------
    fitted
        The fit.
    grids
        Ascending points at which each profile is looked at first.
    """

    def __init__(self, fitted: Fit, grids: Mapping[Job, Array]) -> None:
        self.fitted, self.whole = fitted, fitted.problem
        self.grids = dict(grids)
        self._jobs = [job for job, grid in grids.items() for _ in grid]
        self._points = np.concatenate(list(grids.values()))
        sizes = [len(grid) for grid in grids.values()]
        self._number = np.repeat(np.arange(len(sizes)), sizes)
        self._first = dict(zip(grids, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
        self._found, self._values = self._climb(self._jobs, self._points, self._starts())
        if sum(self.whole.likelihood.rate_counts):
            self._compare_neighbours()

    def on_grid(self, job: Job) -> Array:
        """Return signed distances from the interval's ends at the points of a grid, under 0 inside.

        They are roots of deviances, which are nearly straight lines, so that ends are found in few steps.
        """
        first = self._first[job]
        return self._distances(self._values[first : first + len(self.grids[job])])

    def between(self, jobs: Sequence[Job], points: Array) -> Array:
        """Return the same of one point for each job, from what was found at its neighbours on the grid."""
        starts = np.empty((2, len(points), self.whole.size))
        for index, (job, point) in enumerate(zip(jobs, points, strict=True)):
            grid = self.grids[job]
            after = min(max(int(np.searchsorted(grid, point)), 1), len(grid) - 1)
            starts[:, index] = self._found[self._first[job] + after - 1 : self._first[job] + after + 1]
        return self._distances(self._climb(jobs, points, starts)[1])

    def _distances(self, values: Array) -> Array:
        found: Array = np.sqrt(2 * np.maximum(0.0, self.fitted.log_likelihood - values)) - Z
        return found

    def _compare_neighbours(self) -> None:
        """Climb from what was found at each point's neighbours, until no point gains by that."""
        news = np.arange(len(self._points))
        for _ in range(_MOST_ROUNDS):
            news = np.union1d(self._climb_from(news, -1), self._climb_from(news, 1))
            if len(news) == 0:
                break

    def _climb_from(self, there: NDArray[np.intp], side: int) -> NDArray[np.intp]:
        """Climb at the points on one side of these from what was found at these; return which gained."""
        here = there + side
        inside = (here >= 0) & (here < len(self._jobs))
        inside &= self._number[np.clip(here, 0, len(self._jobs) - 1)] == self._number[there]
        here, there = here[inside], there[inside]
        if len(here) == 0:
            return here
        jobs = [self._jobs[index] for index in here]
        found, values = self._climb(jobs, self._points[here], self._found[None, there])
        better = values > self._values[here] + _GAINED
        here = here[better]
        self._found[here], self._values[here] = found[better], values[better]
        return here

    def _climb(self, jobs: Sequence[Job], points: Array, starts: Array) -> tuple[Array, Array]:
        """Return restricted parameters, (points, size), and log likelihoods, (points,)."""
        whole, count = self.whole, len(starts)
        restriction, low, high = self._restricted(jobs, points)
        again = np.tile(np.arange(len(points)), count)
        tops = whole.likelihood.climb(
            np.broadcast_to(whole.felt, (len(again), *whole.felt.shape)),
            starts.reshape(-1, whole.size),
            (low[again], high[again]),
            QUICK,
            restriction.of(again),
        )
        best = tops.of(tops.values.reshape(count, -1).argmax(axis=0) * len(points) + np.arange(len(points)))
        return best.parameters, best.values

    def _restricted(self, jobs: Sequence[Job], points: Array) -> tuple[Restriction, Array, Array]:
        """Return what functions have the values, and the bounds of their parameters.

        Of the condition the parameters are threshold and steepness, of which one is given.
        """
        conditions, at_threshold = len(self.whole.conditions), predictor_at_threshold(self.whole.model.core)
        offset = np.zeros((len(points), conditions, 2))
        transform = np.tile(np.eye(2), (len(points), conditions, 1, 1))
        low, high = (np.tile(bound, (len(points), 1)) for bound in self.whole.bounds())
        for index, ((number, quantity), point) in enumerate(zip(jobs, points.tolist(), strict=True)):
            gone = 2 * number + QUANTITIES.index(quantity)
            low[index, gone] = high[index, gone] = 0
            if quantity == "threshold":
                offset[index, number] = at_threshold, 0
                transform[index, number] = np.array([[0.0, -point], [0.0, 1.0]])
            else:
                steepness = math.exp(point)
                offset[index, number] = at_threshold, steepness
                transform[index, number] = np.array([[-steepness, 0.0], [0.0, 0.0]])
        return Restriction(offset, transform), low, high

    def _starts(self) -> Array:
        """Return parameters to begin with on the grids, shape (starts, points, size)."""
        found = []
        for job, grid in self.grids.items():
            fitted, *others = (self._two_starts(job, grid, rates) for rates in self._rates_to_try())
            starts = [fitted[0]]
            if others:
                tried, values = (np.concatenate(each) for each in zip(*others, strict=True))
                chosen = np.argsort(-values, axis=0, kind="stable")[:_MOST_RATES]
                starts.append(np.take_along_axis(tried, chosen[..., None], axis=0))
            found.append(np.concatenate(starts))
        return np.concatenate(found, axis=1)

    def _rates_to_try(self) -> list[Array]:
        rates = self.fitted.parameters[2 * len(self.whole.conditions) :]
        return [rates, *(rates_to_try(self.whole) if len(rates) else [])]

    def _two_starts(self, job: Job, points: Array, rates: Array) -> tuple[Array, Array]:
        """Return the fitted parameters with these rates, and two of the condition from halves of a grid.

        Shapes (2, points, size) and, of their log likelihoods, (2, points).
        """
        (number, quantity), whole = job, self.whole
        full = np.concatenate([self.fitted.parameters[: 2 * len(whole.conditions)], rates])
        guess, lapse = (float(rate[0]) for rate in whole.rates(number, full[None]))
        others = self._others(job, points)
        given = np.broadcast_to(points[:, None], others.shape)
        threshold, steepness = (given, others) if quantity == "threshold" else (others, np.exp(given))
        values = grid_log_likelihood(
            whole,
            number,
            whole.of_levels(number, whole.felt[None]),
            (guess, lapse),
            threshold.ravel(),
            steepness.ravel(),
        ).reshape(others.shape)
        half, row = others.shape[1] // 2, np.arange(len(points))
        best = [values[:, :half].argmax(axis=1), half + values[:, half:].argmax(axis=1)]
        found = np.tile(full, (2, len(points), 1))
        found[:, :, 2 * number + 1 - QUANTITIES.index(quantity)] = [others[row, each] for each in best]
        rows = whole.likelihood.values(whole.felt[None], full[None])[0]
        rows[number, : len(whole.conditions[number].x)] = 0
        return found, float(rows.sum()) + np.array([values[row, each] for each in best])

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
