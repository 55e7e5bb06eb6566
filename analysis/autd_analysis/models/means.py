"""Probabilities of a condition by a mixed model: of the average participant, and over all people.

The average participant's random effects are zero. The population's probability is the average of all
participants' probabilities, over the normal distribution of random effects; it is nearer to 1/2. Standard
errors of functions of the parameters are by the delta method.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval, wald_interval
from autd_analysis.data.design import Condition
from autd_analysis.models.glmm import BinomialRows, GlmmFit
from autd_analysis.models.links import Link

Array = NDArray[np.float64]

_NORMAL_GRID = np.linspace(-8.0, 8.0, 257)
_NORMAL_WEIGHTS = np.exp(-0.5 * _NORMAL_GRID**2) / np.exp(-0.5 * _NORMAL_GRID**2).sum()
_DIFFERENCE = 1e-5


@dataclass(frozen=True)
class ModelMean:
    """The estimated mean of a condition.

    Attributes
    ----------
    condition
        The factors' levels.
    predictor, standard_error
        In units of the link (logits), of the average participant.
    average, average_interval
        Probability that the average participant feels it; the interval is Wald's in units of the link.
    population, population_interval
        Probability over all people; the interval is Wald's likewise, None where the likelihood is flat.
    """

    condition: Condition
    predictor: float
    standard_error: float
    average: float
    average_interval: Interval
    population: float
    population_interval: Interval | None


def model_mean(fit: GlmmFit, rows: BinomialRows, place: int, cell: Condition, link: Link) -> ModelMean:
    """Return the mean of the condition whose fixed effect is the coefficient at `place`."""
    predictor, variance = float(fit.coefficients[place]), float(fit.covariance[place, place])
    sides = rows.random[rows.fixed[:, place] > 0][0]
    spread = fit.factor.T @ sides
    population = _over_people(predictor, float(np.linalg.norm(spread)), link)
    gradient = _gradient(fit, place, sides, spread, link)
    population_variance = float(gradient @ fit.parameter_covariance @ gradient)
    return ModelMean(
        condition=cell,
        predictor=predictor,
        standard_error=math.sqrt(variance),
        average=_probability(predictor, link),
        average_interval=_back(wald_interval(predictor, math.sqrt(variance)), link),
        population=_probability(population, link),
        population_interval=_back(wald_interval(population, math.sqrt(population_variance)), link)
        if population_variance > 0
        else None,
    )


def _over_people(predictor: float, deviation: float, link: Link) -> float:
    """Return the population's probability in units of the link.

    The sum over an even grid is exact to many digits: the function is analytic and ends at nothing. Both
    links are symmetric; the smaller of the two probabilities has more digits.
    """
    probability = _NORMAL_WEIGHTS @ link.probability(-abs(predictor) + deviation * _NORMAL_GRID)
    lower = float(link.predictor(np.asarray(probability)))
    return lower if predictor < 0 else -lower


def _gradient(fit: GlmmFit, place: int, sides: Array, spread: Array, link: Link) -> Array:
    """Return the derivatives of the population's predictor by all parameters.

    The standard deviation of a condition's random part is the length of L'z: its derivative by an entry of L
    is z_i (L'z)_j over it. At length zero the population's predictor does not depend on it in first order.
    """
    predictor, deviation = float(fit.coefficients[place]), float(np.linalg.norm(spread))
    by_predictor, by_deviation = (
        (
            _over_people(predictor + a * _DIFFERENCE, deviation + b * _DIFFERENCE, link)
            - _over_people(predictor - a * _DIFFERENCE, deviation - b * _DIFFERENCE, link)
        )
        / (2 * _DIFFERENCE)
        for a, b in ((1, 0), (0, 1))
    )
    entries = np.outer(sides, spread)[np.tril_indices(len(sides))] / max(deviation, _DIFFERENCE)
    gradient = np.zeros(len(fit.parameter_covariance))
    gradient[place] = by_predictor
    gradient[len(fit.coefficients) :] = by_deviation * entries
    return gradient


def _probability(predictor: float, link: Link) -> float:
    return float(link.probability(np.asarray(predictor)))


def _back(interval: Interval, link: Link) -> Interval:
    return Interval(_probability(interval.low, link), _probability(interval.high, link))
