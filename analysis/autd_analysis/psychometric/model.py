"""What is fitted: the answers of one participant in one or more conditions, and the model's choices."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_analysis.psychometric.functions import NORMAL, Array, Axis, Core
from autd_analysis.psychometric.likelihood import Likelihood, Rate

HIGHEST_GUESS, HIGHEST_LAPSE = 0.4, 0.5
"""Highest rates that are estimated; a fixed rate lowers what the other may be, by `LEAST_SPAN`."""

LEAST_SPAN = 0.1
"""Least 1 - guess - lapse: with less a function hardly rises, whatever its threshold."""


@dataclass(frozen=True)
class Model:
    """The form of the functions.

    Attributes
    ----------
    core
        F.
    guess, lapse
        How the rates are found.
    """

    core: Core = NORMAL
    guess: Rate = 0.0
    lapse: Rate = 0.02

    @property
    def joint(self) -> bool:
        """Whether conditions share a parameter."""
        return "shared" in (self.guess, self.lapse)

    @property
    def highest_rates(self) -> tuple[float, float]:
        """The highest guess and the highest lapse rate that are estimated."""
        guess, lapse = (0.0 if isinstance(rate, str) else rate for rate in (self.guess, self.lapse))
        return min(HIGHEST_GUESS, 1 - LEAST_SPAN - lapse), min(HIGHEST_LAPSE, 1 - LEAST_SPAN - guess)


@dataclass(frozen=True, eq=False)
class Answers:
    """Answers in one condition, by level.

    Attributes
    ----------
    x, felt, n
        Levels in ascending order, each once, with answers "felt" and trials; shape (levels,).
    catch_felt, catch_n
        The same of trials without a stimulus; they inform the guess rate alone.
    """

    x: Array
    felt: Array
    n: Array
    catch_felt: float = 0.0
    catch_n: float = 0.0


def answers(
    rows: Sequence[tuple[float, float, float]], axis: Axis, catch: tuple[float, float] = (0.0, 0.0)
) -> Answers:
    """Return the answers of one condition.

    Parameters
    ----------
    rows
        Level, answers "felt" and trials; any number of rows, levels may come again.
    axis
        Where it is logarithmic a level of 0 is a trial without a stimulus.
    catch
        Answers "felt" and trials of catch trials.
    """
    table = np.array([row for row in rows if row[2] > 0], float).reshape(-1, 3)
    silent = axis.logarithmic & (table[:, 0] == 0)
    catch_felt, catch_n = (float(each) for each in table[silent, 1:].sum(axis=0) + catch)
    x, index = np.unique(table[~silent, 0], return_inverse=True)
    felt, n = (np.bincount(index, table[~silent, column], len(x)).astype(float) for column in (1, 2))
    return Answers(x, felt, n, catch_felt, catch_n)


def axis_of(levels: Array) -> Axis:
    """Return octaves where no level is negative and any is positive, else the levels themselves."""
    return Axis(bool(len(levels) and (levels >= 0).all() and (levels > 0).any()))


@dataclass(frozen=True, eq=False)
class Problem:
    """Conditions put together for the likelihood.

    Rows of a condition are its levels, padding, and last its catch trials. Parameters are intercept and
    steepness of each condition (of t about the middle), guess rates, and lapse rates.

    Attributes
    ----------
    model, axis, conditions
        What is fitted.
    middle, reach
        The abscissa is scaled to (t - middle) / reach, which is -1 to 1 for the levels of all conditions.
    likelihood
        Of the rows.
    felt
        Shape (conditions, rows).
    """

    model: Model
    axis: Axis
    conditions: tuple[Answers, ...]
    middle: float
    reach: float
    likelihood: Likelihood
    felt: Array

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.likelihood.size

    def bounds(self) -> tuple[Array, Array]:
        """Return the lowest and highest parameters: functions do not fall, rates are as `Model` allows."""
        functions, guesses, lapses = len(self.conditions), *self.likelihood.rate_counts
        low = np.concatenate([np.tile([-np.inf, 0.0], functions), np.zeros(guesses + lapses)])
        highest_guess, highest_lapse = self.model.highest_rates
        high = np.concatenate(
            [
                np.full(2 * functions, np.inf),
                np.full(guesses, highest_guess),
                np.full(lapses, highest_lapse),
            ]
        )
        return low, high

    def levels(self, number: int) -> Array:
        """Return the scaled levels of a condition."""
        found: Array = self.likelihood.place[number, : len(self.conditions[number].x)]
        return found

    def of_levels(self, number: int, rows: Array) -> Array:
        """Return what rows, (data sets, conditions, rows), say of a condition's levels."""
        return rows[:, number, : len(self.conditions[number].x)]

    def rates(self, number: int, parameters: Array) -> tuple[Array, Array]:
        """Return guess and lapse rates of a condition, (problems,), of parameters (problems, size)."""
        guess, lapse = self.likelihood.rates(parameters)
        return guess[:, number], lapse[:, number]


def problem(conditions: Sequence[Answers], model: Model, axis: Axis) -> Problem:
    """Put conditions together. Catch trials do not count where the guess rate is fixed."""
    places = [axis.place(each.x) for each in conditions]
    every = np.concatenate([*places, [0.0]])[: max(1, sum(map(len, places)))]
    middle, reach = float((every.max() + every.min()) / 2), float((every.max() - every.min()) / 2) or 1.0
    rows = max(map(len, places), default=0) + 1
    felt, trials, place, stimulus = (np.zeros((len(conditions), rows)) for _ in range(4))
    for number, (each, its_places) in enumerate(zip(conditions, places, strict=True)):
        count = len(its_places)
        felt[number, :count], trials[number, :count] = each.felt, each.n
        place[number, :count], stimulus[number, :count] = (its_places - middle) / reach, 1
        if isinstance(model.guess, str):
            felt[number, -1], trials[number, -1] = each.catch_felt, each.catch_n
    return Problem(
        model=model,
        axis=axis,
        conditions=tuple(conditions),
        middle=middle,
        reach=reach,
        likelihood=Likelihood(model.core, place, trials, stimulus, model.guess, model.lapse),
        felt=felt,
    )
