"""The figure of comparisons: rates with every participant visible, paired differences, and the tests."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.comparisons.figure_text import figure_text
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.data.design import shown_factors
from autd_analysis.rates import RATES
from autd_analysis.rates.figure import AXIS_IN, PANELS_IN, draw_rates_panel, rate_labels
from autd_analysis.rates.numbers import Rates
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import Column, draw_columns, fitted_labels, legend_rows, prepare_axes
from autd_analysis.report.style import (
    HEADER_IN,
    INK,
    LINE_IN,
    PLAIN,
    draw_header,
    draw_panel_title,
    side_by_side,
)
from autd_analysis.report.wording import contrast_names, difference_label, factor_label, numbered, size_words
from autd_analysis.subject import Others

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN = 2.0
_LONGEST_PAIR = 40  # characters beside an axis; the notes say it too


def figures(comparisons: Sequence[ComparisonResult], results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of rates and differences, which takes the place of that of rates alone."""
    if comparisons:
        rates = results[RATES]
        yield ResultFigure(
            "rates",
            "Detection rates and paired differences",
            "Left: the detection rate of every participant in every condition as a dot, with the mean over "
            "participants and its 95 % t interval. Right: every participant's "
            "difference between the compared conditions, likewise. Below: the tests of these differences. "
            "All numbers are in the tables of rates and of comparisons.",
            lambda: draw_comparisons(comparisons, rates, results),
        )


def draw_comparisons(comparisons: Sequence[ComparisonResult], rates: Rates, results: Others) -> "Figure":
    """Draw the rates on the left, the paired differences on the right, and below them the tests.

    Parameters
    ----------
    comparisons
        The planned comparisons, at least one.
    rates
        The rates that were compared.
    results
        Whose they are.

    Returns
    -------
    Figure
        Not bound to any window; to be drawn within `autd_analysis.report.style.figure_style`.
    """
    design = results.trials.design
    text = figure_text(comparisons, rates, results)
    labels, compared_labels = rate_labels(rates, design), _labels(comparisons)
    lines = max(label.count("\n") for label in [*labels, *compared_labels])
    axis_in = AXIS_IN + LINE_IN * lines
    header_in = HEADER_IN + LINE_IN * legend_rows(shown_factors(design)[1])
    below_in = axis_in + LINE_IN * text.lines
    figure, axes = side_by_side((1.75, 1), header_in=header_in, panels_in=PANELS_IN, below_in=below_in)
    draw_header(figure, design.protocol, size_words(results.trials), simulated=results.trials.simulated)
    draw_rates_panel(axes[0], rates, design, labels)
    _draw_differences(axes[1], comparisons, compared_labels)
    draw_panel_title(axes[1], "B", "Paired difference")
    text.draw(figure, top_in=below_in - axis_in)
    return figure


def draw_differences_on(comparisons: Sequence[ComparisonResult], _results: Others, axes: "Axes") -> None:
    """Draw the panel of paired differences on given axes."""
    _draw_differences(axes, comparisons, _labels(comparisons))


def _labels(comparisons: Sequence[ComparisonResult]) -> list[str]:
    return fitted_labels(contrast_names([result.contrast for result in comparisons]), _WIDTH_IN)


def _draw_differences(axes: "Axes", comparisons: Sequence[ComparisonResult], labels: Sequence[str]) -> None:
    contrasts = [result.contrast for result in comparisons]
    pairs = {difference_label(contrast) for contrast in contrasts}
    label, pair = "Difference in rate", pairs.pop()
    if not pairs and len(pair) <= _LONGEST_PAIR:
        label = f"{label}\n({pair})"
    over = {contrast.over for contrast in contrasts if contrast.over}
    named_by_level = len(over) == 1 and not numbered(contrasts)
    prepare_axes(axes, label, labels, factor_label(over.pop()) if named_by_level else "Comparison")
    axes.axhline(0, color=INK, linewidth=0.7)
    for place, result in enumerate(comparisons):
        draw_columns(axes, place, [_column(result)])


def _column(result: ComparisonResult) -> Column:
    values = {difference.participant: float(difference.value) for difference in result.differences}
    return Column(values, result.mean, result.interval, PLAIN)
