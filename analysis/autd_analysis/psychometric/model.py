"""What is fitted: the answers of one participant in one or more conditions, and the model's choices."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import NORMAL, Array, Axis, Core
from autd_analysis.psychometric.likelihood import Likelihood

Rate = float | Literal["shared", "free"]
"""A guess or lapse rate: fixed at a value, one for all conditions of a participant, or one for each."""

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
        The same of trials without a stimulus; they tell about the guess rate alone.
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

    Rows are the levels of all conditions and then one row per condition for its catch trials. Parameters are
    intercept and steepness of each condition (of t about its middle), guess rates, and lapse rates.

    Attributes
    ----------
    model, axis, conditions
        What is fitted.
    middle, reach
        The abscissa is scaled to (t - middle) / reach, which is -1 to 1 for the levels of all conditions.
    likelihood
        Of the rows.
    felt
        Shape (rows,).
    place
        Scaled abscissa; 0 for catch trials. Shape (rows,).
    condition
        Of each row, shape (rows,).
    """

    model: Model
    axis: Axis
    conditions: tuple[Answers, ...]
    middle: float
    reach: float
    likelihood: Likelihood
    felt: Array
    place: Array
    condition: Array

    @property
    def size(self) -> int:
        """Number of parameters."""
        return 2 * len(self.conditions) + sum(self.likelihood.rate_counts)

    def design(self) -> Array:
        """Return the predictor's design, shape (rows, 2 conditions): ones and places of each condition."""
        found = np.zeros((len(self.felt), 2 * len(self.conditions)))
        for number in range(len(self.conditions)):
            mine = self.stimuli(number)
            found[mine, 2 * number] = 1
            found[mine, 2 * number + 1] = self.place[mine]
        return found

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
        found: Array = (self.axis.place(self.conditions[number].x) - self.middle) / self.reach
        return found

    def stimuli(self, number: int) -> NDArray[np.bool_]:
        """Return which rows are a condition's stimuli."""
        found: NDArray[np.bool_] = (self.condition == number) & (self.likelihood.stimulus > 0)
        return found

    def rates(self, number: int, parameters: Array) -> tuple[Array, Array]:
        """Return guess and lapse rates of a condition, (problems,), of parameters (problems, size)."""
        row = int(np.flatnonzero(self.condition == number)[0])
        guess, lapse = self.likelihood.rates_of_rows(parameters[:, 2 * len(self.conditions) :])
        return guess[:, row], lapse[:, row]


def problem(conditions: Sequence[Answers], model: Model, axis: Axis) -> Problem:
    """Put conditions together. Catch trials do not count where the guess rate is fixed."""
    places = [axis.place(each.x) for each in conditions]
    every = np.concatenate([*places, [0.0]])[: max(1, sum(map(len, places)))]
    middle, reach = float((every.max() + every.min()) / 2), float((every.max() - every.min()) / 2) or 1.0
    count = len(conditions)
    number = np.concatenate([np.repeat(np.arange(count), list(map(len, places))), np.arange(count)])
    estimated = float(isinstance(model.guess, str))
    catch_felt, catch_n = (
        estimated * np.array([(each.catch_felt, each.catch_n) for each in conditions]).reshape(-1, 2).T
    )
    return Problem(
        model=model,
        axis=axis,
        conditions=tuple(conditions),
        middle=middle,
        reach=reach,
        likelihood=Likelihood(
            core=model.core,
            trials=np.concatenate([*(each.n for each in conditions), catch_n]),
            stimulus=np.concatenate([np.ones(len(number) - count), np.zeros(count)]),
            guess_of=_rate_columns(model.guess, number, count),
            lapse_of=_rate_columns(model.lapse, number, count),
            fixed_guess=0.0 if isinstance(model.guess, str) else model.guess,
            fixed_lapse=0.0 if isinstance(model.lapse, str) else model.lapse,
        ),
        felt=np.concatenate([*(each.felt for each in conditions), catch_felt]),
        place=np.concatenate([*((each - middle) / reach for each in places), np.zeros(count)]),
        condition=number,
    )


def _rate_columns(rate: Rate, condition: Array, conditions: int) -> Array:
    if rate == "shared":
        return np.ones((len(condition), 1))
    return np.eye(conditions)[condition] if rate == "free" else np.zeros((len(condition), 0))
