"""Parametric bootstrap: intervals of thresholds and slopes, and goodness of fit, from simulated answers.

Answers are drawn from the fitted functions and fitted again. With few trials at a level the deviance is far
from chi-squared, so its p comes from the same simulated answers. F. A. Wichmann and N. J. Hill (2001),
Percept. Psychophys. 63, 1293-1313 and 1314-1329.
"""

import math
from dataclasses import dataclass

import numpy as np

from autd_analysis.basics.intervals import CONFIDENCE
from autd_analysis.psychometric.fit import Fit, condition_log_likelihood, fit_many, shapes
from autd_analysis.psychometric.functions import Array
from autd_analysis.psychometric.intervals import CurveIntervals, OpenInterval
from autd_analysis.psychometric.model import Problem

RESAMPLES = 400
_SEED = 1
_TIE = 1e-4  # deviances that differ less are equal


@dataclass(frozen=True)
class GoodnessOfFit:
    """How well a function describes a condition.

    Attributes
    ----------
    deviance
        Of the stimuli's answers.
    p
        Share of simulated data sets with at least this deviance, the observed one counted.
    dispersion
        Deviance over its mean in simulated data sets: 1 if answers vary as they should; None if it never
        varies.
    """

    deviance: float
    p: float
    dispersion: float | None


@dataclass(frozen=True)
class Resampled:
    """What resampled responses show of a curve.

    Attributes
    ----------
    intervals
        Percentile intervals; ends are open where so many resamples have a threshold beyond the levels, or a
        step. None where the fitted function has no threshold or is itself a step or flat: answers drawn from
        it would not vary as people's do.
    goodness
        None with fewer than three levels: two are always fitted, if answers rise.
    flat
        Number of resamples that had no threshold because they did not rise; the threshold's interval is that
        of the others.
    resamples
        Number of resamples.
    """

    intervals: CurveIntervals
    goodness: GoodnessOfFit | None
    flat: int
    resamples: int


def resample(fitted: Fit, resamples: int = RESAMPLES, seed: int = _SEED) -> tuple[Resampled | None, ...]:
    """Simulate answers from fitted functions and fit them again.

    Parameters
    ----------
    fitted
        The fit.
    resamples
        Number of simulated data sets.
    seed
        Of the random numbers.

    Returns
    -------
    tuple of Resampled or None
        In the order of the curves; None where there is no function.
    """
    whole = fitted.problem
    p, _ = whole.likelihood.probabilities(fitted.parameters[None])
    generator = np.random.default_rng(seed)
    trials = whole.likelihood.trials.astype(int)
    felt = generator.binomial(trials, np.clip(p[0], 0, 1), (resamples, *trials.shape)).astype(float)
    parameters = fit_many(fitted, felt)
    return tuple(
        _of_curve(fitted, number, felt, parameters) if len(each.x) > 1 else None
        for number, each in enumerate(whole.conditions)
    )


def _of_curve(fitted: Fit, number: int, felt: Array, parameters: Array) -> Resampled:
    whole, curve = fitted.problem, fitted.curves[number]
    found = shapes(whole, number, felt, parameters)
    rising = ~np.isnan(found.place)
    usable = curve.threshold is not None and curve.slope is not None and math.isfinite(curve.slope)
    return Resampled(
        intervals=CurveIntervals(
            _thresholds(whole, found.place[rising]) if usable and rising.any() else None,
            OpenInterval(*_percentiles(found.slope)) if usable else None,
        ),
        goodness=_goodness(fitted, number, felt, parameters) if len(whole.conditions[number].x) > 2 else None,
        flat=int((~rising).sum()),
        resamples=len(felt),
    )


def _thresholds(whole: Problem, places: Array) -> OpenInterval:
    ends = _percentiles(places)
    return OpenInterval(
        *(None if end is None else whole.axis.stimulus(whole.middle + whole.reach * end) for end in ends)
    )


def _percentiles(values: Array) -> tuple[float | None, float | None]:
    """Return the values that 2.5 % of all do not exceed and do not fall below; None where infinite."""
    if len(values) == 0:
        return None, None
    ordered = np.sort(values)
    beyond = int((1 - CONFIDENCE) / 2 * len(ordered))
    low, high = float(ordered[beyond]), float(ordered[-1 - beyond])
    return (low if math.isfinite(low) else None), (high if math.isfinite(high) else None)


def _goodness(fitted: Fit, number: int, felt: Array, parameters: Array) -> GoodnessOfFit:
    whole = fitted.problem
    observed = float(deviances(whole, number, whole.felt[None], fitted.parameters[None])[0])
    simulated = deviances(whole, number, felt, parameters)
    as_large = int((simulated >= observed - _TIE).sum())
    mean = float(simulated.mean())
    return GoodnessOfFit(
        deviance=observed,
        p=(1 + as_large) / (1 + len(simulated)),
        dispersion=observed / mean if mean > _TIE else None,
    )


def deviances(whole: Problem, number: int, felt: Array, parameters: Array) -> Array:
    """Return the deviances of a condition's stimuli, shape (data sets,)."""
    from scipy.special import xlogy

    answered, n = whole.of_levels(number, felt), whole.conditions[number].n
    most = (xlogy(answered, answered / n) + xlogy(n - answered, 1 - answered / n)).sum(axis=1)
    found: Array = 2 * np.maximum(0.0, most - condition_log_likelihood(whole, number, felt, parameters))
    return found
