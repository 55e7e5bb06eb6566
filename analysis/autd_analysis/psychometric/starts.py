"""Where to begin: the best points of coarse grids of rates, thresholds and widths, and the best steps."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import Array, Core, predictor_at_threshold
from autd_analysis.psychometric.likelihood import LEAST, Rate
from autd_analysis.psychometric.model import Problem

_WIDTHS = ((8.0, 3.0), (1.2, 0.5), (0.2, 0.06))
"""Distances from F = 0.1 to 0.9, in half ranges of the levels: the best of each group is a start."""

_FLAT_WIDTH = 50.0
_SHARES = np.array([0.005, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.995])
"""The width of functions that are nearly flat, and their F."""

_STEP_WIDTH = 0.1
"""Of the smallest distance between levels: as good as a step."""

_GROUPS = len(_WIDTHS) + 2

_SMALLEST_DISTANCE = 1e-5  # between levels that differ, in half ranges

_FAR = np.array([0.5, 2.0, 8.0])
"""Distances of thresholds outside the levels, in half ranges."""

_GUESSES, _LAPSES = (0.005, 0.06, 0.15, 0.35), (0.01, 0.1, 0.25, 0.45)


def starting_points(problem: Problem, felt: Array) -> tuple[Array, Array]:
    """Return good starting parameters for data sets.

    Parameters
    ----------
    problem
        The conditions.
    felt
        Shape (data sets, conditions, rows).

    Returns
    -------
    starts, log likelihoods
        Shapes (starts, data sets, size) and (starts, data sets).
    """
    found = [_start(problem, felt, rates) for rates in rates_to_try(problem)]
    if len(problem.conditions) == 1 and any(problem.likelihood.rate_counts) and len(problem.levels(0)):
        found.append(_step_start(problem, felt))
    starts, values = (np.concatenate(each) for each in zip(*found, strict=True))
    return starts, values


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

    One for each group of functions, and, of several conditions, the best of each.
    """
    conditions = len(problem.conditions)
    start = np.zeros((len(felt), problem.size))
    start[:, 2 * conditions :] = rates
    starts = np.tile(start, (_GROUPS + (conditions > 1), 1, 1))
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


def _step_start(problem: Problem, felt: Array) -> tuple[Array, Array]:
    """Return the likeliest step of a single condition with its own guess and lapse rates, as `_start` does.

    Rates of coarse grids may miss it: they are shares of the answers below and above the step.
    """
    levels, core, n = problem.levels(0), problem.model.core, problem.conditions[0].n
    answered, missed = problem.of_levels(0, felt), n - problem.of_levels(0, felt)
    silent, silent_n = felt[:, 0, -1:], problem.likelihood.trials[0, -1]
    hits = silent + np.pad(np.cumsum(answered, axis=1), ((0, 0), (1, 0)))
    fails = np.pad(np.cumsum(missed[:, ::-1], axis=1)[:, ::-1], ((0, 0), (0, 1)))
    low_n = silent_n + np.concatenate([[0.0], np.cumsum(n)])
    high_n = n.sum() - np.concatenate([[0.0], np.cumsum(n)])
    # of a step before a level both sides meet, and of one at a level they leave it out
    last = len(levels)
    before, after = np.r_[0 : last + 1, 0:last], np.r_[0 : last + 1, 1 : last + 1]
    guess = _shares(hits[:, before], low_n[before], problem.model.guess, problem.model.highest_rates[0])
    lapse = _shares(fails[:, after], high_n[after], problem.model.lapse, problem.model.highest_rates[1])
    values = _log_likelihood(hits[:, before], low_n[before], guess)
    values += _log_likelihood(fails[:, after], high_n[after], lapse)
    own = np.clip(answered / n, guess[:, last + 1 :], 1 - lapse[:, last + 1 :])
    values[:, last + 1 :] += _log_likelihood(answered, n, own)
    best, row = values.argmax(axis=1), np.arange(len(felt))
    outer = np.concatenate([[levels[0] - 1], levels, [levels[-1] + 1]])
    places = np.concatenate([(outer[1:] + outer[:-1]) / 2, levels])
    steepness = width(core) / (_STEP_WIDTH * smallest_distance(levels))
    guesses, lapses = problem.likelihood.rate_counts
    intercept = predictor_at_threshold(core) - steepness * places[best]
    columns = [intercept, np.full(len(felt), steepness)]
    columns += [guess[row, best]] * guesses + [lapse[row, best]] * lapses
    return np.stack(columns, axis=1)[None], values[None, row, best]


def _shares(count: Array, n: Array, rate: Rate, highest: float) -> Array:
    """Return estimated rates: shares, as far as they may be, or the fixed rate."""
    if not isinstance(rate, str):
        return np.full(count.shape, rate)
    return np.clip(count / np.maximum(n, 1), 0, highest)


def _coarse(problem: Problem, number: int, felt: Array, rates: tuple[float, float]) -> tuple[Array, Array]:
    """Return the best intercepts and steepnesses of each group, and their log likelihoods."""
    levels, at_threshold = problem.levels(number), predictor_at_threshold(problem.model.core)
    if len(levels) == 0:
        return np.tile([0.0, 1.0], (_GROUPS, len(felt), 1)), np.zeros((_GROUPS, len(felt)))
    functions, values = [], []
    for threshold, steepness in _groups(problem.model.core, levels):
        answered = problem.of_levels(number, felt)
        of_grid = grid_log_likelihood(problem, number, answered, rates, threshold, steepness)
        best = of_grid.argmax(axis=1)
        functions.append(np.column_stack([at_threshold - steepness[best] * threshold[best], steepness[best]]))
        values.append(of_grid.max(axis=1))
    return np.array(functions), np.array(values)


def _groups(core: Core, levels: Array) -> Iterator[tuple[Array, Array]]:
    """Yield thresholds and steepnesses to try: nearly flat functions, wide to narrow ones, and steps."""
    gentle = width(core) / _FLAT_WIDTH
    yield (predictor_at_threshold(core) - core.quantile(_SHARES)) / gentle, np.full(len(_SHARES), gentle)
    steps = (_STEP_WIDTH * smallest_distance(levels),)
    for widths in (*_WIDTHS, steps):
        threshold, steepness = np.meshgrid(threshold_grid(levels), width(core) / np.array(widths))
        yield threshold.ravel(), steepness.ravel()


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
