"""The psychometric functions of a study: of every participant in every condition, and over participants."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from autd_analysis.data.design import Condition, conditions
from autd_analysis.data.trials import Trials
from autd_analysis.psychometric.fit import Curve, fit
from autd_analysis.psychometric.functions import Array, Axis, Core
from autd_analysis.psychometric.hierarchical import (
    Mean,
    MixedCurve,
    mean_slope,
    mean_threshold,
    mixed_curve,
)
from autd_analysis.psychometric.intervals import CurveIntervals, profile_intervals
from autd_analysis.psychometric.model import Answers, Model, answers, axis_of
from autd_analysis.psychometric.options import DEFAULT, PsychometricOptions
from autd_analysis.psychometric.resampling import Resampled, resample
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    import pandas as pd

MISFIT_P = 0.05
"""A p of the deviance below is remarked."""

_MOST_FELT = 0.25  # of the lowest stimuli, where nobody is taken to guess

FEWEST_LEVELS = 3
"""A factor needs as many levels for its functions to be fitted without being asked for."""


@dataclass(frozen=True, eq=False)
class ParticipantCurve:
    """One participant's function in one condition.

    Attributes
    ----------
    participant, condition
        Whose, and at which levels of the other factors.
    answers
        What was fitted.
    curve, intervals
        The function, and the profile-likelihood intervals of threshold and slope.
    resampled
        Bootstrap intervals and goodness of fit; None where there is no function.
    guess_method
        How the guess rate was found.
    """

    participant: str
    condition: Condition
    answers: Answers
    curve: Curve
    intervals: CurveIntervals
    resampled: Resampled | None
    guess_method: str

    @property
    def rate(self) -> float:
        """Probability of "felt" at the threshold: halfway between guess rate and 1 - lapse rate."""
        return (1 + self.curve.guess - self.curve.lapse) / 2

    @property
    def misfit(self) -> bool:
        """Whether so large a deviance is rare where the function holds."""
        goodness = self.resampled.goodness if self.resampled else None
        return goodness is not None and goodness.p < MISFIT_P

    @property
    def notes(self) -> tuple[str, ...]:
        """What is odd."""
        if not self.misfit or self.resampled is None or self.resampled.goodness is None:
            return self.curve.notes
        return (*self.curve.notes, f"the function does not fit: deviance p = {self.resampled.goodness.p:.2g}")


@dataclass(frozen=True, eq=False)
class GroupCurve:
    """A condition over participants.

    Attributes
    ----------
    condition
        The levels of the other factors.
    threshold, slope
        Means of the participants' estimates.
    mixed
        The mixed model of all answers; None where it cannot be fitted.
    guess, lapse
        Means of the participants' rates; NaN without any.
    notes
        What is odd.
    """

    condition: Condition
    threshold: Mean
    slope: Mean
    mixed: MixedCurve | None
    guess: float
    lapse: float
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class PsychometricResults:
    """The functions along one factor.

    Attributes
    ----------
    along
        The factor.
    axis
        Octaves or units.
    core
        F.
    participants, groups
        The functions of each participant, and over participants.
    notes
        What to know about all of them.
    remarks
        What to change before using them.
    """

    along: str
    axis: Axis
    core: Core
    participants: tuple[ParticipantCurve, ...]
    groups: tuple[GroupCurve, ...]
    notes: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    @property
    def function(self) -> str:
        """Name of F, as in ``normal along octaves``."""
        return f"{self.core.name} along {self.axis.unit}s"

    @property
    def threshold_rates(self) -> tuple[float, float] | None:
        """Least and largest probability of "felt" at participants' thresholds; None without participants."""
        rates = [each.rate for each in self.participants]
        return (min(rates), max(rates)) if rates else None


def all_psychometric_results(
    trials: Trials, options: PsychometricOptions = DEFAULT
) -> tuple[PsychometricResults, ...]:
    """Return the functions along every factor that has three or more numbers as its levels.

    Where an adaptive method chose the levels, along what it varied alone.
    """
    if trials.design.method is not None:
        return (psychometric_results(trials, trials.design.method.varies, options),)
    return tuple(
        psychometric_results(trials, factor.name, options)
        for factor in trials.design.factors
        if len(factor.levels) >= FEWEST_LEVELS and not any(isinstance(level, str) for level in factor.levels)
    )


def psychometric_results(
    trials: Trials, along: str, options: PsychometricOptions = DEFAULT
) -> PsychometricResults:
    """Fit the functions along a column of the trials' table.

    Parameters
    ----------
    trials
        The trials; those that count are taken.
    along
        The column, a number in every stimulus; it need not be one of a few levels.
    options
        The functions' form, and how their rates are found.

    Raises
    ------
    UsageError
        The table has no such column, or stimuli without a number there.
    """
    table = trials.table[trials.table["used"]]
    stimuli = table[table["trial_type"] == "stimulus"]
    levels = _numbers(stimuli, along)
    axis = axis_of(levels)
    others = [factor for factor in trials.design.factors if factor.name != along]
    cells = conditions(others)
    people = tuple(
        curve
        for participant, its_table in table.groupby("participant", sort=True)
        for curve in _participant(str(participant), _cells(its_table, along, axis, cells), axis, options)
    )
    core = options.model(informed=False).core
    groups = tuple(
        _group(cell, [each for each in people if each.condition == cell], core, axis) for cell in cells
    )
    notes = tuple(_notes(along, axis, levels))
    # What a protocol recorded are felt and not felt; a table's answers may be right and wrong.
    remarks = () if trials.logged else tuple(_guess_remarks(people, options))
    return PsychometricResults(along, axis, core, people, groups, notes, remarks)


