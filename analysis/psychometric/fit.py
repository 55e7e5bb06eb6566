"""Psychometric functions by maximum likelihood, and what can be said where there is no such function."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.psychometric.functions import (
    Array,
    Axis,
    predictor_at_threshold,
    slope_per_steepness,
)
from analysis.psychometric.model import Answers, Model, Problem, problem
from analysis.psychometric.starts import best_step, starting_points

_SAME = 1e-6  # log likelihoods that differ less are the same
_FLAT = 1e-7  # steepness per half range of the levels below which a function is flat


@dataclass(frozen=True)
class Curve:
    """The function of one condition.

    Attributes
    ----------
    threshold
        Stimulus at which F is 0.5; None where answers do not tell.
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
    parameters, values = fit_many(whole, whole.felt[None])
    curves = tuple(_curve(whole, number, parameters) for number in range(len(conditions)))
    return Fit(whole, parameters[0], float(values[0]), curves)


def fit_many(whole: Problem, felt: Array) -> tuple[Array, Array]:
    """Fit data sets of the same design.

    Parameters
    ----------
    whole
        The design.
    felt
        Shape (data sets, rows).

    Returns
    -------
    parameters, log likelihoods
        Shapes (data sets, size) and (data sets,).
    """
    starts = starting_points(whole, felt)
    count, sets = starts.shape[:2]
    design = np.broadcast_to(whole.design(), (count * sets, *whole.design().shape))
    low, high = (np.broadcast_to(bound, (count * sets, whole.size)) for bound in whole.bounds())
    every = np.tile(felt, (count, 1))
    flat = starts.reshape(count * sets, whole.size)
    parameters, values = whole.likelihood.climb(every, design, np.zeros(every.shape), flat, (low, high))
    best = values.reshape(count, sets).argmax(axis=0)
    chosen = best * sets + np.arange(sets)
    return parameters[chosen], values[chosen]


def condition_log_likelihood(whole: Problem, number: int, felt: Array, parameters: Array) -> Array:
    """Return log likelihoods of a condition's stimuli, shape (data sets,)."""
    mine = (whole.condition == number) & (whole.likelihood.stimulus > 0)
    p, not_p = probabilities(whole, parameters)
    misses = whole.likelihood.trials - felt
    found: Array = (felt * np.log(p) + misses * np.log(not_p))[:, mine].sum(axis=1)
    return found


def probabilities(whole: Problem, parameters: Array) -> tuple[Array, Array]:
    """Return p and 1 - p of every row, shape (data sets, rows)."""
    functions = 2 * len(whole.conditions)
    return whole.likelihood.probability(
        parameters[:, :functions] @ whole.design().T, parameters[:, functions:]
    )


def steps(
    whole: Problem, number: int, felt: Array, parameters: Array
) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.bool_]]:
    """Return whether a step is as likely as what was fitted; before or at which level, as `best_step`."""
    mine = (whole.condition == number) & (whole.likelihood.stimulus > 0)
    guess, lapse = whole.rates(number, parameters)
    best, level, inside = best_step(felt[:, mine], whole.conditions[number].n, guess, lapse)
    fitted = condition_log_likelihood(whole, number, felt, parameters)
    return fitted <= best + _SAME, level, inside


def _curve(whole: Problem, number: int, parameters: Array) -> Curve:
    guess, lapse = (float(rate[0]) for rate in whole.rates(number, parameters))
    intercept, steepness = (float(each) for each in parameters[0, 2 * number : 2 * number + 2])
    threshold, slope, notes = _threshold_and_slope(whole, number, parameters)
    return Curve(
        threshold=threshold,
        slope=slope,
        guess=guess,
        lapse=lapse,
        intercept=intercept - steepness * whole.middle / whole.reach,
        steepness=steepness / whole.reach,
        notes=notes,
    )


def _threshold_and_slope(
    whole: Problem, number: int, parameters: Array
) -> tuple[float | None, float | None, tuple[str, ...]]:
    x = whole.conditions[number].x
    if len(x) < 2:
        return None, None, ("one level only: no function" if len(x) else "no trials",)
    is_step, level, inside = (each[0] for each in steps(whole, number, whole.felt[None], parameters))
    if is_step:
        return _step_threshold(whole, number, int(level), at=bool(inside))
    intercept, steepness = parameters[0, 2 * number : 2 * number + 2]
    if steepness < _FLAT:
        return None, 0.0, ("answers do not rise along the levels: no threshold",)
    core = whole.model.core
    place = whole.middle + whole.reach * (predictor_at_threshold(core) - intercept) / steepness
    threshold = whole.axis.stimulus(float(place))
    slope = slope_per_steepness(core) * float(steepness) / whole.reach
    if not x[0] <= threshold <= x[-1]:
        where = "below" if threshold < x[0] else "above"
        return threshold, slope, (f"threshold lies {where} the levels tested: extrapolated",)
    return threshold, slope, ()


def _step_threshold(
    whole: Problem, number: int, level: int, *, at: bool
) -> tuple[float | None, float | None, tuple[str, ...]]:
    x = whole.conditions[number].x
    if at:
        note = f"answers change at {x[level]:.6g}: a step there is likeliest, with infinite slope"
        return float(x[level]), math.inf, (note,)
    if level == 0:
        return None, None, ("felt at all levels: the threshold lies below them",)
    if level == len(x):
        return None, None, ("not felt at any level: the threshold lies above them",)
    low, high = (float(each) for each in x[level - 1 : level + 1])
    middle = whole.axis.stimulus(float(whole.axis.place(np.array([low, high])).mean()))
    note = (
        f"answers change between {low:.6g} and {high:.6g}: a step is likeliest, with infinite slope and its "
        "threshold anywhere between; the middle is given"
    )
    return middle, math.inf, (note,)
