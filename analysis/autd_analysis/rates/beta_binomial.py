"""The beta-binomial model of one condition: participants' rates vary about a mean.

Each person feels with a rate of his or her own, which is beta distributed over people with parameters a and
b: mean a / (a + b), and correlation 1 / (a + b + 1) between two answers of one person. J. G. Skellam (1948),
J. R. Stat. Soc. B 10, 257-261.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval

_HALF_CHI2_95 = 1.9207294103470618
"""Half the 95 % point of chi-squared with one degree of freedom: what the profile may lose."""

_LARGEST_LOGIT = 12.0
_COARSE_STEP = 0.75

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BetaBinomial:
    """The fitted model.

    Attributes
    ----------
    mean, interval
        Mean rate over people, and its profile-likelihood interval.
    correlation
        Of two answers of one person, 0 to 1: how much people differ. 0 is plain binomial.
    p_overdispersion
        Likelihood-ratio test of no difference between people; halved, as the correlation cannot be negative.
    """

    mean: float
    interval: Interval
    correlation: float
    p_overdispersion: float


def fit_beta_binomial(counts: Sequence[tuple[int, int]]) -> BetaBinomial | None:
    """Fit the model by maximum likelihood.

    Parameters
    ----------
    counts
        Felt and number of trials of each participant.

    Returns
    -------
    BetaBinomial or None
        None with fewer than two participants with trials, or if all answers are the same: how much people
        differ is then undetermined.
    """
    felt = np.array([each for each, n in counts if n > 0], float)
    trials = np.array([n for _, n in counts if n > 0], float)
    if len(felt) < 2 or not 0 < felt.sum() < trials.sum():
        return None
    # The profile may have several maxima where numbers of trials differ widely.
    coarse = np.arange(-_LARGEST_LOGIT, _LARGEST_LOGIT + _COARSE_STEP, _COARSE_STEP)
    start = float(coarse[np.argmax([_profile(felt, trials, logit)[0] for logit in coarse])])
    best = _maximum(lambda mean: _profile(felt, trials, mean)[0], start - _COARSE_STEP, start + _COARSE_STEP)
    value, correlation = _profile(felt, trials, best)
    binomial = _log_likelihood(felt, trials, _logit(felt.sum() / trials.sum()), 0.0)
    target = value - _HALF_CHI2_95
    return BetaBinomial(
        mean=_expit(best),
        interval=Interval(
            _expit(_crossing(felt, trials, target, best, -_LARGEST_LOGIT)),
            _expit(_crossing(felt, trials, target, best, _LARGEST_LOGIT)),
        ),
        correlation=correlation,
        p_overdispersion=0.5 * math.erfc(math.sqrt(max(0.0, value - binomial))),
    )


def _profile(felt: Array, trials: Array, logit: float) -> tuple[float, float]:
    """Return the largest log likelihood at a mean, and the correlation there."""

    def value(correlation: float) -> float:
        return _log_likelihood(felt, trials, logit, correlation)

    scale = _maximum(lambda z: value(_expit(z)), -14.0, 14.0)
    inside = value(_expit(scale))
    return (inside, _expit(scale)) if inside > value(0.0) else (value(0.0), 0.0)


def _log_likelihood(felt: Array, trials: Array, logit: float, correlation: float) -> float:
    """Return the log likelihood without the binomial coefficients."""
    from scipy.special import betaln

    mean = _expit(logit)
    if correlation <= 0:
        return float((felt * math.log(mean) + (trials - felt) * math.log1p(-mean)).sum())
    a, b = mean * (1 / correlation - 1), (1 - mean) * (1 / correlation - 1)
    return float((betaln(felt + a, trials - felt + b) - betaln(a, b)).sum())


def _crossing(felt: Array, trials: Array, target: float, best: float, end: float) -> float:
    """Return where the profile falls to the target between its maximum and an end; the end if nowhere."""
    from scipy.optimize import brentq

    def above(logit: float) -> float:
        return _profile(felt, trials, logit)[0] - target

    return end if above(end) > 0 else float(brentq(above, best, end, xtol=1e-8))


def _maximum(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        lambda x: -function(x), bounds=(low, high), method="bounded", options={"xatol": 1e-7}
    )
    return float(found.x)


def _logit(rate: float) -> float:
    return math.log(rate / (1 - rate))


def _expit(logit: float) -> float:
    return 1 / (1 + math.exp(-logit))