def _numbers(stimuli: "pd.DataFrame", along: str) -> Array:
    """Return the levels of stimuli, each once."""
    if along not in stimuli.columns:
        raise UsageError(f"the trials have no column {along!r}", do="name a factor with numbers as levels")
    try:
        levels = np.unique(stimuli[along].to_numpy(dtype=float))
    except (TypeError, ValueError) as error:
        raise UsageError(f"{along} is not a number in every trial", do="name a numeric factor") from error
    if not np.isfinite(levels).all():
        raise UsageError(f"{along} is missing in some trials", do="name a numeric factor")
    return levels


def _cells(
    table: "pd.DataFrame", along: str, axis: Axis, cells: Sequence[Condition]
) -> list[tuple[Condition, Answers]]:
    """Return one participant's answers in each condition.

    A catch trial goes with the first condition that has its levels, which is as good as any where the guess
    rate is shared.
    """
    stimuli = table[table["trial_type"] == "stimulus"]
    catch = table[table["trial_type"] == "catch"]
    left = np.ones(len(catch), bool)
    found = []
    for cell in cells:
        mine = np.ones(len(stimuli), bool)
        goes = left.copy()
        for name, level in cell:
            mine &= (stimuli[name] == level).to_numpy()
            goes &= (catch[name].isna() | (catch[name] == level)).to_numpy()
        left &= ~goes
        rows = [
            (float(x), float(felt), 1.0)
            for x, felt in zip(stimuli.loc[mine, along], stimuli.loc[mine, "felt"], strict=True)
        ]
        silent = catch.loc[goes, "felt"]
        found.append((cell, answers(rows, axis, (float(silent.sum()), float(len(silent))))))
    return found


def _participant(
    participant: str, cells: Sequence[tuple[Condition, Answers]], axis: Axis, options: PsychometricOptions
) -> Iterator[ParticipantCurve]:
    informed = any(each.catch_n > 0 for _, each in cells)
    chosen = options.model(informed=informed)
    together = [cells] if chosen.joint else [[cell] for cell in cells]
    for group in together:
        fitted = fit([each for _, each in group], chosen, axis)
        for (cell, each), curve, intervals, resampled in zip(
            group, fitted.curves, profile_intervals(fitted), resample(fitted), strict=True
        ):
            how = _guess_method(chosen, informed=informed)
            yield ParticipantCurve(participant, cell, each, curve, intervals, resampled, how)


def _guess_method(model: Model, *, informed: bool) -> str:
    if not isinstance(model.guess, str):
        return "fixed"
    source = "catch trials and stimuli" if informed else "stimuli"
    scope = "for all conditions" if model.guess == "shared" else "for each condition"
    return f"estimated from {source}, {scope}"


def _group(cell: Condition, people: Sequence[ParticipantCurve], core: Core, axis: Axis) -> GroupCurve:
    present = [each for each in people if len(each.answers.x)]
    curves = [each.curve for each in present]
    mixed = mixed_curve(
        [each.answers for each in present],
        [each.guess for each in curves],
        [each.lapse for each in curves],
        core,
        axis,
    )
    threshold, slope = mean_threshold(curves, axis), mean_slope(curves)
    return GroupCurve(
        cell,
        threshold,
        slope,
        None if isinstance(mixed, str) else mixed,
        guess=float(np.mean([each.guess for each in curves])) if curves else math.nan,
        lapse=float(np.mean([each.lapse for each in curves])) if curves else math.nan,
        notes=tuple(_group_notes(curves, slope, mixed)),
    )


def _group_notes(curves: Sequence[Curve], slope: Mean, mixed: MixedCurve | str) -> Iterator[str]:
    without = sum(each.threshold is None for each in curves)
    if without:
        yield f"{without} of {len(curves)} participant(s) have no threshold and are not in its mean"
    outside = sum(any("extrapolated" in note for note in each.notes) for each in curves)
    if outside:
        yield f"{outside} threshold(s) lie outside the levels tested: extrapolated"
    if slope.participants < len(curves):
        yield f"{len(curves) - slope.participants} participant(s) have no finite slope"
    if isinstance(mixed, str):
        yield f"no mixed model: {mixed}"
    elif mixed.singular:
        yield "mixed model singular: a variance is zero or a correlation 1"


def _notes(along: str, axis: Axis, levels: Array) -> Iterator[str]:
    if along == "modulation_hz":
        yield "detection need not rise with the modulation frequency: a threshold is then no threshold"
    if axis.logarithmic and (levels == 0).any():
        yield f"{along} 0 is taken as no stimulus: it informs the guess rate alone"
    if len(levels) == FEWEST_LEVELS:
        yield "three levels can hardly show whether the function has this form"


def _guess_remarks(people: Sequence[ParticipantCurve], options: PsychometricOptions) -> Iterator[str]:
    lowest = [each.answers for each in people if len(each.answers.x) and each.guess_method == "fixed"]
    felt, n = sum(float(each.felt[0]) for each in lowest), sum(float(each.n[0]) for each in lowest)
    if options.guess is None and n and felt / n >= _MOST_FELT:
        yield (
            f"{felt / n:.0%} of the stimuli of the lowest levels were felt, while the guess rate is taken as "
            "0: where answers can be right by chance, say how often (two alternatives: --guess 0.5)"
        )
