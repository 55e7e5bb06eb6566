"""Thresholds and slopes over participants: a mixed model of all answers, and the mean of single estimates.

In the mixed model participants' intercepts and steepnesses are normal about those of the population. Guess
and lapse rates are taken as known: each participant's as they were fitted alone.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_analysis.basics.intervals import Interval, t_interval, t_quantile
from autd_analysis.models.glmm import TROUBLES, GlmmFit, fit_glmm
from autd_analysis.models.marginal import BinomialRows
from autd_analysis.psychometric.fit import Curve, fit
from autd_analysis.psychometric.functions import (
    Array,
    Axis,
    Core,
    predictor_at_threshold,
    slope_per_steepness,
)
from autd_analysis.psychometric.intervals import OpenInterval
from autd_analysis.psychometric.likelihood import LEAST
from autd_analysis.psychometric.model import Answers, Model
from autd_analysis.psychometric.model import answers as put_together

TWO_STAGE = "mean over participants of single thresholds, 95 % t interval"
MIXED_MODEL = (
    "mixed model with random intercept and steepness, 95 % interval by Fieller's theorem with Student's t"
)

FEWEST_PARTICIPANTS = 4

_LEAST_DIVISOR = 1e-100  # so that its square is a number


@dataclass(frozen=True)
class Mean:
    """Mean over participants with its t interval; None where undefined.

    Attributes
    ----------
    value
        Mean; of thresholds along octaves, and of slopes, the geometric one.
    interval
        t interval; of a geometric mean that of the logarithms.
    participants
        Number of participants who have a value.
    """

    value: float | None
    interval: Interval | None
    participants: int


@dataclass(frozen=True)
class MixedCurve:
    """The mixed model of one condition.

    Attributes
    ----------
    threshold
        Of a participant with average intercept and steepness.
    interval
        By Fieller's theorem; both ends are open where the steepness might be zero.
    threshold_sd
        Standard deviation of participants' thresholds in octaves or units, by the delta method.
    slope, slope_interval
        dF/dt at the threshold, and its interval by Student's t.
    slope_sd
        Standard deviation of participants' slopes.
    participants
        Number of participants.
    singular
        Whether a variance was estimated as zero or a correlation as 1.
    """

    threshold: float
    interval: OpenInterval
    threshold_sd: float
    slope: float
    slope_interval: Interval
    slope_sd: float
    participants: int
    singular: bool


def mean_threshold(curves: Sequence[Curve], axis: Axis) -> Mean:
    """Return the mean of participants' thresholds: geometric along octaves, else plain."""
    places = [float(axis.place(np.array(each.threshold))) for each in curves if each.threshold is not None]
    interval = t_interval(places)
    ends = Interval(axis.stimulus(interval.low), axis.stimulus(interval.high)) if interval else None
    return Mean(
        value=axis.stimulus(statistics.fmean(places)) if places else None,
        interval=ends if ends and math.isfinite(ends.high) else None,
        participants=len(places),
    )


def mean_slope(curves: Sequence[Curve]) -> Mean:
    """Return the geometric mean of participants' slopes, of those that are neither flat nor steps."""
    slopes = [each.slope for each in curves if each.threshold is not None and each.slope is not None]
    logs = [math.log(slope) for slope in slopes if math.isfinite(slope)]
    interval = t_interval(logs)
    return Mean(
        value=math.exp(statistics.fmean(logs)) if logs else None,
        interval=Interval(math.exp(interval.low), math.exp(interval.high)) if interval else None,
        participants=len(logs),
    )


def mixed_curve(
    answers: Sequence[Answers], guesses: Sequence[float], lapses: Sequence[float], core: Core, axis: Axis
) -> MixedCurve | str:
    """Fit the mixed model of one condition.

    Parameters
    ----------
    answers
        Of each participant.
    guesses, lapses
        Known rates of each participant.
    core, axis
        The functions' form.

    Returns
    -------
    MixedCurve or str
        The model, or why there is none.
    """
    if len(answers) < FEWEST_PARTICIPANTS:
        return f"it needs {FEWEST_PARTICIPANTS} participants"
    if not _rises(answers, statistics.fmean(guesses), statistics.fmean(lapses), core, axis):
        return "all answers together do not rise gradually along the levels"
    places = np.concatenate([axis.place(each.x) for each in answers])
    middle = float((places.max() + places.min()) / 2)
    columns = np.column_stack([np.ones(len(places)), places - middle])
    rows = BinomialRows(
        felt=np.concatenate([each.felt for each in answers]),
        trials=np.concatenate([each.n for each in answers]),
        fixed=columns,
        random=columns,
        participant=np.repeat(np.arange(len(answers)), [len(each.x) for each in answers]),
    )
    fitted = fit_glmm(rows, link=KnownRates(core, np.array(guesses, float), np.array(lapses, float)))
    if fitted.trouble:
        return TROUBLES[fitted.trouble]
    if not _is_positive_definite(fitted.covariance):
        return TROUBLES["undetermined"]
    if fitted.coefficients[1] <= 0:
        return "the function of an average participant does not rise"
    curve = _mixed_curve(fitted, len(answers), middle, core, axis)
    return curve if math.isfinite(curve.threshold) else "its threshold is too large to be written"


def _is_positive_definite(covariance: Array) -> bool:
    return bool(np.isfinite(covariance).all()) and bool((np.linalg.eigvalsh(covariance) > 0).all())


