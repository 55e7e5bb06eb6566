"""Where to begin: coarse grids of thresholds and widths, and the best step function, of each condition."""

import itertools

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import Array, Core, predictor_at_threshold
from autd_analysis.psychometric.likelihood import LEAST
from autd_analysis.psychometric.model import Problem

_WIDTHS = np.array([[8.0, 3.0, 1.2], [0.5, 0.2, 0.06]])
"""Distances from F = 0.1 to 0.9, in half ranges of the levels: climbs start from a wide and a narrow one."""

_FAR = np.array([0.5, 2.0, 8.0])
"""Distances of thresholds outside the levels, in half ranges."""

_GUESSES, _LAPSES = (0.005, 0.06, 0.12, 0.19), (0.01, 0.1)


def starting_points(problem: Problem, felt: Array) -> Array:
    """Return good starting parameters for data sets.

    Parameters
    ----------
    problem
        The conditions.
    felt
        Shape (data sets, rows).

    Returns
    -------
    Array
        Shape (starts, data sets, size): a wide and a narrow start for each of some guess and lapse rates.
    """
    functions = len(problem.conditions)
    starts = []
    for rates, widths in itertools.product(rates_to_try(problem), _WIDTHS):
        start = np.zeros((len(felt), problem.size))
        start[:, 2 * functions :] = rates
        for number in range(functions):
            mine = problem.stimuli(number)
            guess, lapse = (float(each[0]) for each in problem.rates(number, start[:1]))
            start[:, 2 * number : 2 * number + 2] = _coarse(
                problem, number, felt[:, mine], (guess, lapse), widths
            )
        starts.append(start)
    return np.array(starts)


def rates_to_try(problem: Problem) -> list[Array]:
    """Return some values of the estimated rates, each of shape (rates,); one empty one if all are fixed."""
    guesses, lapses = problem.likelihood.guess_of.shape[1], problem.likelihood.lapse_of.shape[1]
    return [
        np.concatenate([np.full(guesses, guess), np.full(lapses, lapse)])
        for guess in (_GUESSES if guesses else (0.0,))
        for lapse in (_LAPSES if lapses else (0.0,))
    ]


def _coarse(problem: Problem, number: int, felt: Array, rates: tuple[float, float], widths: Array) -> Array:
    """Return the best intercept and steepness of a grid for each data set, shape (data sets, 2)."""
    levels = problem.levels(number)
    if len(levels) == 0:
        return np.tile([0.0, 1.0], (len(felt), 1))
    steepness, threshold = (
        each.ravel()
        for each in np.meshgrid(width(problem.model.core) / widths, threshold_grid(levels), indexing="ij")
    )
    values = grid_log_likelihood(problem, number, felt, rates, threshold, steepness)
    best = values.argmax(axis=1)
    intercept = predictor_at_threshold(problem.model.core) - steepness * threshold
    return np.column_stack([intercept[best], steepness[best]])


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
