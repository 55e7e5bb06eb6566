"""The likelihood of answers under psychometric functions, climbed for many data sets or hypotheses at once.

p = guess + (1 - guess - lapse) F(offset + design b). Steps are Fisher's scoring, damped (Levenberg) where
they go too far, within bounds. All arrays have a first axis of problems that are solved side by side: starts,
points of a profile, or resamples; this is what makes profiles and bootstraps fast.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.psychometric.functions import Array, Core

PRECISE, QUICK = 1e-10, 1e-6
"""Gains of log likelihood: a step that gains less is the last one."""

LEAST = 1e-300
"""Probabilities below have the logarithm of this one."""

_MOST_STEPS = 100
_NO_INFORMATION = 1e-25
_LEAST_DAMPING = 1e-10
_TIMID = 1.0  # damping above which a small gain does not mean that the top is near


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Rows of answers, and which guess and lapse rate each row has.

    Attributes
    ----------
    core
        F.
    trials
        Trials of each row, shape (rows,).
    stimulus
        Whether a row has a stimulus; without, F is 0. Shape (rows,).
    guess_of, lapse_of
        Which estimated rates a row has: ones and zeros, shape (rows, rates); no columns if fixed.
    fixed_guess, fixed_lapse
        What is added to the estimated rates.
    """

    core: Core
    trials: Array
    stimulus: Array
    guess_of: Array
    lapse_of: Array
    fixed_guess: float
    fixed_lapse: float

    @property
    def rate_counts(self) -> tuple[int, int]:
        """Numbers of estimated guess and lapse rates, which are the last parameters in this order."""
        return int(self.guess_of.shape[1]), int(self.lapse_of.shape[1])

    def probability(self, predictor: Array, rates: Array) -> tuple[Array, Array]:
        """Return p and 1 - p of predictors (problems, rows) and rates (problems, rates)."""
        below, above = self._distribution(predictor)
        guess, lapse = self.rates_of_rows(rates)
        span = 1 - guess - lapse
        return np.maximum(guess + span * below, LEAST), np.maximum(lapse + span * above, LEAST)

    def rates_of_rows(self, rates: Array) -> tuple[Array, Array]:
        """Return guess and lapse rates, (problems, rows), of estimated rates (problems, rates)."""
        guesses = self.guess_of.shape[1]
        return (
            self.fixed_guess + rates[:, :guesses] @ self.guess_of.T,
            self.fixed_lapse + rates[:, guesses:] @ self.lapse_of.T,
        )

    def climb(
        self,
        felt: Array,
        design: Array,
        offset: Array,
        start: Array,
        bounds: tuple[Array, Array],
        gain: float = PRECISE,
    ) -> tuple[Array, Array]:
        """Maximise.

        Parameters
        ----------
        felt
            Shape (problems, rows).
        design, offset
            Of the predictor, shapes (problems, rows, q) and (problems, rows).
        start
            Parameters to begin with, shape (problems, q + rates).
        bounds
            Lowest and highest parameters, each (problems, q + rates).
        gain
            `PRECISE`, or `QUICK` where the value matters more than the place of the top.

        Returns
        -------
        parameters, log likelihoods
            Shapes (problems, q + rates) and (problems,). Where answers are separated the steepness has no
            largest likelihood: it is then that at which the likelihood ceased to grow.
        """
        parameters = np.clip(start, *bounds)
        value, gradient, information = self._derivatives(felt, design, offset, parameters)
        best = value.copy()
        active, damping = np.arange(len(start)), np.full(len(start), 1e-3)
        at = parameters.copy()
        for _ in range(_MOST_STEPS):
            low, high = bounds[0][active], bounds[1][active]
            tried = np.clip(at + _step(at, gradient, information, damping, low, high), low, high)
            promised = (gradient * (tried - at)).sum(axis=1)
            new = self._derivatives(felt[active], design[active], offset[active], tried)
            better = new[0] >= value
            gained = new[0] - value
            at = np.where(better[:, None], tried, at)
            value = np.where(better, new[0], value)
            gradient = np.where(better[:, None], new[1], gradient)
            information = np.where(better[:, None, None], new[2], information)
            damping = np.where(better, np.maximum(damping / 5, _LEAST_DAMPING), damping * 8)
            parameters[active], best[active] = at, value
            going = np.where(better, (gained > gain) | (damping > _TIMID), promised > gain)
            if not going.any():
                break
            active, at, value, damping = active[going], at[going], value[going], damping[going]
            gradient, information = gradient[going], information[going]
        return parameters, best

    def _distribution(self, predictor: Array) -> tuple[Array, Array]:
        below, above = self.core.distribution(predictor)
        return below * self.stimulus, np.where(self.stimulus > 0, above, 1.0)

    def _derivatives(
        self, felt: Array, design: Array, offset: Array, parameters: Array
    ) -> tuple[Array, Array, Array]:
        """Return log likelihood, its gradient, and the expected information."""
        q = design.shape[2]
        predictor = offset + (design @ parameters[:, :q, None])[..., 0]
        rates = parameters[:, q:]
        below, above = self._distribution(predictor)
        p, not_p = self.probability(predictor, rates)
        guess, lapse = self.rates_of_rows(rates)
        density = (1 - guess - lapse) * self.core.density(predictor) * self.stimulus
        columns = np.concatenate(
            [
                density[..., None] * design,
                above[..., None] * self.guess_of,
                -below[..., None] * self.lapse_of,
            ],
            axis=2,
        )
        misses = self.trials - felt
        value = (felt * np.log(p) + misses * np.log(not_p)).sum(axis=1)
        gradient = ((felt / p - misses / not_p)[:, None] @ columns)[:, 0]
        scaled = columns * np.sqrt(self.trials / p / not_p)[..., None]
        return value, gradient, scaled.transpose(0, 2, 1) @ scaled


def _step(at: Array, gradient: Array, information: Array, damping: Array, low: Array, high: Array) -> Array:
    """Return damped steps; parameters that a bound holds, or of which answers tell nothing, do not move."""
    diagonal = np.minimum(np.einsum("bii->bi", information), 1e200)
    held: NDArray[np.bool_] = ((at <= low) & (gradient < 0)) | ((at >= high) & (gradient > 0))
    held |= diagonal < _NO_INFORMATION
    free = ~held
    size = at.shape[1]
    matrix = information * free[:, :, None] * free[:, None, :]
    matrix = matrix + np.eye(size) * (damping[:, None] * diagonal + held)[:, None, :]
    found: Array = np.linalg.solve(matrix, (gradient * free)[..., None])[..., 0]
    return found
