"""The likelihood of answers under psychometric functions, climbed for many data sets or hypotheses at once.

p = guess + (1 - guess - lapse) F(intercept + steepness place). Conditions touch each other by the rates they
share alone, so that steps are solved condition by condition, and time grows with their number. Steps are
Newton's, damped (Levenberg and Marquardt), within bounds; each condition is damped by itself and rates have a
step of their own where the common one fails, since a function that is nearly a step must not hold the rest.
Arrays have a first axis of problems that are solved side by side: starts, points of a profile, or resamples;
this is what makes profiles and bootstraps fast.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import Array, Core

Rate = float | Literal["shared", "free"]
"""A guess or lapse rate: fixed at a value, one for all conditions of a participant, or one for each."""

PRECISE, QUICK = 1e-10, 1e-6
"""Gains of log likelihood: a step that gains less is the last one."""

LEAST = 1e-300
"""Probabilities below have the logarithm of this one."""

_MOST_STEPS = 150
_NO_INFORMATION = 1e-25
_LEAST_DAMPING, _FIRST_DAMPING = 1e-10, 1e-3
_TIMID = 1.0  # damping above which a small gain does not mean that the top is near
_LEAST_DIVISOR = 1e-60  # so that products of squares are numbers
_AT_REST = 1e-3  # log likelihood that another step would gain


@dataclass(frozen=True, eq=False)
class Restriction:
    """Functions (intercept, steepness) = offset + transform @ parameters.

    Attributes
    ----------
    offset
        Shape (problems, conditions, 2).
    transform
        Shape (problems, conditions, 2, 2).
    """

    offset: Array
    transform: Array

    def of(self, problems: NDArray[np.intp]) -> "Restriction":
        """Return that of some of the problems."""
        return Restriction(self.offset[problems], self.transform[problems])


@dataclass(frozen=True, eq=False)
class Tops:
    """Where climbs ended; first axis: problems.

    Attributes
    ----------
    parameters, values
        Parameters, (problems, size), and log likelihoods, (problems,). Where answers are separated the
        steepness has no largest likelihood: it is then that at which the likelihood ceased to grow.
    """

    parameters: Array
    values: Array

    def of(self, problems: NDArray[np.intp]) -> "Tops":
        """Return those of some of the problems."""
        return Tops(self.parameters[problems], self.values[problems])


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Log likelihoods (problems, conditions), and derivatives by intercept, steepness, guess and lapse."""

    values: Array
    gradient: Array
    curvature: Array
    scale: Array

    def put(self, problems: NDArray[np.intp], new: "_Slopes") -> None:
        """Replace those of some problems."""
        self.values[problems], self.gradient[problems] = new.values, new.gradient
        self.curvature[problems], self.scale[problems] = new.curvature, new.scale

    def of(self, problems: NDArray[np.bool_] | NDArray[np.intp]) -> "_Slopes":
        """Return those of some of the problems."""
        return _Slopes(
            self.values[problems], self.gradient[problems], self.curvature[problems], self.scale[problems]
        )


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Conditions with their levels, padded to the same number with levels without trials.

    The parameters are intercept and steepness of each condition, guess rates, and lapse rates.

    Attributes
    ----------
    core
        F.
    place
        Scaled abscissa, shape (conditions, rows).
    trials
        Trials, shape (conditions, rows).
    stimulus
        1; 0 in rows without a stimulus, where F is 0. Shape (conditions, rows).
    guess, lapse
        How the rates are found.
    """

    core: Core
    place: Array
    trials: Array
    stimulus: Array
    guess: Rate
    lapse: Rate

    @cached_property
    def rate_counts(self) -> tuple[int, int]:
        """Numbers of estimated guess and lapse rates."""
        guesses, lapses = (
            {"shared": 1, "free": len(self.place)}[rate] if isinstance(rate, str) else 0
            for rate in (self.guess, self.lapse)
        )
        return guesses, lapses

    @cached_property
    def size(self) -> int:
        """Number of parameters."""
        return 2 * len(self.place) + sum(self.rate_counts)

    @cached_property
    def layout(self) -> "_Layout":
        """Which parameters belong to one condition, and which to all."""
        return _layout(len(self.place), self.guess, self.lapse)

    @cached_property
    def _powers(self) -> Array:
        """Ones, places and their squares, shape (conditions, rows, 3)."""
        return np.stack([np.ones(self.place.shape), self.place, self.place**2], axis=2)

    def rates(self, parameters: Array) -> tuple[Array, Array]:
        """Return guess and lapse rates, each (problems, conditions), of parameters (problems, size)."""
        conditions, (guesses, lapses) = len(self.place), self.rate_counts
        of_guess = parameters[:, 2 * conditions : 2 * conditions + guesses]
        of_lapse = parameters[:, 2 * conditions + guesses :]
        shape = (len(parameters), conditions)
        return (
            np.broadcast_to(of_guess if guesses else np.array(self.guess, float), shape),
            np.broadcast_to(of_lapse if lapses else np.array(self.lapse, float), shape),
        )

    def probabilities(self, parameters: Array) -> tuple[Array, Array]:
        """Return p and 1 - p of all rows, each (problems, conditions, rows)."""
        below, above = self._distribution(self._predictor(_functions(parameters, len(self.place), None)))
        guess, lapse = (each[..., None] for each in self.rates(parameters))
        span = 1 - guess - lapse
        return np.maximum(guess + span * below, LEAST), np.maximum(lapse + span * above, LEAST)

    def values(self, felt: Array, parameters: Array) -> Array:
        """Return log likelihoods of rows, (problems, conditions, rows)."""
        p, not_p = self.probabilities(parameters)
        found: Array = felt * np.log(p) + (self.trials - felt) * np.log(not_p)
        return found

    def climb(
        self,
        felt: Array,
        start: Array,
        bounds: tuple[Array, Array],
        gain: float = PRECISE,
        restriction: Restriction | None = None,
    ) -> Tops:
        """Maximise.

        Parameters
        ----------
        felt
            Shape (problems, conditions, rows).
        start
            Parameters to begin with, shape (problems, size).
        bounds
            Lowest and highest parameters, each (problems, size).
        gain
            `PRECISE`, or `QUICK` where the value matters more than the place of the top.
        restriction
            What the functions of the problems are restricted to.
        """
        return _Climb(self, felt, start, bounds, restriction).run(gain)

    def at_rest(self, felt: Array, parameters: Array, bounds: tuple[Array, Array]) -> NDArray[np.bool_]:
        """Return whether another step from parameters would gain nothing that matters, (problems,)."""
        return _Climb(self, felt, parameters, bounds, None).promise() < _AT_REST

    def _predictor(self, functions: Array) -> Array:
        return functions[..., :1] + functions[..., 1:] * self.place

    def _distribution(self, predictor: Array) -> tuple[Array, Array]:
        below, above = self.core.distribution(predictor)
        return below * self.stimulus, np.where(self.stimulus > 0, above, 1.0)

    def slopes(self, felt: Array, parameters: Array, restriction: Restriction | None) -> _Slopes:
        """Return log likelihoods and their derivatives.

        The curvature is the observed one where a condition's functions have a top nearby, else the expected
        one, which always shows uphill; the scale is the diagonal of the expected one.
        """
        predictor = self._predictor(_functions(parameters, len(self.place), restriction))
        below, above, density, bend = self.core.derivatives(predictor)
        below, density, bend = below * self.stimulus, density * self.stimulus, bend * self.stimulus
        above = np.where(self.stimulus > 0, above, 1.0)
        guess, lapse = (each[..., None] for each in self.rates(parameters))
        span = 1 - guess - lapse
        p, not_p = np.maximum(guess + span * below, LEAST), np.maximum(lapse + span * above, LEAST)
        misses = self.trials - felt
        values = (felt * np.log(p) + misses * np.log(not_p)).sum(axis=2)
        p, not_p = np.maximum(p, _LEAST_DIVISOR), np.maximum(not_p, _LEAST_DIVISOR)
        hits, fails = felt / p, misses / not_p
        steep, seen, expected = hits - fails, hits / p + fails / not_p, self.trials / p / not_p
        rise = span * density
        by_predictor = steep * rise
        squared = rise * rise
        rising = self._moments(seen * squared - steep * span * bend, 3)
        expected_rising = self._moments(expected * squared, 3)
        top = (rising[..., 0] > 0) & (rising[..., 0] * rising[..., 2] > (1 + 1e-9) * rising[..., 1] ** 2)
        count = 4 if sum(self.rate_counts) else 2
        gradient = np.empty((*values.shape, count))
        scale = np.empty((*values.shape, count))
        curvature = np.empty((*values.shape, count, count))
        gradient[..., :2] = self._moments(by_predictor, 2)
        scale[..., :2] = expected_rising[..., ::2]
        rising = np.where(top[..., None], rising, expected_rising)
        curvature[..., :2, :2] = rising[..., [[0, 1], [1, 2]]]
        if count == 4:
            weight = np.where(top[..., None], seen, expected)
            turned = np.where(top[..., None], steep, 0.0) * density
            across = weight * rise
            gradient[..., 2] = (steep * above).sum(axis=2)
            gradient[..., 3] = -(steep * below).sum(axis=2)
            curvature[..., :2, 2] = curvature[..., 2, :2] = self._moments(across * above + turned, 2)
            curvature[..., :2, 3] = curvature[..., 3, :2] = self._moments(turned - across * below, 2)
            curvature[..., 2, 2] = (weight * above**2).sum(axis=2)
            curvature[..., 3, 3] = (weight * below**2).sum(axis=2)
            curvature[..., 2, 3] = curvature[..., 3, 2] = -(weight * above * below).sum(axis=2)
            scale[..., 2] = (expected * above**2).sum(axis=2)
            scale[..., 3] = (expected * below**2).sum(axis=2)
        if restriction is None:
            return _Slopes(values, gradient, curvature, scale)
        return _restricted(_Slopes(values, gradient, curvature, scale), expected_rising, restriction)

    def _moments(self, rows: Array, count: int) -> Array:
        """Return the sums of rows, rows times places, and rows times squared places."""
        found: Array = np.einsum("bcr,crk->bck", rows, self._powers[..., :count])
        return found


def _functions(parameters: Array, conditions: int, restriction: Restriction | None) -> Array:
    """Return intercepts and steepnesses, (problems, conditions, 2)."""
    found = parameters[:, : 2 * conditions].reshape(-1, conditions, 2)
    if restriction is None:
        return found
    moved: Array = restriction.offset + (restriction.transform @ found[..., None])[..., 0]
    return moved


def _restricted(slopes: _Slopes, expected: Array, restriction: Restriction) -> _Slopes:
    """Return derivatives by the parameters of restricted functions."""
    turned = restriction.transform.transpose(0, 1, 3, 2)
    slopes.gradient[..., :2] = (turned @ slopes.gradient[..., :2, None])[..., 0]
    slopes.curvature[..., :2, :] = turned @ slopes.curvature[..., :2, :]
    slopes.curvature[..., :, :2] = slopes.curvature[..., :, :2] @ restriction.transform
    whole = turned @ expected[..., [[0, 1], [1, 2]]] @ restriction.transform
    slopes.scale[..., :2] = np.diagonal(whole, axis1=2, axis2=3)
    return slopes


@dataclass(frozen=True, eq=False)
class _Layout:
    """Which parameters belong to one condition, and which to all.

    Attributes
    ----------
    own, common
        Which of intercept, steepness, guess and lapse rate.
    own_at
        Where they are in the vector of parameters, (conditions, own).
    common_at
        Where those are, (common,).
    """

    own: list[int]
    common: list[int]
    own_at: NDArray[np.intp]
    common_at: NDArray[np.intp]

    def solve(self, at: _Slopes, gradient: Array, held: NDArray[np.bool_], damping: Array) -> Array:
        """Return damped Newton steps, (problems, size), by elimination of each condition's own parameters.

        Parameters
        ----------
        at, gradient
            Derivatives by condition, and by the vector of parameters.
        held
            Which parameters do not move, (problems, size).
        damping
            Of each condition and, last, of the common rates, as shares of the scale.
        """
        own, common, free = self.own, self.common, ~held
        free_own, free_common = free[:, self.own_at], free[:, self.common_at]
        block = at.curvature[:, :, own][..., own] * (free_own[..., :, None] & free_own[..., None, :])
        block += _diagonal(damping[:, :-1, None] * at.scale[..., own] * free_own + ~free_own)
        right = (gradient[:, self.own_at] * free_own)[..., None]
        found = np.zeros(gradient.shape)
        if not common:
            found[:, self.own_at] = _solved(block, right)[..., 0]
            return found
        crossed = at.curvature[:, :, own][..., common] * (
            free_own[..., :, None] & free_common[:, None, None, :]
        )
        solved = _solved(block, np.concatenate([right, crossed], axis=3))
        corner = at.curvature[:, :, common][..., common].sum(axis=1)
        corner *= free_common[:, :, None] & free_common[:, None, :]
        corner += _diagonal(damping[:, -1:] * at.scale[..., common].sum(axis=1) * free_common + ~free_common)
        turned = crossed.transpose(0, 1, 3, 2)
        corner -= (turned @ solved[..., 1:]).sum(axis=1)
        left = (gradient[:, self.common_at] * free_common)[..., None] - (turned @ solved[..., :1]).sum(axis=1)
        of_common = _solved(corner, left)
        found[:, self.common_at] = of_common[..., 0]
        found[:, self.own_at] = (solved[..., :1] - solved[..., 1:] @ of_common[:, None])[..., 0]
        return found


def _diagonal(values: Array) -> Array:
    """Return matrices with values on their diagonals."""
    found: Array = values[..., None] * np.eye(values.shape[-1])
    return found


def _solved(matrices: Array, right: Array) -> Array:
    """Solve systems of equations; where they have no solution, steps are none."""
    if matrices.shape[-1] == 1:
        pivot = matrices
        found: Array = np.where(pivot == 0, 0.0, right / np.where(pivot == 0, 1.0, pivot))
        return found
    if matrices.shape[-1] == 2:
        a, b, c, d = (matrices[..., row, column, None] for row in range(2) for column in range(2))
        determinant = a * d - b * c
        none = determinant == 0
        inverse = np.where(none, 0.0, 1 / np.where(none, 1.0, determinant))
        first, second = right[..., 0, :], right[..., 1, :]
        return np.stack([(d * first - b * second) * inverse, (a * second - c * first) * inverse], axis=-2)
    try:
        return np.asarray(np.linalg.solve(matrices, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(matrices) @ right)


def _layout(conditions: int, guess: Rate, lapse: Rate) -> _Layout:
    number, start = np.arange(conditions), 2 * conditions
    own, own_at = [0, 1], [2 * number, 2 * number + 1]
    common, common_at = [], []
    for which, rate in ((2, guess), (3, lapse)):
        if rate == "free" and conditions > 1:
            own.append(which)
            own_at.append(start + number)
            start += conditions
        elif isinstance(rate, str):
            common.append(which)
            common_at.append(start)
            start += 1
    return _Layout(own, common, np.stack(own_at, axis=1), np.array(common_at, dtype=np.intp))


class _Climb:
    """Problems that are climbed side by side; those that have arrived are let go."""

    def __init__(
        self,
        model: Likelihood,
        felt: Array,
        start: Array,
        bounds: tuple[Array, Array],
        restriction: Restriction | None,
    ) -> None:
        self.model, self.felt, self.restriction = model, felt, restriction
        self.low, self.high = bounds
        self.at = np.clip(start, *bounds)
        self.now = model.slopes(felt, self.at, restriction)
        self.damping = np.full((len(start), len(model.place) + 1), _FIRST_DAMPING)
        self.number = np.arange(len(start))

    def run(self, gain: float) -> Tops:
        """Climb until steps gain less."""
        found = Tops(np.empty(self.at.shape), np.empty(len(self.at)))
        for _ in range(_MOST_STEPS):
            timid = self.damping.max(axis=1) > _TIMID
            better, gained, promised = self._step()
            by_rates = self._step_of_rates(~better)
            going = np.where(better, timid | (gained > gain), (promised > gain) | (by_rates > gain))
            if not going.all():
                self._let_go(going, found)
            if len(self.number) == 0:
                return found
        self._let_go(np.zeros(len(self.number), bool), found)
        return found

    def _step(self) -> tuple[NDArray[np.bool_], Array, Array]:
        """Move all parameters where that is better; return where it was, and what was gained and promised."""
        every = np.arange(len(self.number))
        tried, promised = self._tried(every, self.damping, rates_only=False)
        new = self.model.slopes(self.felt, tried, self.restriction)
        gained = (new.values - self.now.values).sum(axis=1)
        better = (gained >= 0) & (promised >= 0)
        # a condition that lost is damped more; the rates, which all share, a little
        to_blame = np.column_stack([new.values < self.now.values, np.zeros(len(better), bool)])
        bolder = np.maximum(self.damping / 5, _LEAST_DAMPING)
        self.damping = np.where(better[:, None], bolder, self.damping * np.where(to_blame, 8.0, 2.0))
        if better.all():
            self.at, self.now = tried, new
        else:
            which = np.flatnonzero(better)
            self.at[which] = tried[which]
            self.now.put(which, new.of(which))
        return better, gained, np.abs(promised)

    def _step_of_rates(self, failed: NDArray[np.bool_]) -> Array:
        """Move the rates alone in some problems, where that is better; return what was gained.

        Given the functions the likelihood is concave in the rates.
        """
        gained = np.zeros(len(failed))
        which = np.flatnonzero(failed)
        if not sum(self.model.rate_counts) or len(which) == 0:
            return gained
        damping = np.full((len(which), self.damping.shape[1]), _LEAST_DAMPING)
        tried, _ = self._tried(which, damping, rates_only=True)
        restriction = self.restriction and self.restriction.of(which)
        new = self.model.slopes(self.felt[which], tried, restriction)
        change = new.values.sum(axis=1) - self.now.values[which].sum(axis=1)
        better = change > 0
        kept = which[better]
        gained[kept], self.at[kept] = change[better], tried[better]
        self.now.put(kept, new.of(better))
        return gained

    def _tried(self, which: NDArray[np.intp], damping: Array, *, rates_only: bool) -> tuple[Array, Array]:
        """Return where damped steps lead within the bounds, and the gain that the slope there promises."""
        now = self.now if len(which) == len(self.number) else self.now.of(which)
        at, low, high = self.at[which], self.low[which], self.high[which]
        gradient = self._flat(now.gradient)
        held = (self._flat(now.scale) < _NO_INFORMATION) | (low == high)
        held |= ((at <= low) & (gradient <= 0)) | ((at >= high) & (gradient >= 0))
        if rates_only:
            held[:, : 2 * len(self.model.place)] = True
        tried = np.clip(at + self.model.layout.solve(now, gradient, held, damping), low, high)
        return tried, (gradient * (tried - at)).sum(axis=1)

    def _flat(self, of_conditions: Array) -> Array:
        """Return derivatives by the vector of parameters, (problems, size)."""
        layout = self.model.layout
        found = np.empty((len(of_conditions), self.model.size))
        found[:, layout.own_at] = of_conditions[..., layout.own]
        found[:, layout.common_at] = of_conditions[..., layout.common].sum(axis=1)
        return found

    def _let_go(self, going: NDArray[np.bool_], found: Tops) -> None:
        """Take down where problems have arrived, and keep the others."""
        done = self.number[~going]
        found.parameters[done] = self.at[~going]
        found.values[done] = self.now.values[~going].sum(axis=1)
        self.number, self.at, self.damping = self.number[going], self.at[going], self.damping[going]
        self.felt, self.low, self.high = self.felt[going], self.low[going], self.high[going]
        self.now = self.now.of(going)
        self.restriction = self.restriction and self.restriction.of(np.flatnonzero(going))

    def promise(self) -> Array:
        """Return what hardly damped steps would gain, if the likelihood were a parabola, in each problem.

        Along a function that is as good as a step curvatures are nothing but rounding errors, so that steps
        count up to the size of the parameters alone.
        """
        tried, _ = self._tried(np.arange(len(self.number)), self.damping, rates_only=False)
        far = 1 + np.abs(self.at)
        step = np.clip(tried - self.at, -far, far)
        found: Array = np.abs(self._flat(self.now.gradient) * step).sum(axis=1) / 2
        return found