def _rises(answers: Sequence[Answers], guess: float, lapse: float, core: Core, axis: Axis) -> bool:
    """Return whether all answers together have a function that is neither flat nor a step."""
    rows = [row for each in answers for row in zip(each.x, each.felt, each.n, strict=True)]
    (curve,) = fit([put_together(rows, axis)], Model(core, guess, lapse), axis).curves
    return curve.threshold is not None and curve.slope is not None and math.isfinite(curve.slope)


class KnownRates:
    """The link p = guess + (1 - guess - lapse) F(predictor) with known rates of each participant.

    Participants are along the first axis of all arrays. The likelihood is not concave: modes are searched by
    the expected curvature, but the information takes the observed one.
    """

    def __init__(self, core: Core, guess: Array, lapse: Array) -> None:
        self.core, self.guess, self.lapse = core, guess, lapse

    def probability(self, predictor: Array) -> Array:
        """Return the probability of "felt"."""
        return self._both(predictor)[0]

    def predictor(self, probability: Array) -> Array:
        """Return the predictor, for a probability between the rates; one beyond is moved there."""
        guess, lapse = self._rates(probability)
        return self.core.quantile(np.clip((probability - guess) / (1 - guess - lapse), 0.02, 0.98))

    def log_likelihood(self, felt: Array, trials: Array, predictor: Array) -> Array:
        """Return the log likelihood of each row."""
        p, not_p = self._both(predictor)
        found: Array = felt * np.log(p) + (trials - felt) * np.log(not_p)
        return found

    def derivatives(self, felt: Array, trials: Array, predictor: Array) -> tuple[Array, Array]:
        """Return its first derivative and the negative second, the observed information."""
        density, p, not_p, bend = self._rise(predictor)
        hits, misses = felt / p, (trials - felt) / not_p
        slope = hits - misses
        return density * slope, density**2 * (hits / p + misses / not_p) - bend * slope

    def scoring(self, felt: Array, trials: Array, predictor: Array) -> tuple[Array, Array]:
        """Return its first derivative and the expected information, which is never negative."""
        density, p, not_p, _ = self._rise(predictor)
        return density * (felt / p - (trials - felt) / not_p), trials * (density / p) * (density / not_p)

    def _rise(self, predictor: Array) -> tuple[Array, Array, Array, Array]:
        """Return dp, p, 1 - p and the second derivative of p."""
        below, above, density, bend = self.core.derivatives(predictor)
        guess, lapse = self._rates(predictor)
        span = 1 - guess - lapse
        p, not_p = guess + span * below, lapse + span * above
        return span * density, np.maximum(p, _LEAST_DIVISOR), np.maximum(not_p, _LEAST_DIVISOR), span * bend

    def _rates(self, like: Array) -> tuple[Array, Array]:
        shape = (-1, *[1] * (like.ndim - 1))
        return self.guess.reshape(shape), self.lapse.reshape(shape)

    def _both(self, predictor: Array) -> tuple[Array, Array]:
        below, above = self.core.distribution(predictor)
        guess, lapse = self._rates(predictor)
        span = 1 - guess - lapse
        return np.maximum(guess + span * below, LEAST), np.maximum(lapse + span * above, LEAST)


def _mixed_curve(fitted: GlmmFit, participants: int, middle: float, core: Core, axis: Axis) -> MixedCurve:
    intercept, steepness = (float(each) for each in fitted.coefficients)
    needed = predictor_at_threshold(core) - intercept
    place, slope_unit = needed / steepness, slope_per_steepness(core)
    quantile = t_quantile(participants - 1)
    ends = fieller(needed, steepness, fitted.covariance * np.array([[1.0, -1.0], [-1.0, 1.0]]), quantile)
    spread = fitted.factor @ fitted.factor.T
    weights = np.array([1.0, place])
    half_width = quantile * math.sqrt(float(fitted.covariance[1, 1]))
    return MixedCurve(
        threshold=axis.stimulus(middle + place),
        interval=OpenInterval(*(_finite(end, middle, axis) for end in ends)),
        threshold_sd=math.sqrt(float(weights @ spread @ weights)) / steepness,
        slope=slope_unit * steepness,
        slope_interval=Interval(slope_unit * (steepness - half_width), slope_unit * (steepness + half_width)),
        slope_sd=slope_unit * math.sqrt(float(spread[1, 1])),
        participants=participants,
        singular=fitted.singular,
    )


def _finite(end: float | None, middle: float, axis: Axis) -> float | None:
    """Return the stimulus at an end; None if it is open, or too large to be written."""
    stimulus = math.inf if end is None else axis.stimulus(middle + end)
    return stimulus if math.isfinite(stimulus) else None


def fieller(
    above: float, below: float, covariance: Array, quantile: float
) -> tuple[float | None, float | None]:
    """Return the interval of a ratio of two normal estimates; open where the lower one might be zero.

    E. C. Fieller (1954), J. R. Stat. Soc. B 16, 175-185.

    Parameters
    ----------
    above, below
        The ratio is above / below.
    covariance
        Of both, shape (2, 2).
    quantile
        Half the interval's width in standard errors.
    """
    square = quantile**2
    a = below**2 - square * float(covariance[1, 1])
    if a <= 0:
        return None, None
    b = above * below - square * float(covariance[0, 1])
    c = above**2 - square * float(covariance[0, 0])
    root = math.sqrt(max(0.0, b**2 - a * c))
    return (b - root) / a, (b + root) / a
