"""The tables of psychometric functions: of each participant, and over participants."""

import math
from collections.abc import Iterator

from analysis.psychometric.hierarchical import MIXED_MODEL, TWO_STAGE
from analysis.psychometric.intervals import PROFILE_INTERVAL, OpenInterval
from analysis.psychometric.results import GroupCurve, ParticipantCurve, PsychometricResults
from analysis.study import Results
from analysis.tables.table import (
    ENDS,
    PARTICIPANT,
    ResultTable,
    Row,
    end_cells,
    factor_columns,
    iterated,
    iterated_interval,
    result_table,
)
from autd_trials.records.table import Column

_NONE: Row = {"notes": "undefined: no factor has three or more numbers as its levels"}
_ALONG = (
    Column("along", "The factor along which the function rises."),
    Column("unit", "What slopes are per, and standard deviations of thresholds in: octave or unit."),
)
_PARTICIPANT = (
    Column("function", "Form of F in p = guess + (1 - guess - lapse) F."),
    Column("threshold", "Stimulus at which F is 0.5."),
    *ENDS,
    Column("bootstrap_low", "Lower end of the threshold's 95 % interval by parametric bootstrap."),
    Column("bootstrap_high", "Upper end of it."),
    Column("slope", "dF/dt at the threshold, t in octaves or units."),
    Column("slope_low", "Lower end of the slope's 95 % profile-likelihood interval; 0: it may be flat."),
    Column("slope_high", "Upper end of it; n/a: it may be a step."),
    Column("slope_bootstrap_low", "Lower end of the slope's 95 % interval by parametric bootstrap."),
    Column("slope_bootstrap_high", "Upper end of it; n/a: a step."),
    Column("guess", 'Probability of "felt" far below the threshold.'),
    Column("guess_method", "How the guess rate was found."),
    Column("lapse", 'Probability of "not felt" far above the threshold.'),
    Column("deviance", "Deviance of the fit."),
    Column("deviance_p", "Its p by resampled answers; n/a with fewer than three levels."),
    Column("dispersion", "Deviance over its mean in resampled answers: 1 if answers vary as they should."),
    Column("levels", "Number of different levels."),
    Column("felt", "Number of stimuli answered as felt."),
    Column("trials", "Number of stimuli counted."),
)
_GROUP = (
    Column("threshold", "Mean of the participants' thresholds; geometric along octaves."),
    *ENDS,
    Column("participants", "Number of participants who have a threshold."),
    Column("slope", "Geometric mean of the participants' slopes."),
    Column("slope_low", "Lower end of its 95 % t interval."),
    Column("slope_high", "Upper end of it."),
    Column("slope_participants", "Number of participants who have a finite slope."),
    Column("mixed_threshold", "Threshold of an average participant by the mixed model."),
    Column("mixed_threshold_low", "Lower end of its 95 % interval; n/a: the function may be flat."),
    Column("mixed_threshold_high", "Upper end of it; n/a: the function may be flat."),
    Column("mixed_threshold_sd", "Standard deviation of thresholds over people."),
    Column("mixed_slope", "Slope of an average participant by the mixed model."),
    Column("mixed_slope_low", "Lower end of its 95 % Wald interval."),
    Column("mixed_slope_high", "Upper end of it."),
    Column("mixed_slope_sd", "Standard deviation of slopes over people."),
    Column("mixed_participants", "Number of participants in the mixed model."),
    Column("mixed_model", "What the mixed model is."),
)


def psychometric_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return the functions over participants and of each."""
    factors = factor_columns(results.trials.design.factors)
    return (
        result_table(
            "psychometric",
            "Psychometric functions over participants, in every condition of the other factors.",
            (*_ALONG, *factors, *_GROUP),
            (_group_row(found, group) for found in results.psychometric for group in found.groups),
            simulated=results.simulated,
            or_else=_NONE,
        ),
        result_table(
            "psychometric_by_participant",
            "Psychometric functions of each participant, in every condition of the other factors.",
            (PARTICIPANT, *_ALONG, *factors, *_PARTICIPANT),
            (_participant_row(found, each) for found in results.psychometric for each in found.participants),
            simulated=results.simulated,
            or_else=_NONE,
        ),
    )


def _participant_row(found: PsychometricResults, each: ParticipantCurve) -> Row:
    curve, resampled = each.curve, each.resampled
    goodness = resampled.goodness if resampled else None
    bootstrap = resampled.intervals if resampled else None
    return {
        "participant": each.participant,
        "along": found.along,
        "unit": found.axis.unit,
        **dict(each.condition),
        "function": found.function,
        "threshold": iterated(curve.threshold),
        **_open_cells("interval", each.intervals.threshold),
        "interval": PROFILE_INTERVAL,
        **_open_cells("bootstrap", bootstrap.threshold if bootstrap else None),
        "slope": iterated(curve.slope) if curve.slope is not None and math.isfinite(curve.slope) else None,
        **_open_cells("slope", each.intervals.slope),
        **_open_cells("slope_bootstrap", bootstrap.slope if bootstrap else None),
        "guess": iterated(curve.guess),
        "guess_method": each.guess_method,
        "lapse": iterated(curve.lapse),
        "deviance": iterated(goodness.deviance) if goodness else None,
        "deviance_p": iterated(goodness.p) if goodness else None,
        "dispersion": iterated(goodness.dispersion) if goodness else None,
        "levels": len(each.answers.x),
        "felt": int(each.answers.felt.sum()),
        "trials": int(each.answers.n.sum()),
        "notes": "; ".join(_notes(each)) or None,
    }


def _notes(each: ParticipantCurve) -> Iterator[str]:
    yield from each.curve.notes
    threshold = each.intervals.threshold
    if threshold and threshold.low is None:
        yield "interval open below: no threshold is too low"
    if threshold and threshold.high is None:
        yield "interval open above: no threshold is too high"
    if each.resampled and each.resampled.intervals.threshold and each.resampled.flat:
        yield f"{each.resampled.flat} of {each.resampled.resamples} resamples had no threshold"


def _group_row(found: PsychometricResults, group: GroupCurve) -> Row:
    mixed = group.mixed
    return {
        "along": found.along,
        "unit": found.axis.unit,
        **dict(group.condition),
        "threshold": iterated(group.threshold.value),
        **end_cells("interval", iterated_interval(group.threshold.interval)),
        "interval": TWO_STAGE,
        "participants": group.threshold.participants,
        "slope": iterated(group.slope.value),
        **end_cells("slope", iterated_interval(group.slope.interval)),
        "slope_participants": group.slope.participants,
        "mixed_threshold": iterated(mixed.threshold) if mixed else None,
        **_open_cells("mixed_threshold", mixed.interval if mixed else None),
        "mixed_threshold_sd": iterated(mixed.threshold_sd) if mixed else None,
        "mixed_slope": iterated(mixed.slope) if mixed else None,
        **end_cells("mixed_slope", iterated_interval(mixed.slope_interval) if mixed else None),
        "mixed_slope_sd": iterated(mixed.slope_sd) if mixed else None,
        "mixed_participants": mixed.participants if mixed else None,
        "mixed_model": MIXED_MODEL,
        "notes": "; ".join((*group.notes, *found.notes)) or None,
    }


def _open_cells(name: str, interval: OpenInterval | None) -> Row:
    return {
        f"{name}_low": iterated(interval.low) if interval else None,
        f"{name}_high": iterated(interval.high) if interval else None,
    }
