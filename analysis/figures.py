"""The result figure: rates with every participant visible, paired differences, and the tests as a table."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.design import StudyFactor, shown_factors
from analysis.figure_text import LINE_IN, figure_text
from analysis.panels import (
    INK,
    PLAIN,
    Column,
    difference_column,
    draw_columns,
    level_style,
    rate_column,
)
from analysis.rates import ParticipantRate, marginal_rates
from analysis.study import Results
from analysis.style import WIDTH_IN, draw_header, draw_title, save_drawing
from analysis.wording import (
    comparison_names,
    difference_label,
    factor_label,
    level_label,
    numbered,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANELS_IN = 3.0
_HEADER_IN = 0.66
_AXIS_IN = 0.52  # tick and axis labels


def save_figure(results: Results, folder: Path, stem: str = "rates") -> list[Path]:
    """Draw the result figure and save it as PNG (300 dpi), SVG and PDF.

    Parameters
    ----------
    results
        The study's results.
    folder
        An existing folder.
    stem
        The files' name without its ending.

    Returns
    -------
    list of Path
        The files. The same results give the same bytes.
    """
    return save_drawing(lambda: draw_figure(results), folder, stem)


def draw_figure(results: Results) -> "Figure":
    """Draw the result figure.

    On the left the rates, on the right the paired differences of the planned comparisons (if there are any),
    below them the tests and what one must know to read the figure.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    Figure
        Not bound to any window.
    """
    from matplotlib.figure import Figure

    text = figure_text(results)
    below_in = _AXIS_IN + LINE_IN * text.lines
    height_in = _HEADER_IN + _PANELS_IN + below_in
    figure = Figure(figsize=(WIDTH_IN, height_in))
    grid = figure.add_gridspec(
        1,
        2 if results.comparisons else 1,
        width_ratios=[1.75, 1] if results.comparisons else None,
        left=0.075,
        right=0.985 if results.comparisons else 0.62,
        top=1 - _HEADER_IN / height_in,
        bottom=below_in / height_in,
        wspace=0.27,
    )
    draw_header(figure, results, y=1 - 0.2 / height_in)
    _draw_rates(figure.add_subplot(grid[0, 0]), results)
    if results.comparisons:
        _draw_differences(figure.add_subplot(grid[0, 1]), results)
    text.draw(figure, top_in=below_in - _AXIS_IN)
    return figure


def _draw_rates(axes: "Axes", results: Results) -> None:
    x_factor, colour_factor = shown_factors(results.trials.design)
    shown = [factor for factor in (x_factor, colour_factor) if factor is not None]
    groups = _groups(marginal_rates(results.participant_rates, shown), x_factor, colour_factor)
    labels = [level_label(level) for level in x_factor.levels] if x_factor else ["all stimuli"]
    if results.participant_false_alarms is not None:
        catch_colour = colour_factor if colour_factor and not colour_factor.within_block else None
        kept = [catch_colour] if catch_colour else []
        cells = [rate for rate in results.participant_false_alarms if bool(rate.condition) == bool(kept)]
        groups += _groups(marginal_rates(cells, kept), None, catch_colour)
        labels.append("catch trials")
    _prepare(axes, "Detection rate (felt / trials)", labels, factor_label(x_factor.name) if x_factor else "")
    axes.set_ylim(-0.04, 1.04)
    for place, columns in enumerate(groups):
        draw_columns(axes, place, columns)
    if colour_factor:
        _draw_legend(axes, colour_factor)
    draw_title(axes, "A", "Detection rate")


def _draw_differences(axes: "Axes", results: Results) -> None:
    names = comparison_names(results.comparisons)
    pairs = {difference_label(result) for result in results.comparisons}
    label = f"Difference in rate\n({pairs.pop()})" if len(pairs) == 1 else "Difference in rate"
    at = {name for result in results.comparisons for name, _ in result.at}
    named_by_level = len(at) == 1 and not numbered(results.comparisons)
    _prepare(axes, label, names, factor_label(at.pop()) if named_by_level else "Comparison")
    axes.axhline(0, color=INK, linewidth=0.7)
    for place, result in enumerate(results.comparisons):
        draw_columns(axes, place, [difference_column(result)])
    draw_title(axes, "B", "Paired difference")


def _groups(
    rates: Sequence[ParticipantRate], x_factor: StudyFactor | None, colour_factor: StudyFactor | None
) -> list[list[Column]]:
    """Return the columns to draw at each place of the axis."""
    return [
        [
            rate_column(
                [rate for rate in rates if {*x, *colour} == set(rate.condition)],
                level_style(index) if colour else PLAIN,
            )
            for index, colour in enumerate(_pairs(colour_factor))
        ]
        for x in _pairs(x_factor)
    ]


def _pairs(factor: StudyFactor | None) -> list[tuple[tuple[str, float | str], ...]]:
    return [((factor.name, level),) for level in factor.levels] if factor else [()]


def _prepare(axes: "Axes", y_label: str, tick_labels: Sequence[str], x_label: str) -> None:
    axes.set_xticks(range(len(tick_labels)), tick_labels)
    axes.set_xlim(-0.55, len(tick_labels) - 0.45)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.tick_params(axis="x", length=0)
    axes.yaxis.grid(visible=True, color="#E6E6E6", linewidth=0.6)
    axes.set_axisbelow(True)


def _draw_legend(axes: "Axes", factor: StudyFactor) -> None:
    from matplotlib.lines import Line2D

    styles = [level_style(index) for index in range(len(factor.levels))]
    handles = [
        Line2D([], [], color=style.colour, marker=style.marker, linewidth=1.8, label=level_label(level))
        for style, level in zip(styles, factor.levels, strict=True)
    ]
    axes.legend(
        handles=handles,
        frameon=False,
        loc="lower right",
        bbox_to_anchor=(1.01, 0.985),
        ncols=len(handles),
        fontsize=8,
        columnspacing=1.4,
        handlelength=1.6,
        handletextpad=0.5,
        borderaxespad=0,
    )
