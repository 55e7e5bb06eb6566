"""The figure of thresholds of an adaptive study: every participant, the means, and paired differences."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.design import Condition
from autd_analysis.figure_text import threshold_table
from autd_analysis.panels import Column, draw_places, prepare_axes
from autd_analysis.report.differences import Difference, difference_groups
from autd_analysis.report.facets import Facets, study_facets
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.study import Results
from autd_analysis.style import BAND, PLAIN
from autd_analysis.threshold_comparisons import ThresholdComparison
from autd_analysis.threshold_words import felt_words
from autd_analysis.wording import size_words
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN, _FACET_IN = 2.6, 1.8
_BEYOND = 1.12
"""Where participants are drawn whose threshold lies beyond the levels, as a factor."""
_DIFFERENCE_LABEL = "Difference of thresholds (dB)"


def draw_thresholds(results: Results, options: FigureOptions = DEFAULT) -> "Figure":
    """Draw the figure, within `autd_analysis.style.figure_style`."""
    facets = study_facets(results.trials.design, options).within(options.width_in - 0.8)
    differences = difference_groups(
        threshold_differences(results.threshold_comparisons), facets, _DIFFERENCE_LABEL
    )
    return Sheet(
        head=f"{facets.study}: {size_words(results.trials)}",
        simulated=results.simulated,
        legend=facets.legend,
        groups=[_thresholds_group(results, facets), *differences],
        table=threshold_table(results.threshold_comparisons, facets.labels),
        caption=threshold_caption(results, tests=options.test_table),
    ).draw(options)


def draw_levels(axes: "Axes", results: Results, facets: Facets, panel: Condition = ()) -> None:
    """Draw the thresholds of one panel into axes.

    Parameters
    ----------
    axes
        Where to draw.
    results
        The study's results.
    facets
        What is shown where.
    panel
        The levels of the factors that have panels.
    """
    method = results.trials.design.method
    assert method is not None
    prepare_axes(axes, threshold_label(results, facets), facets.ticks, facets.x_label)
    axes.set_yscale("log")
    smallest, largest = method.range.smallest, method.range.largest
    axes.set_ylim(smallest / _BEYOND**2, largest * _BEYOND**2)
    axes.axhspan(largest, largest * _BEYOND**2, color=BAND, linewidth=0)
    axes.axhspan(smallest / _BEYOND**2, smallest, color=BAND, linewidth=0)
    _draw_level_ticks(axes, smallest, largest)
    values: dict[object, dict[str, float]] = {}
    for each in results.thresholds:
        beyond = {1: largest * _BEYOND, -1: smallest / _BEYOND}.get(each.beyond)
        value = beyond or each.threshold
        if value is not None:
            values.setdefault(frozenset(each.condition), {})[each.participant] = value
    means = {frozenset(group.condition): group for group in results.group_thresholds}

    def column(x: Condition, colour: Condition) -> Column:
        cell = facets.cell(panel, x, colour)
        group = means.get(cell)
        return Column(
            values.get(cell, {}),
            group.threshold if group else None,
            group.interval if group else None,
            facets.style(panel, x, colour),
        )

    draw_places(axes, [[column(x, colour) for colour in facets.side_by_side] for x in facets.places])


def threshold_differences(comparisons: Sequence[ThresholdComparison]) -> list[Difference]:
    """Return what was compared, with participants' differences of thresholds in dB."""
    return [
        (found, Column(dict(found.differences_db), found.mean_db, found.interval, PLAIN))
        for found in comparisons
    ]


def threshold_label(results: Results, facets: Facets) -> str:
    """Return the label of the axis: what the threshold is of, and for which rate of "felt"."""
    method = results.trials.design.method
    assert method is not None
    return f"Threshold ({facets.labels.named(method.varies)}), {felt_words(method)}"


def threshold_caption(results: Results, *, tests: bool = True) -> tuple[str, ...]:
    """Return what one must know to read the figure, and the tests below it if they are there."""
    return tuple(_caption(results, tests=tests))


def _draw_level_ticks(axes: "Axes", smallest: float, largest: float) -> None:
    """Put numbers at 1, 2 and 5 of each decade, and at the ends of the levels where these are few."""
    from matplotlib.ticker import FixedLocator, NullFormatter

    tens = range(-9, 10)
    round_ = [float(f"{digit}e{ten}") for ten in tens for digit in (1, 2, 5)]
    shown = [value for value in round_ if smallest * 0.999 <= value <= largest * 1.001]
    if len(shown) < 3:
        shown = sorted({smallest, *shown, largest})
    axes.yaxis.set_major_locator(FixedLocator(shown))
    axes.yaxis.set_major_formatter(lambda value, _: level_text(float(f"{value:.3g}")))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _thresholds_group(results: Results, facets: Facets) -> Group:
    panels = [
        Panel(
            lambda axes, panel=panel: draw_levels(axes, results, facets, panel),  # type: ignore[misc]
            facets.strip(panel),
        )
        for panel in facets.panel_conditions
    ]
    columns = len(facets.side_by_side)
    return Group(
        title="Threshold",
        x_label=facets.x_label,
        y_label=threshold_label(results, facets),
        panels=panels,
        height_in=_FACET_IN if len(panels) > 1 else _PANEL_IN,
        least_in=max(0.8, facets.least_in(len(facets.ticks), columns)),
        ticks=facets.ticks,
        columns=facets.columns,
        weight=len(facets.ticks) * max(2, columns),
    )


def _caption(results: Results, *, tests: bool) -> Iterator[str]:
    people = len(results.trials.participants)
    compared = " (B)" if results.threshold_comparisons else ""
    yield (
        f"Small markers: participants (n = {people}; thin lines join the same one); large markers: geometric "
        f"mean of thresholds and mean of differences{compared} over participants; bars: its 95% t interval, "
        "in dB (20 log10 of the level)."
    )
    undetermined = sum(group.untold for group in results.group_thresholds)
    if undetermined:
        yield (
            f"{undetermined} threshold{'s are' if undetermined > 1 else ' is'} undetermined and not in the "
            "means; those that seem to lie beyond the levels are drawn in the grey bands."
        )
    if results.threshold_comparisons and tests:
        yield (
            "Tests two-sided, p adjusted by Holm's method for each kind of test; the sign test also "
            "counts thresholds that seem to lie beyond the levels."
        )
