"""The figure of thresholds of an adaptive study: every participant, the means, and paired differences."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Design, describe_condition
from autd_analysis.data.trials import Trials
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import Column, draw_columns, fitted_labels, prepare_axes
from autd_analysis.report.style import (
    HEADER_IN,
    INK,
    LINE_IN,
    PLAIN,
    draw_header,
    draw_notes,
    draw_panel_title,
    side_by_side,
    wrapped_notes,
)
from autd_analysis.report.wording import MINUS, factor_label, level_label, size_words
from autd_analysis.subject import Others
from autd_analysis.thresholds.comparisons import Thresholds
from autd_analysis.thresholds.words import comparison_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANELS_IN = 2.8
_THRESHOLDS_IN, _DIFFERENCES_IN = 3.6, 2.0
_BEYOND = 1.12
"""Where participants are drawn whose threshold lies beyond the levels, as a factor."""


def figures(found: Thresholds, results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of thresholds."""
    yield ResultFigure(
        "thresholds",
        "Thresholds and paired differences",
        "Left: every participant's threshold in every condition as a dot, with the geometric mean over "
        "participants and its 95 % t interval; participants whose threshold lies over the largest level "
        "stand above the line. Right, if comparisons are planned: every participant's difference in dB. "
        "All numbers are in the tables of thresholds.",
        lambda: draw_thresholds(found, results.trials),
    )


def draw_thresholds_on(found: Thresholds, results: Others, axes: "Axes") -> None:
    """Draw the panel of thresholds on given axes."""
    names, x_label = _condition_labels(found, results.trials.design)
    _draw_levels(axes, found, fitted_labels(names, _THRESHOLDS_IN), x_label)


def draw_thresholds(found: Thresholds, trials: Trials) -> "Figure":
    """Draw the figure, within `autd_analysis.report.style.figure_style`."""
    names, x_label = _condition_labels(found, trials.design)
    labels = fitted_labels(names, _THRESHOLDS_IN)
    compared = [_compared_label(comparison.contrast) for comparison in found.comparisons]
    compared_labels = fitted_labels(compared, _DIFFERENCES_IN) if compared else []
    notes = wrapped_notes(_notes(found, trials))
    lines = 2 + max(label.count("\n") for label in [*labels, *compared_labels])
    below_in = LINE_IN * (lines + len(notes) + 1.1)
    figure, axes = side_by_side(
        (1.75, 1) if compared else (1,), header_in=HEADER_IN, panels_in=_PANELS_IN, below_in=below_in
    )
    draw_header(figure, trials.design.protocol, size_words(trials), simulated=trials.simulated)
    _draw_levels(axes[0], found, labels, x_label)
    draw_panel_title(axes[0], "A", "Threshold")
    if compared:
        _draw_differences(axes[1], found, compared_labels)
    draw_notes(figure, notes, LINE_IN * (len(notes) - 0.2))
    return figure


def _draw_levels(axes: "Axes", found: Thresholds, labels: list[str], x_label: str) -> None:
    method = found.method
    prepare_axes(axes, f"Threshold ({factor_label(method.varies).lower()})", labels, x_label)
    axes.set_yscale("log")
    smallest, largest = method.range.smallest, method.range.largest
    axes.set_ylim(smallest / _BEYOND**2, largest * _BEYOND**2)
    axes.axhspan(largest, largest * _BEYOND**2, color="0.95", linewidth=0)
    axes.axhspan(smallest / _BEYOND**2, smallest, color="0.95", linewidth=0)
    axes.yaxis.set_major_formatter(lambda value, _: level_label(float(f"{value:.3g}")))
    axes.yaxis.set_minor_formatter(lambda value, _: level_label(float(f"{value:.3g}")))
    axes.tick_params(axis="y", which="minor", labelsize=6)
    for place, group in enumerate(found.conditions):
        there = [each for each in found.participants if each.condition == group.condition]
        values = {each.participant: each.threshold for each in there}
        values |= {each.participant: largest * _BEYOND for each in there if each.beyond == 1}
        values |= {each.participant: smallest / _BEYOND for each in there if each.beyond == -1}
        told = {participant: value for participant, value in values.items() if value is not None}
        draw_columns(axes, place, [Column(told, group.threshold, group.interval, PLAIN)])


def _draw_differences(axes: "Axes", thresholds: Thresholds, labels: list[str]) -> None:
    prepare_axes(axes, "Difference of thresholds (dB)", labels, "")
    axes.axhline(0, color=INK, linewidth=0.7)
    for place, found in enumerate(thresholds.comparisons):
        column = Column(dict(found.differences_db), found.mean_db, found.interval, PLAIN)
        draw_columns(axes, place, [column])
    draw_panel_title(axes, "B", "Paired difference")


def _condition_labels(found: Thresholds, design: Design) -> tuple[list[str], str]:
    """Return the conditions' names, and the axis's; factors that have but one level go without saying."""
    varied = [factor for factor in design.factors if len(factor.levels) > 1]
    if len(varied) == 1:
        return [level_label(level) for level in varied[0].levels], factor_label(varied[0].name)
    names = {factor.name for factor in varied}
    shown = [tuple(pair for pair in group.condition if pair[0] in names) for group in found.conditions]
    return [describe_condition(condition) for condition in shown], ""


def _compared_label(contrast: Contrast) -> str:
    """Return what was compared, in short: the notes have it in full."""
    return f"{level_label(contrast.first)} {MINUS} {level_label(contrast.second)}" + "".join(
        f", {level_label(level)}" for _, level in contrast.at
    )


def _notes(thresholds: Thresholds, trials: Trials) -> Iterator[str]:
    yield (
        f"Small markers: participants (n = {len(trials.participants)}); large markers: geometric "
        "mean (A) or mean (B) over participants; bars: its 95 % t interval, in dB (20 log10 of the level)."
    )
    untold = sum(group.untold for group in thresholds.conditions)
    if untold:
        yield (
            f"{untold} track(s) tell no threshold and are not in the means; those that seem to lie beyond "
            "the levels are drawn in the grey bands."
        )
    for found in thresholds.comparisons:
        yield f"{comparison_words(found)}."
