"""Psychometric functions by maximum likelihood, and what can be said where there is no such function."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import (
    Array,
    Axis,
    predictor_at_threshold,
    slope_per_steepness,
)
from autd_analysis.psychometric.likelihood import PRECISE, QUICK, Tops
from autd_analysis.psychometric.model import Answers, Model, Problem, problem
from autd_analysis.psychometric.starts import best_step, starting_points

_SAME = 1e-5  # log likelihoods that differ less are the same
FARTHEST = 21.0
"""Largest scaled place of a threshold: 10 ranges of the levels beyond them."""

NOT_AT_REST = "the fit did not come to rest: there may be a likelier function"

_HIGHER = 1e-3  # log likelihood of a point on a coarse grid over a top elsewhere
_AT_BOUND = 1e-6
_FLAT = 1e-7  # steepness per half range of the levels below which a function is flat


@dataclass(frozen=True)
class Curve:
    """The function of one condition.

    Attributes
    ----------
    threshold
        Stimulus at which F is 0.5; None where undetermined.
    slope
        dF/dt there, per octave or unit; infinite for a step, 0 for a flat function, None where answers do not
        tell.
    guess, lapse
        Fixed or estimated.
    intercept, steepness
        The predictor is intercept + steepness t.
    notes
        What is odd.
    """

    threshold: float | None
    slope: float | None
    guess: float
    lapse: float
    intercept: float
    steepness: float
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Fit:
    """The functions of conditions that were fitted together.

    Attributes
    ----------
    problem
        What was fitted.
    parameters
        As `Problem` says, shape (size,).
    log_likelihood
        Without the binomial coefficients.
    curves
        One per condition.
    """

    problem: Problem
    parameters: Array
    log_likelihood: float
    curves: tuple[Curve, ...]


def fit(conditions: Sequence[Answers], model: Model, axis: Axis) -> Fit:
    """Fit the functions of one participant's conditions.

    Parameters
    ----------
    conditions
        Answers in each condition.
    model
        The form of the functions; functions never fall.
    axis
        The abscissa.

    Returns
    -------
    Fit
        A curve for every condition; where there is no threshold its notes say why.
    """
    whole = problem(conditions, model, axis)
    felt = whole.felt[None]
    top = climb(whole, felt, starting_points(whole, felt)[0], PRECISE)
    low, high = whole.bounds()
    rested = bool(whole.likelihood.at_rest(felt, top.parameters, (low[None], high[None]))[0])
    curves = tuple(_curve(whole, number, top.parameters, rested=rested) for number in range(len(conditions)))
    return Fit(whole, top.parameters[0], float(top.values[0]), curves)


def fit_many(fitted: Fit, felt: Array) -> Array:
    """Fit data sets that were drawn from a fitted function.

    Climbs begin at that function, and once more where a coarse grid knows a likelier one than they reach.

    Parameters
    ----------
    fitted
        The fit.
    felt
        Shape (data sets, conditions, rows).

    Returns
    -------
    Array
        Parameters, shape (data sets, size).
    """
    whole = fitted.problem
    tops = climb(whole, felt, np.tile(fitted.parameters, (1, len(felt), 1)), QUICK)
    starts, values = starting_points(whole, felt)
    best, every = values.argmax(axis=0), np.arange(len(felt))
    elsewhere = np.flatnonzero(values[best, every] > tops.values + _HIGHER)
    if len(elsewhere):
        others = climb(whole, felt[elsewhere], starts[best, every][None, elsewhere], QUICK)
        tops.parameters[elsewhere] = others.parameters
    return tops.parameters


def climb(whole: Problem, felt: Array, starts: Array, gain: float) -> Tops:
    """Climb from all starts, (starts, data sets, size), and return the best top of each data set."""
    count, sets = starts.shape[:2]
    low, high = (np.broadcast_to(bound, (count * sets, whole.size)) for bound in whole.bounds())
    every = np.broadcast_to(felt, (count, *felt.shape)).reshape(-1, *felt.shape[1:])
    tops = whole.likelihood.climb(every, starts.reshape(-1, whole.size), (low, high), gain)
    best = tops.values.reshape(count, sets).argmax(axis=0)
    return tops.of(best * sets + np.arange(sets))


def condition_log_likelihood(whole: Problem, number: int, felt: Array, parameters: Array) -> Array:
    """Return log likelihoods of a condition's stimuli, shape (data sets,)."""
    found: Array = whole.of_levels(number, whole.likelihood.values(felt, parameters)).sum(axis=1)
    return found


