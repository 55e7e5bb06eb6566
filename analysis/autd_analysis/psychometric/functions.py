"""Psychometric functions: p = guess + (1 - guess - lapse) F.

F rises from 0 to 1 along the abscissa t, which is log2 of the stimulus (octaves) or the stimulus itself. The
conventions are the same for all cores: the threshold is where F is 0.5, so that p is halfway between guess
and 1 - lapse, and the slope is dF/dt there, per octave or per unit. Every core is a distribution of a linear
predictor a + b t, so that without guesses and lapses it is a generalised linear model: logit, probit, and
complementary log-log, which is Weibull's function where t is a logarithm. F. A. Wichmann and N. J. Hill
(2001), Percept. Psychophys. 63, 1293-1313.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FARTHEST = 600.0  # predictors beyond are 0 or 1 in any case


class Core(Protocol):
    """A distribution of the predictor."""

    @property
    def name(self) -> str:
        """What it is called."""

    def distribution(self, predictor: Array) -> tuple[Array, Array]:
        """Return F and 1 - F, both precise in their tails."""

    def density(self, predictor: Array) -> Array:
        """Return the derivative of F by the predictor."""

    def derivatives(self, predictor: Array) -> tuple[Array, Array, Array, Array]:
        """Return F, 1 - F, and the first and second derivative of F by the predictor."""

    def quantile(self, probability: Array) -> Array:
        """Return the predictor at which F has this value."""


class Logistic:
    """F = 1 / (1 + exp(-predictor))."""

    name = "logistic"

    def distribution(self, predictor: Array) -> tuple[Array, Array]:
        """Return F and 1 - F."""
        from scipy.special import expit

        return expit(predictor), expit(-predictor)

    def density(self, predictor: Array) -> Array:
        """Return the derivative of F."""
        below, above = self.distribution(predictor)
        return below * above

    def derivatives(self, predictor: Array) -> tuple[Array, Array, Array, Array]:
        """Return F, 1 - F and the derivatives of F."""
        below, above = self.distribution(predictor)
        density = below * above
        return below, above, density, density * (above - below)

    def quantile(self, probability: Array) -> Array:
        """Return log odds."""
        found: Array = np.log(probability) - np.log1p(-probability)
        return found


class Normal:
    """F is the normal distribution."""

    name = "normal"

    def distribution(self, predictor: Array) -> tuple[Array, Array]:
        """Return F and 1 - F."""
        from scipy.special import ndtr

        return ndtr(predictor), ndtr(-predictor)

    def density(self, predictor: Array) -> Array:
        """Return the derivative of F."""
        near = np.clip(predictor, -38, 38)
        found: Array = np.exp(-0.5 * near**2) / math.sqrt(2 * math.pi)
        return found

    def derivatives(self, predictor: Array) -> tuple[Array, Array, Array, Array]:
        """Return F, 1 - F and the derivatives of F."""
        density = self.density(predictor)
        return *self.distribution(predictor), density, -np.clip(predictor, -38, 38) * density

    def quantile(self, probability: Array) -> Array:
        """Return normal quantiles."""
        from scipy.special import ndtri

        found: Array = ndtri(probability)
        return found


class Weibull:
    """F = 1 - exp(-exp(predictor)); along a linear abscissa it is Gumbel's distribution of minima."""

    name = "Weibull"

    def distribution(self, predictor: Array) -> tuple[Array, Array]:
        """Return F and 1 - F."""
        grown = np.exp(np.clip(predictor, -_FARTHEST, _FARTHEST))
        return -np.expm1(-grown), np.exp(-grown)

    def density(self, predictor: Array) -> Array:
        """Return the derivative of F."""
        near = np.clip(predictor, -_FARTHEST, _FARTHEST)
        found: Array = np.exp(near - np.exp(near))
        return found

    def derivatives(self, predictor: Array) -> tuple[Array, Array, Array, Array]:
        """Return F, 1 - F and the derivatives of F."""
        grown = np.exp(np.clip(predictor, -_FARTHEST, _FARTHEST))
        above = np.exp(-grown)
        density = grown * above
        return -np.expm1(-grown), above, density, density * (1 - grown)

    def quantile(self, probability: Array) -> Array:
        """Return the complementary log-log."""
        found: Array = np.log(-np.log1p(-probability))
        return found


LOGISTIC, NORMAL, WEIBULL = Logistic(), Normal(), Weibull()


def predictor_at_threshold(core: Core) -> float:
    """Return the predictor at which F is 0.5."""
    return float(core.quantile(np.array(0.5)))


def slope_per_steepness(core: Core) -> float:
    """Return dF/dt at the threshold of a function whose predictor grows by 1 per unit of t."""
    return float(core.density(np.array(predictor_at_threshold(core))))


@dataclass(frozen=True)
class Axis:
    """The abscissa: octaves (log2 of the stimulus), or the stimulus itself.

    Attributes
    ----------
    logarithmic
        Whether it is in octaves.
    """

    logarithmic: bool

    @property
    def unit(self) -> str:
        """What slopes are per."""
        return "octave" if self.logarithmic else "unit"

    def place(self, x: Array) -> Array:
        """Return t of stimuli."""
        return np.log2(x) if self.logarithmic else np.asarray(x, float)

    def stimulus(self, place: float) -> float:
        """Return the stimulus at t; infinite where it is too large to be written."""
        if not self.logarithmic:
            return place
        return 2.0**place if place < 1000 else math.inf


def psychometric_function(
    core: Core,
    axis: Axis,
    x: Array,
    *,
    threshold: float,
    slope: float,
    guess: float = 0.0,
    lapse: float = 0.0,
) -> Array:
    """Return the probability of "felt".

    Parameters
    ----------
    core, axis
        The function's form.
    x
        Stimuli.
    threshold
        Stimulus at which F is 0.5.
    slope
        dF/dt at the threshold, per octave or per unit; over 0.
    guess, lapse
        Probability of "felt" far below the threshold, and of "not felt" far above it.
    """
    distance = axis.place(x) - axis.place(np.array(threshold))
    predictor = predictor_at_threshold(core) + slope / slope_per_steepness(core) * distance
    found: Array = guess + (1 - guess - lapse) * core.distribution(predictor)[0]
    return found
