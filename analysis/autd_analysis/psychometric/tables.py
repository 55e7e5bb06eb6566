"""The tables of psychometric functions: of each participant, and over participants."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from autd_analysis.psychometric.hierarchical import MIXED_MODEL, TWO_STAGE, MixedCurve
from autd_analysis.psychometric.intervals import PROFILE_INTERVAL, OpenInterval
from autd_analysis.psychometric.numbers import GroupCurve, ParticipantCurve, PsychometricResults
from autd_analysis.psychometric.resampling import GoodnessOfFit
from autd_analysis.report.table import (
    HIGH,
    LOW,
    PARTICIPANT,
    Declared,
    interval_kind,
    iterated,
    joined,
)
from autd_trials.tables import Column, of

_NONE = "undefined: no factor has three or more numbers as its levels"


@dataclass(frozen=True, eq=False)
class _Along:
    """A row of either table: the results along a factor."""

    results: PsychometricResults


@dataclass(frozen=True, eq=False)
class _Participant(_Along):
    found: ParticipantCurve

    @property
    def participant(self) -> str:
        return self.found.participant

    @property
    def goodness(self) -> GoodnessOfFit | None:
        return self.found.resampled.goodness if self.found.resampled else None

    @property
    def bootstrap_threshold(self) -> OpenInterval | None:
        return self.found.resampled.intervals.threshold if self.found.resampled else None

    @property
    def bootstrap_slope(self) -> OpenInterval | None:
        return self.found.resampled.intervals.slope if self.found.resampled else None


@dataclass(frozen=True, eq=False)
class _Group(_Along):
    found: GroupCurve

    @property
    def mixed(self) -> MixedCurve | None:
        return self.found.mixed


def _finite(slope: float | None) -> float | None:
    return slope if slope is not None and math.isfinite(slope) else None


def _participant_notes(row: _Participant) -> Iterator[str]:
    found = row.found
    yield from found.curve.notes
    threshold = found.intervals.threshold
    if threshold and threshold.low is None:
        yield "interval open below: no threshold is too low"
    if threshold and threshold.high is None:
        yield "interval open above: no threshold is too high"
    if found.resampled and found.resampled.intervals.threshold and found.resampled.flat:
        yield f"{found.resampled.flat} of {found.resampled.resamples} resamples had no threshold"


_ALONG: tuple[Column[_Along], ...] = (
    Column("along", "The factor along which the function rises.", lambda row: row.results.along),
    Column(
        "unit",
        "What slopes are per, and standard deviations of thresholds in: octave or unit.",
        lambda row: row.results.axis.unit,
    ),
)
BY_PARTICIPANT = Declared[Sequence[PsychometricResults], _Participant](
    "psychometric_by_participant",
    "Psychometric functions of each participant, in every condition of the other factors.",
    rows=lambda found: [_Participant(each, curve) for each in found for curve in each.participants],
    leading=(PARTICIPANT, *_ALONG),
    condition=lambda row: row.found.condition,
    columns=(
        Column(
            "function",
            "Form of F in p = guess + (1 - guess - lapse) F.",
            lambda row: row.results.function,
        ),
        Column("threshold", "Stimulus at which F is 0.5.", lambda row: iterated(row.found.curve.threshold)),
        Column("interval_low", LOW, of(lambda row: row.found.intervals.threshold, lambda i: iterated(i.low))),
        Column(
            "interval_high", HIGH, of(lambda row: row.found.intervals.threshold, lambda i: iterated(i.high))
        ),
        interval_kind(PROFILE_INTERVAL),
        Column(
            "bootstrap_low",
            "Lower end of the threshold's 95 % interval by parametric bootstrap.",
            of(lambda row: row.bootstrap_threshold, lambda ends: iterated(ends.low)),
        ),
        Column(
            "bootstrap_high",
            "Upper end of it.",
            of(lambda row: row.bootstrap_threshold, lambda ends: iterated(ends.high)),
        ),
        Column(
            "slope",
            "dF/dt at the threshold, t in octaves or units.",
            lambda row: iterated(_finite(row.found.curve.slope)),
        ),
        Column(
            "slope_low",
            "Lower end of the slope's 95 % profile-likelihood interval; 0: it may be flat.",
            of(lambda row: row.found.intervals.slope, lambda ends: iterated(ends.low)),
        ),
        Column(
            "slope_high",
            "Upper end of it; n/a: it may be a step.",
            of(lambda row: row.found.intervals.slope, lambda ends: iterated(ends.high)),
        ),
        Column(
            "slope_bootstrap_low",
            "Lower end of the slope's 95 % interval by parametric bootstrap.",
            of(lambda row: row.bootstrap_slope, lambda ends: iterated(ends.low)),
        ),
        Column(
            "slope_bootstrap_high",
            "Upper end of it; n/a: a step.",
            of(lambda row: row.bootstrap_slope, lambda ends: iterated(ends.high)),
        ),
        Column(
            "guess",
            'Probability of "felt" far below the threshold.',
            lambda row: iterated(row.found.curve.guess),
        ),
        Column("guess_method", "How the guess rate was found.", lambda row: row.found.guess_method),
        Column(
            "lapse",
            'Probability of "not felt" far above the threshold.',
            lambda row: iterated(row.found.curve.lapse),
        ),
        Column(
            "deviance",
            "Deviance of the fit.",
            of(lambda row: row.goodness, lambda goodness: iterated(goodness.deviance)),
        ),
        Column(
            "deviance_p",
            "Its p by resampled answers; n/a with fewer than three levels.",
            of(lambda row: row.goodness, lambda goodness: iterated(goodness.p)),
        ),
        Column(
            "dispersion",
            "Deviance over its mean in resampled answers: 1 if answers vary as they should.",
            of(lambda row: row.goodness, lambda goodness: iterated(goodness.dispersion)),
        ),
        Column("levels", "Number of different levels.", lambda row: len(row.found.answers.x)),
        Column(
            "felt",
            "Number of stimuli answered as felt.",
            lambda row: int(row.found.answers.felt.sum()),
        ),
        Column("trials", "Number of stimuli counted.", lambda row: int(row.found.answers.n.sum())),
    ),
    notes=lambda row: joined(_participant_notes(row)),
    undefined=_NONE,
)
OVER_PARTICIPANTS = Declared[Sequence[PsychometricResults], _Group](
    "psychometric",
    "Psychometric functions over participants, in every condition of the other factors.",
    rows=lambda found: [_Group(each, group) for each in found for group in each.groups],
    leading=_ALONG,
    condition=lambda row: row.found.condition,
    columns=(
        Column(
            "threshold",
            "Mean of the participants' thresholds; geometric along octaves.",
            lambda row: iterated(row.found.threshold.value),
        ),
        Column("interval_low", LOW, of(lambda row: row.found.threshold.interval, lambda i: iterated(i.low))),
        Column(
            "interval_high", HIGH, of(lambda row: row.found.threshold.interval, lambda i: iterated(i.high))
        ),
        interval_kind(TWO_STAGE),
        Column(
            "participants",
            "Number of participants who have a threshold.",
            lambda row: row.found.threshold.participants,
        ),
        Column(
            "slope",
            "Geometric mean of the participants' slopes.",
            lambda row: iterated(row.found.slope.value),
        ),
        Column(
            "slope_low",
            "Lower end of its 95 % t interval.",
            of(lambda row: row.found.slope.interval, lambda ends: iterated(ends.low)),
        ),
        Column(
            "slope_high",
            "Upper end of it.",
            of(lambda row: row.found.slope.interval, lambda ends: iterated(ends.high)),
        ),
        Column(
            "slope_participants",
            "Number of participants who have a finite slope.",
            lambda row: row.found.slope.participants,
        ),
        Column(
            "mixed_threshold",
            "Threshold of an average participant by the mixed model.",
            of(lambda row: row.mixed, lambda mixed: iterated(mixed.threshold)),
        ),
        Column(
            "mixed_threshold_low",
            "Lower end of its 95 % interval; n/a: the function may be flat.",
            of(lambda row: row.mixed.interval if row.mixed else None, lambda ends: iterated(ends.low)),
        ),
        Column(
            "mixed_threshold_high",
            "Upper end of it; n/a: the function may be flat.",
            of(lambda row: row.mixed.interval if row.mixed else None, lambda ends: iterated(ends.high)),
        ),
        Column(
            "mixed_threshold_sd",
            "Standard deviation of thresholds over people.",
            of(lambda row: row.mixed, lambda mixed: iterated(mixed.threshold_sd)),
        ),
        Column(
            "mixed_slope",
            "Slope of an average participant by the mixed model.",
            of(lambda row: row.mixed, lambda mixed: iterated(mixed.slope)),
        ),
        Column(
            "mixed_slope_low",
            "Lower end of its 95 % Wald interval.",
            of(lambda row: row.mixed.slope_interval if row.mixed else None, lambda ends: iterated(ends.low)),
        ),
        Column(
            "mixed_slope_high",
            "Upper end of it.",
            of(lambda row: row.mixed.slope_interval if row.mixed else None, lambda ends: iterated(ends.high)),
        ),
        Column(
            "mixed_slope_sd",
            "Standard deviation of slopes over people.",
            of(lambda row: row.mixed, lambda mixed: iterated(mixed.slope_sd)),
        ),
        Column(
            "mixed_participants",
            "Number of participants in the mixed model.",
            of(lambda row: row.mixed, lambda mixed: mixed.participants),
        ),
        Column("mixed_model", "What the mixed model is.", lambda _row: MIXED_MODEL),
    ),
    notes=lambda row: joined((*row.found.notes, *row.results.notes)),
    undefined=_NONE,
)
