"""The figure of psychometric functions: every participant's answers and curve, and the group's."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from autd_analysis.data.design import Condition
from autd_analysis.psychometric.functions import Array, psychometric_function
from autd_analysis.psychometric.numbers import GroupCurve, ParticipantCurve, PsychometricResults
from autd_analysis.report.facets import Facets, study_facets
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.lettering import width_in
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.report.style import GREY, GRID, Style
from autd_analysis.report.wording import size_words, study_labels, upper_first
from autd_analysis.subject import Others
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN = 1.9
_LEAST_IN = 1.2
_RATE_LABEL = "Detection rate (felt / trials)"
_TICK_GAP_IN = 0.06
_MARGIN = 0.25  # of the range of levels, beyond them on either side
_AREA_PER_TRIAL = 1.6  # in square points
_LARGEST_DOT = 36.0  # in square points
_NOTE = (
    "Dots: participants' rates, area by trials; thin lines: their functions, where answers determine one. "
    "Thick line: function of an average participant (mixed model; else from mean threshold and slope). Large "
    "marker: its threshold, where F is 0.5; bar: 95% interval (Fieller; else t), arrows: it goes on."
)


def figures(found: Sequence[PsychometricResults], results: Others) -> Iterator[ResultFigure]:
    """Yield a figure for each factor along which there are functions."""
    labels = study_labels(results.trials.design)
    for each in found:
        yield ResultFigure(
            "psychometric" if len(found) == 1 else f"psychometric_{each.along}",
            f"Psychometric functions along {labels.words(each.along)}",
            "A panel for each condition: every participant's rates as dots and fitted function as a thin "
            "line; the function of an average participant as a thick line, with its threshold and interval. "
            "All numbers are in the tables of psychometric functions.",
            partial(draw_psychometric, results, each),
            _caption(each),
        )


def draw_first_panel_on(
    found: Sequence[PsychometricResults], results: Others, axes: "Axes", options: FigureOptions
) -> None:
    """Draw the functions of the first condition along the first factor on given axes, under its name."""
    if found:
        facets = study_facets(results.trials.design, options).along(found[0].along)
        panel = facets.panel_conditions[0]
        _draw_panel(axes, found[0], facets, panel)
        axes.set_title(facets.strip(panel))


def draw_psychometric(results: Others, found: PsychometricResults, options: FigureOptions) -> "Figure":
    """Draw the functions along one factor, a panel for each condition of the other factors.

    Parameters
    ----------
    results
        The study's results.
    found
        The functions.
    options
        How it is made.

    Returns
    -------
    Figure
        Not bound to any window; to be drawn within `autd_analysis.report.style.figure_style`.
    """
    facets = study_facets(results.trials.design, options)
    return Sheet(
        head=f"{facets.study}: {size_words(results.trials)}",
        simulated=results.trials.simulated,
        legend=(),
        groups=[_group(found, facets.along(found.along))],
        caption=_caption(found),
    ).draw(options)


def _draw_panel(axes: "Axes", found: PsychometricResults, facets: Facets, panel: Condition) -> None:
    _prepare(axes, found, facets)
    cell = facets.cell(panel)
    for group in found.groups:
        if frozenset(group.condition) == cell:
            _draw_condition(axes, found, group, facets.style(panel))


def _caption(found: PsychometricResults) -> tuple[str, ...]:
    return (_NOTE, *(f"{upper_first(note)}." for note in found.notes))


def _group(found: PsychometricResults, facets: Facets) -> Group:
    return Group(
        title=f"Psychometric functions along {facets.labels.words(found.along)}",
        x_label=facets.labels.title(found.along),
        y_label=_RATE_LABEL,
        panels=[
            Panel(
                lambda axes, panel=panel: _draw_panel(axes, found, facets, panel),  # type: ignore[misc]
                facets.strip(panel),
            )
            for panel in facets.panel_conditions
        ],
        height_in=_PANEL_IN,
        least_in=_LEAST_IN,
        columns=facets.columns,
    )


def _draw_condition(axes: "Axes", found: PsychometricResults, group: GroupCurve, style: Style) -> None:
    people = [each for each in found.participants if each.condition == group.condition]
    x = _abscissae(axes, found)
    for each in people:
        if each.curve.slope is not None:
            axes.plot(x, _curve(found, each, x), color=GREY, linewidth=0.6, alpha=0.7, zorder=1)
        axes.scatter(
            each.answers.x,
            each.answers.felt / each.answers.n,
            s=np.minimum(_LARGEST_DOT, _AREA_PER_TRIAL * each.answers.n),
            marker=style.marker,
            color=style.colour,
            alpha=0.35,
            linewidths=0,
            zorder=2,
        )
    _draw_group(axes, found, group, style)


def _draw_group(
    axes: "Axes",
    found: PsychometricResults,
    group: GroupCurve,
    style: Style,
) -> None:
    mixed = group.mixed
    threshold = mixed.threshold if mixed else group.threshold.value
    slope = mixed.slope if mixed else group.slope.value
    interval = mixed.interval if mixed else group.threshold.interval
    if threshold is None or slope is None:
        return
    x = _abscissae(axes, found)
    curve = psychometric_function(
        found.core, found.axis, x, threshold=threshold, slope=slope, guess=group.guess, lapse=group.lapse
    )
    axes.plot(x, curve, color=style.colour, linewidth=2, zorder=3)
    halfway = (group.guess + 1 - group.lapse) / 2
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


def _prepare(axes: "Axes", found: PsychometricResults, facets: Facets) -> None:
    levels = np.unique(np.concatenate([each.answers.x for each in found.participants]))
    if found.axis.logarithmic:
        axes.set_xscale("log", base=2)
    places = found.axis.place(levels) if len(levels) else np.zeros(1)
    margin = _MARGIN * float(places[-1] - places[0]) or 1.0
    axes.set_xlim(found.axis.stimulus(places[0] - margin), found.axis.stimulus(places[-1] + margin))
    shares = (places - places[0] + margin) / (places[-1] - places[0] + 2 * margin)
    chosen = list(_ticks(axes, levels, shares[: len(levels)]))
    axes.set_xticks(chosen, [_tick(level) for level in chosen])
    axes.set_xticks([], minor=True)
    axes.set_ylim(-0.04, 1.04)
    axes.tick_params(axis="y", labelsize=7)
    axes.set(xlabel=facets.labels.title(found.along), ylabel=_RATE_LABEL)
    axes.yaxis.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _ticks(axes: "Axes", levels: Array, shares: Array) -> Iterator[float]:
    """Yield the levels whose numbers do not touch; `shares` of the axis's length are where they stand."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    length_in = figure.get_figwidth() * axes.get_position().width
    end_in = -np.inf
    for level, share in zip(levels, shares, strict=True):
        half_in = width_in(_tick(level), 8) / 2
        if share * length_in - half_in > end_in + _TICK_GAP_IN:
            end_in = share * length_in + half_in
            yield float(level)


def _tick(level: float) -> str:
    return level_text(float(f"{level:.3g}"))


def _abscissae(axes: "Axes", found: PsychometricResults) -> Array:
    first, last = axes.get_xlim()
    return np.geomspace(first, last, 100) if found.axis.logarithmic else np.linspace(first, last, 100)
