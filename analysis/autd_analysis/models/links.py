"""Links between a linear predictor and the probability of "felt": logit and probit."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Link(Protocol):
    """A link of the linear predictor to the probability.

    Where the binomial log likelihood is concave in the predictor, its curvature serves to search by, too.
    """

    def probability(self, predictor: Array) -> Array:
        """Return the probability of "felt"."""

    def predictor(self, probability: Array) -> Array:
        """Return the inverse of `probability`."""

    def log_likelihood(self, felt: Array, trials: Array, predictor: Array) -> Array:
        """Return the log likelihood of each row without the binomial coefficients."""

    def derivatives(self, felt: Array, trials: Array, predictor: Array) -> tuple[Array, Array]:
        """Return its first derivative by the predictor, and the negative second."""

    def scoring(self, felt: Array, trials: Array, predictor: Array) -> tuple[Array, Array]:
        """Return its first derivative, and a curvature that is never negative, to search by."""


class Logit:
    """The canonical link: log odds."""

    def probability(self, predictor: Array) -> Array:
        """Return the probability of "felt"."""
        from scipy.special import expit

        found: Array = expit(predictor)
        return found

    def predictor(self, probability: Array) -> Array:
        """Return log odds."""
        found: Array = np.log(probability / (1 - probability))
        return found

    def log_likelihood(self, felt: Array, trials: Array, predictor: Array) -> Array:
        """Return the log likelihood of each row."""
        found: Array = felt * predictor - trials * np.logaddexp(0, predictor)
        return found

    def derivatives(self, felt: Array, trials: Array, predictor: Array) -> tuple[Array, Array]:
        """Return its first derivative and the negative second."""
        expected = self.probability(predictor)
        return felt - trials * expected, trials * expected * (1 - expected)

    scoring = derivatives


class Probit:
    """The inverse of the normal distribution: the predictor is in units of the noise's standard deviation."""

    def probability(self, predictor: Array) -> Array:
        """Return the probability of "felt"."""
        from scipy.special import ndtr

        found: Array = ndtr(predictor)
        return found

    def predictor(self, probability: Array) -> Array:
        """Return normal quantiles."""
        from scipy.special import ndtri

        found: Array = ndtri(probability)
        return found

    def log_likelihood(self, felt: Array, trials: Array, predictor: Array) -> Array:
        """Return the log likelihood of each row."""
        from scipy.special import log_ndtr

        found: Array = felt * log_ndtr(predictor) + (trials - felt) * log_ndtr(-predictor)
        return found

    def derivatives(self, felt: Array, trials: Array, predictor: Array) -> tuple[Array, Array]:
        """Return its first derivative and the negative second, by the inverse Mills ratio of both tails."""
        upper, lower = _mills(predictor), _mills(-predictor)
        first = felt * upper - (trials - felt) * lower
        second = felt * upper * (upper + predictor) + (trials - felt) * lower * (lower - predictor)
        return first, second

    scoring = derivatives


LOGIT, PROBIT = Logit(), Probit()


def _mills(x: Array) -> Array:
    """Return density over distribution, also far in the tail."""
    from scipy.special import log_ndtr

    found: Array = np.exp(-0.5 * x**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(x))
    return found
