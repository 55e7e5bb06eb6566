"""The figure of psychometric functions: every participant's answers and curve, and the group's."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from autd_analysis.data.design import Condition, shown_factors
from autd_analysis.psychometric.functions import Array, psychometric_function
from autd_analysis.psychometric.numbers import GroupCurve, ParticipantCurve, PsychometricResults
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.style import (
    GREY,
    GRID,
    HEADER_IN,
    LINE_IN,
    PLAIN,
    WIDTH_IN,
    Style,
    draw_header,
    draw_notes,
    draw_panel_title,
    level_style,
    wrapped_notes,
)
from autd_analysis.report.wording import factor_label, level_label, shortened, size_words
from autd_analysis.subject import Others

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW_IN = 2.5
_AXIS_IN = 0.45  # tick and axis labels
_MOST_COLUMNS = 3
_MOST_TICKS = 9
_TITLE_CHARACTERS = 96  # of all titles of a row
_MARGIN = 0.25  # of the range of levels, beyond them on either side
_AREA_PER_TRIAL = 1.6  # in square points
_NOTE = (
    "Dots: participants' rates, area by trials; thin lines: their functions, where answers tell one. Thick "
    "line: function of an average participant (mixed model; else from mean threshold and slope). Large "
    "marker: its threshold, where F is 0.5; bar: 95 % interval (Fieller; else t), arrows: it goes on."
)


def figures(found: Sequence[PsychometricResults], results: Others) -> Iterator[ResultFigure]:
    """Yield a figure for each factor along which there are functions."""
    for each in found:
        yield ResultFigure(
            "psychometric" if len(found) == 1 else f"psychometric_{each.along}",
            f"Psychometric functions along {factor_label(each.along)}",
            "A panel for each condition: every participant's rates as dots and fitted function as a thin "
            "line; the function of an average participant as a thick line, with its threshold and interval. "
            "All numbers are in the tables of psychometric functions.",
            partial(draw_psychometric, results, each),
        )


def draw_first_panel_on(found: Sequence[PsychometricResults], results: Others, axes: "Axes") -> None:
    """Draw the functions of the first condition along the first factor on given axes."""
    if found and found[0].groups:
        _prepare(axes, found[0], first=True)
        group = found[0].groups[0]
        _draw_condition(axes, found[0], group, _style(results, group.condition))


def draw_psychometric(results: Others, found: PsychometricResults) -> "Figure":
    """Draw the functions along one factor, within `autd_analysis.report.style.figure_style`.

    A panel for each condition of the other factors.
    """
    from matplotlib.figure import Figure

    notes = wrapped_notes([_NOTE, *(f"{note[:1].upper()}{note[1:]}." for note in found.notes)])
    below_in = _AXIS_IN + LINE_IN * (len(notes) + 0.6)
    columns = min(_MOST_COLUMNS, max(2, len(found.groups)))
    rows = math.ceil(len(found.groups) / columns)
    height_in = HEADER_IN + rows * _ROW_IN + below_in
    figure = Figure(figsize=(WIDTH_IN, height_in))
    grid = figure.add_gridspec(
        rows,
        columns,
        left=0.075,
        right=0.985,
        top=1 - HEADER_IN / height_in,
        bottom=below_in / height_in,
        wspace=0.12,
        hspace=0.45,
    )
    draw_header(
        figure, results.trials.design.protocol, size_words(results.trials), simulated=results.trials.simulated
    )
    for place, group in enumerate(found.groups):
        axes = figure.add_subplot(grid[place // columns, place % columns])
        _prepare(axes, found, first=place % columns == 0)
        title = shortened(_name(results, group.condition), _TITLE_CHARACTERS // columns)
        draw_panel_title(axes, chr(ord("A") + place), title)
        _draw_condition(axes, found, group, _style(results, group.condition))
    draw_notes(figure, notes, LINE_IN * (len(notes) - 0.2))
    return figure


def _draw_condition(axes: "Axes", found: PsychometricResults, group: GroupCurve, style: Style) -> None:
    people = [each for each in found.participants if each.condition == group.condition]
    x = _abscissae(axes, found)
    for each in people:
        if each.curve.slope is not None:
            axes.plot(x, _curve(found, each, x), color=GREY, linewidth=0.6, alpha=0.7, zorder=1)
        axes.scatter(
            each.answers.x,
            each.answers.felt / each.answers.n,
            s=_AREA_PER_TRIAL * each.answers.n,
            marker=style.marker,
            color=style.colour,
            alpha=0.35,
            linewidths=0,
            zorder=2,
        )
    _draw_group(axes, found, group, people, style)


def _draw_group(
    axes: "Axes",
    found: PsychometricResults,
    group: GroupCurve,
    people: Sequence[ParticipantCurve],
    style: Style,
) -> None:
    mixed = group.mixed
    threshold = mixed.threshold if mixed else group.threshold.value
    slope = mixed.slope if mixed else group.slope.value
    interval = mixed.interval if mixed else group.threshold.interval
    if threshold is None or slope is None:
        return
    guess = float(np.mean([each.curve.guess for each in people]))
    lapse = float(np.mean([each.curve.lapse for each in people]))
    x = _abscissae(axes, found)
    curve = psychometric_function(
        found.core, found.axis, x, threshold=threshold, slope=slope, guess=guess, lapse=lapse
    )
    axes.plot(x, curve, color=style.colour, linewidth=2, zorder=3)
    halfway = (guess + 1 - lapse) / 2
    if interval is not None:
        _draw_interval(axes, interval.low, interval.high, halfway, style)
    if x[0] <= threshold <= x[-1]:
        axes.plot(
            threshold,
            halfway,
            marker=style.marker,
            markersize=7,
            color=style.colour,
            markeredgecolor="white",
            markeredgewidth=0.8,
            zorder=5,
        )


def _draw_interval(axes: "Axes", low: float | None, high: float | None, y: float, style: Style) -> None:
    """Draw an interval along the abscissa, with an arrow where it goes on beyond the panel."""
    first, last = axes.get_xlim()
    left = min(max(first if low is None else low, first), last)
    right = min(max(last if high is None else high, first), last)
    axes.hlines(y, left, right, color=style.colour, linewidth=1.4, zorder=4)
    for end, beyond, marker in (
        (left, low is None or low < first, "<"),
        (right, high is None or high > last, ">"),
    ):
        if beyond:
            axes.plot(end, y, marker=marker, markersize=4, color=style.colour, clip_on=False, zorder=4)


def _curve(found: PsychometricResults, each: ParticipantCurve, x: Array) -> Array:
    curve = each.curve
    below, _ = found.core.distribution(curve.intercept + curve.steepness * found.axis.place(x))
    return curve.guess + (1 - curve.guess - curve.lapse) * below


def _prepare(axes: "Axes", found: PsychometricResults, *, first: bool) -> None:
    levels = np.unique(np.concatenate([each.answers.x for each in found.participants]))
    if found.axis.logarithmic:
        axes.set_xscale("log", base=2)
    places = found.axis.place(levels) if len(levels) else np.zeros(1)
    margin = _MARGIN * float(places[-1] - places[0]) or 1.0
    axes.set_xlim(found.axis.stimulus(places[0] - margin), found.axis.stimulus(places[-1] + margin))
    if 0 < len(levels) <= _MOST_TICKS:
        axes.set_xticks(levels, [level_label(float(level)) for level in levels])
        axes.set_xticks([], minor=True)
    else:
        axes.xaxis.set_major_formatter(lambda value, _: level_label(float(f"{value:.3g}")))
    axes.set_ylim(-0.04, 1.04)
    axes.set_xlabel(factor_label(found.along))
    axes.yaxis.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    if first:
        axes.set_ylabel("Detection rate (felt / trials)")
    else:
        axes.set_yticklabels([])


def _abscissae(axes: "Axes", found: PsychometricResults) -> Array:
    first, last = axes.get_xlim()
    return np.geomspace(first, last, 100) if found.axis.logarithmic else np.linspace(first, last, 100)


def _style(results: Others, condition: Condition) -> Style:
    _, colour = shown_factors(results.trials.design)
    level = dict(condition).get(colour.name) if colour else None
    return level_style(colour.levels.index(level)) if colour and level is not None else PLAIN


def _name(results: Others, condition: Condition) -> str:
    """Return a condition's levels; factors that have but one go without saying."""
    varied = {factor.name for factor in results.trials.design.factors if len(factor.levels) > 1}
    levels = [f"{factor_label(name)}: {level_label(level)}" for name, level in condition if name in varied]
    return ", ".join(levels) or "all stimuli"
