"""Where to begin: the best points of coarse grids of rates, thresholds and widths, and the best steps."""

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import Array, Core, predictor_at_threshold
from autd_analysis.psychometric.likelihood import LEAST
from autd_analysis.psychometric.model import Problem

_WIDTHS = ((8.0, 3.0), (1.2, 0.5), (0.2, 0.06))
"""Distances from F = 0.1 to 0.9, in half ranges of the levels: the best of each group is a start."""

_STEP_WIDTH = 0.1
"""Of the smallest distance between levels: as good as a step."""

_SMALLEST_DISTANCE = 1e-5  # between levels, in half ranges, that is told from none

_FAR = np.array([0.5, 2.0, 8.0])
"""Distances of thresholds outside the levels, in half ranges."""

_GUESSES, _LAPSES = (0.005, 0.06, 0.15, 0.3), (0.01, 0.1, 0.3)


def starting_points(problem: Problem, felt: Array, most: int | None = None) -> Array:
    """Return good starting parameters for data sets.

    Parameters
    ----------
    problem
        The conditions.
    felt
        Shape (data sets, conditions, rows).
    most
        The largest number of starts: the likeliest; all if None.

    Returns
    -------
    Array
        Shape (starts, data sets, size).
    """
    found = [_start(problem, felt, rates) for rates in rates_to_try(problem)]
    starts, values = (np.concatenate(each) for each in zip(*found, strict=True))
    if most is None or most >= len(starts):
        return starts
    chosen = np.argpartition(-values, most - 1, axis=0)[:most]
    return np.take_along_axis(starts, chosen[..., None], axis=0)


def rates_to_try(problem: Problem) -> list[Array]:
    """Return some values of the estimated rates, each of shape (rates,); one empty one if all are fixed."""
    guesses, lapses = problem.likelihood.rate_counts
    highest_guess, highest_lapse = problem.model.highest_rates
    return [
        np.concatenate([np.full(guesses, guess), np.full(lapses, lapse)])
        for guess in (_below(highest_guess, _GUESSES) if guesses else (0.0,))
        for lapse in (_below(highest_lapse, _LAPSES) if lapses else (0.0,))
    ]


def _below(highest: float, values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(value for value in values if value < highest) or (highest / 2,)


def _start(problem: Problem, felt: Array, rates: Array) -> tuple[Array, Array]:
    """Return starts with these rates, (starts, data sets, size), and their log likelihoods.

    One for each group of widths, and, of several conditions, the best of each.
    """
    conditions = len(problem.conditions)
    start = np.zeros((len(felt), problem.size))
    start[:, 2 * conditions :] = rates
    groups = len(_WIDTHS) + 1
    starts = np.tile(start, (groups + (conditions > 1), 1, 1))
    values = np.zeros(starts.shape[:2])
    guess, lapse = (each[0] for each in problem.likelihood.rates(start[:1]))
    for number in range(conditions):
        functions, value = _coarse(problem, number, felt, (float(guess[number]), float(lapse[number])))
        if conditions > 1:
            best = value.argmax(axis=0)[None]
            functions = np.concatenate([functions, np.take_along_axis(functions, best[..., None], axis=0)])
            value = np.concatenate([value, np.take_along_axis(value, best, axis=0)])
        starts[..., 2 * number : 2 * number + 2] = functions
        values += value
        if isinstance(problem.model.guess, str):
            values += _log_likelihood(
                felt[:, number, -1], problem.likelihood.trials[number, -1], guess[number]
            )
    return starts, values


def _coarse(problem: Problem, number: int, felt: Array, rates: tuple[float, float]) -> tuple[Array, Array]:
    """Return the best intercepts and steepnesses of each group of widths, and their log likelihoods."""
    levels, at_threshold = problem.levels(number), predictor_at_threshold(problem.model.core)
    groups = [*map(np.array, _WIDTHS), np.array([_STEP_WIDTH * smallest_distance(levels)])]
    if len(levels) == 0:
        return np.tile([0.0, 1.0], (len(groups), len(felt), 1)), np.zeros((len(groups), len(felt)))
    functions, values = [], []
    for widths in groups:
        steepness, threshold = (
            each.ravel()
            for each in np.meshgrid(width(problem.model.core) / widths, threshold_grid(levels), indexing="ij")
        )
        of_grid = grid_log_likelihood(
            problem, number, problem.of_levels(number, felt), rates, threshold, steepness
        )
        best = of_grid.argmax(axis=1)
        functions.append(np.column_stack([at_threshold - steepness[best] * threshold[best], steepness[best]]))
        values.append(of_grid.max(axis=1))
    return np.array(functions), np.array(values)


def grid_log_likelihood(
    problem: Problem,
    number: int,
    felt: Array,
    rates: tuple[float, float],
    threshold: Array,
    steepness: Array,
) -> Array:
    """Return log likelihoods of a condition, shape (data sets, points), at given guess and lapse rates."""
    core, (guess, lapse) = problem.model.core, rates
    distance = problem.levels(number) - threshold[:, None]
    below, above = core.distribution(predictor_at_threshold(core) + steepness[:, None] * distance)
    span = 1 - guess - lapse
    misses = problem.conditions[number].n - felt
    found: Array = (
        felt @ np.log(np.maximum(guess + span * below, LEAST)).T
        + misses @ np.log(np.maximum(lapse + span * above, LEAST)).T
    )
    return found


def threshold_grid(levels: Array) -> Array:
    """Return thresholds to try: the levels, halfway between them, and some outside."""
    between = (levels[1:] + levels[:-1]) / 2
    return np.sort(np.concatenate([levels, between, levels[0] - _FAR, levels[-1] + _FAR]))


def smallest_distance(levels: Array) -> float:
    """Return the smallest distance between levels, in half ranges."""
    return max(float(np.diff(levels).min(initial=2.0)), _SMALLEST_DISTANCE)


def width(core: Core) -> float:
    """Return the distance in predictors from F = 0.1 to F = 0.9."""
    low, high = core.quantile(np.array([0.1, 0.9]))
    return float(high - low)


def best_step(
    felt: Array, n: Array, guess: Array, lapse: Array
) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_]]:
    """Return the likeliest step function: what an infinitely steep function can reach.

    Parameters
    ----------
    felt, n
        Answers by ascending level, shapes (data sets, levels) and (levels,).
    guess, lapse
        Shape (data sets,).

    Returns
    -------
    log likelihood, level, inside
        Each of shape (data sets,). The step is before the level of this number; or, if inside, at this level,
        where F may then have any value.
    """
    p_low, p_high = guess[:, None], 1 - lapse[:, None]
    low, high = _log_likelihood(felt, n, p_low), _log_likelihood(felt, n, p_high)
    own = _log_likelihood(felt, n, np.clip(felt / n, p_low, p_high))
    below = np.pad(np.cumsum(low, axis=1), ((0, 0), (1, 0)))
    above = np.pad(np.cumsum(high[:, ::-1], axis=1)[:, ::-1], ((0, 0), (0, 1)))
    before, at = below + above, below[:, :-1] + own + above[:, 1:]
    best_before, best_at = before.max(axis=1), at.max(axis=1)
    inside = best_at > best_before + 1e-9
    level = np.where(inside, at.argmax(axis=1), before.argmax(axis=1))
    return np.where(inside, best_at, best_before), level, inside


def _log_likelihood(felt: Array, n: Array, p: Array) -> Array:
    found: Array = felt * np.log(np.maximum(p, LEAST)) + (n - felt) * np.log(np.maximum(1 - p, LEAST))
    return found