@dataclass(frozen=True, eq=False)
class Shapes:
    """What was fitted to a condition's data sets; arrays of shape (data sets,).

    Attributes
    ----------
    place
        Scaled place of the threshold; infinite where all answers speak for one beyond the levels, NaN where
        functions are flat or rise so little that it would be too far away.
    slope
        dF/dt at the threshold; infinite for steps, 0 for flat functions.
    step
        Whether a step is as likely as what was fitted.
    level, at
        The step is before the level of this number, or at it: F may then have any value there.
    """

    place: Array
    slope: Array
    step: NDArray[np.bool_]
    level: NDArray[np.intp]
    at: NDArray[np.bool_]


def shapes(whole: Problem, number: int, felt: Array, parameters: Array) -> Shapes:
    """Return thresholds and slopes of fits, of a condition with two levels or more.

    Parameters
    ----------
    whole, number
        The design, and the number of the condition.
    felt, parameters
        What was fitted, shape (data sets, conditions, rows), and what came out, (data sets, size).
    """
    guess, lapse = whole.rates(number, parameters)
    n, levels, answered = whole.conditions[number].n, whole.levels(number), whole.of_levels(number, felt)
    best, level, at = best_step(answered, n, guess, lapse)
    step = condition_log_likelihood(whole, number, felt, parameters) <= best + _SAME
    intercept, steepness = parameters[:, 2 * number], parameters[:, 2 * number + 1]
    flat = steepness < _FLAT
    rise = np.where(flat, 1.0, steepness)
    place = np.where(flat, np.nan, (predictor_at_threshold(whole.model.core) - intercept) / rise)
    place = np.where(np.abs(place) > FARTHEST, np.nan, place)
    halfway = (guess + 1 - lapse) / 2
    outer = np.concatenate([[-np.inf], levels, [np.inf]])
    rate = (answered / n)[np.arange(len(felt)), np.minimum(level, len(levels) - 1)]
    between = (outer[level] + outer[level + 1]) / 2
    beyond = np.where((level == 0) & (rate > halfway), -np.inf, outer[np.minimum(level + 1, len(levels))])
    beyond = np.where((level == len(levels) - 1) & (rate < halfway), np.inf, beyond)
    slope = slope_per_steepness(whole.model.core) * steepness / whole.reach
    return Shapes(
        place=np.where(step, np.where(at, beyond, between), place),
        slope=np.where(step, np.inf, np.where(flat, 0.0, slope)),
        step=step,
        level=level,
        at=at,
    )


def _curve(whole: Problem, number: int, parameters: Array, *, rested: bool) -> Curve:
    guess, lapse = (float(rate[0]) for rate in whole.rates(number, parameters))
    intercept, steepness = (float(each) for each in parameters[0, 2 * number : 2 * number + 2])
    threshold, slope, notes = _threshold_and_slope(whole, number, parameters)
    at_most = [
        f"the {name} rate is at the highest allowed, {highest:g}"
        for name, rate, found, highest in zip(
            ("guess", "lapse"),
            (whole.model.guess, whole.model.lapse),
            (guess, lapse),
            whole.model.highest_rates,
            strict=True,
        )
        if isinstance(rate, str) and found >= highest - _AT_BOUND
    ]
    return Curve(
        threshold=threshold,
        slope=slope,
        guess=guess,
        lapse=lapse,
        intercept=intercept - steepness * whole.middle / whole.reach,
        steepness=steepness / whole.reach,
        notes=(*notes, *at_most, *(() if rested else (NOT_AT_REST,))),
    )


def _threshold_and_slope(
    whole: Problem, number: int, parameters: Array
) -> tuple[float | None, float | None, tuple[str, ...]]:
    x = whole.conditions[number].x
    if len(x) < 2:
        return None, None, ("one level only: no function" if len(x) else "no trials",)
    shape = shapes(whole, number, whole.felt[None], parameters)
    place, slope = float(shape.place[0]), float(shape.slope[0])
    if math.isnan(place):
        how = "rise too little" if slope > 0 else "do not rise"
        return None, slope, (f"answers {how} along the levels: no threshold",)
    if math.isinf(place):
        side = "below" if place < 0 else "above"
        return None, None, (f"the responses determine only that the threshold lies {side} the levels tested",)
    threshold = whole.axis.stimulus(whole.middle + whole.reach * place)
    if shape.step[0]:
        return threshold, slope, (_step_note(x, int(shape.level[0]), at=bool(shape.at[0])),)
    if not x[0] <= threshold <= x[-1]:
        side = "below" if threshold < x[0] else "above"
        return threshold, slope, (f"threshold lies {side} the levels tested: extrapolated",)
    return threshold, slope, ()


def _step_note(x: Array, level: int, *, at: bool) -> str:
    if at:
        return f"a step at {x[level]:.6g} is likeliest: infinite slope"
    return (
        f"a step between {x[level - 1]:.6g} and {x[level]:.6g} is likeliest: infinite slope, and any "
        "threshold between; the middle is given"
    )
