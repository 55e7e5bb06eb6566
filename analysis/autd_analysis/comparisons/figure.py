"""The result figure: rates with every participant visible, paired differences, and the tests as a table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autd_analysis.comparisons.figure_text import figure_text
from autd_analysis.data.design import StudyFactor, shown_factors
from autd_analysis.rates.numbers import ParticipantRate, marginal_rates
from autd_analysis.report.panels import (
    Column,
    difference_column,
    draw_columns,
    draw_legend,
    fitted_labels,
    legend_rows,
    prepare_axes,
    rate_column,
)
from autd_analysis.report.style import (
    HEADER_IN,
    INK,
    LINE_IN,
    PLAIN,
    RIGHT,
    draw_header,
    draw_panel_title,
    level_style,
    side_by_side,
)
from autd_analysis.report.wording import (
    comparison_names,
    difference_label,
    factor_label,
    level_label,
    numbered,
    size_words,
)
from autd_analysis.study import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANELS_IN = 3.0
_AXIS_IN = 0.52  # tick and axis labels
_RATES_IN, _DIFFERENCES_IN = 3.6, 2.0  # widths of the panels
_LONGEST_PAIR = 40  # characters beside an axis; the notes say it too


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
    text = figure_text(results)
    rate_labels, comparison_labels = _rate_labels(results), _comparison_labels(results)
    lines = max(label.count("\n") for label in [*rate_labels, *comparison_labels])
    axis_in = _AXIS_IN + LINE_IN * lines
    header_in = HEADER_IN + LINE_IN * legend_rows(shown_factors(results.trials.design)[1])
    below_in = axis_in + LINE_IN * text.lines
    figure, axes = side_by_side(
        (1.75, 1) if results.comparisons else (1,),
        header_in=header_in,
        panels_in=_PANELS_IN,
        below_in=below_in,
        right=RIGHT if results.comparisons else 0.62,
    )
    draw_header(
        figure, results.trials.design.protocol, size_words(results.trials), simulated=results.simulated
    )
    _draw_rates(axes[0], results, rate_labels)
    if results.comparisons:
        _draw_differences(axes[1], results, comparison_labels)
    text.draw(figure, top_in=below_in - axis_in)
    return figure


def _rate_labels(results: Results) -> list[str]:
    x_factor, _ = shown_factors(results.trials.design)
    labels = [level_label(level) for level in x_factor.levels] if x_factor else ["all stimuli"]
    if results.participant_false_alarms is not None:
        labels.append("catch trials")
    return fitted_labels(labels, _RATES_IN)


def _comparison_labels(results: Results) -> list[str]:
    names = comparison_names(results.comparisons)
    return fitted_labels(names, _DIFFERENCES_IN) if names else []


def _draw_rates(axes: "Axes", results: Results, labels: Sequence[str]) -> None:
    x_factor, colour_factor = shown_factors(results.trials.design)
    shown = [factor for factor in (x_factor, colour_factor) if factor is not None]
    groups = _groups(marginal_rates(results.participant_rates, shown), x_factor, colour_factor)
    if results.participant_false_alarms is not None:
        catch_colour = colour_factor if colour_factor and not colour_factor.within_block else None
        kept = [catch_colour] if catch_colour else []
        cells = [rate for rate in results.participant_false_alarms if bool(rate.condition) == bool(kept)]
        groups += _groups(marginal_rates(cells, kept), None, catch_colour)
    prepare_axes(
        axes, "Detection rate (felt / trials)", labels, factor_label(x_factor.name) if x_factor else ""
    )
    axes.set_ylim(-0.04, 1.04)
    for place, columns in enumerate(groups):
        draw_columns(axes, place, columns)
    if colour_factor:
        draw_legend(axes, colour_factor)
    draw_panel_title(axes, "A", "Detection rate")


def _draw_differences(axes: "Axes", results: Results, labels: Sequence[str]) -> None:
    pairs = {difference_label(result) for result in results.comparisons}
    label, pair = "Difference in rate", pairs.pop()
    if not pairs and len(pair) <= _LONGEST_PAIR:
        label = f"{label}\n({pair})"
    at = {name for result in results.comparisons for name, _ in result.at}
    named_by_level = len(at) == 1 and not numbered(results.comparisons)
    prepare_axes(axes, label, labels, factor_label(at.pop()) if named_by_level else "Comparison")
    axes.axhline(0, color=INK, linewidth=0.7)
    for place, result in enumerate(results.comparisons):
        draw_columns(axes, place, [difference_column(result)])
    draw_panel_title(axes, "B", "Paired difference")


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
