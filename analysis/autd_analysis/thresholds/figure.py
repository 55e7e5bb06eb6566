"""The figure of thresholds of an adaptive study: every participant, the means, and paired differences."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.data.design import Condition
from autd_analysis.data.trials import Trials
from autd_analysis.report.differences import Difference, difference_groups
from autd_analysis.report.facets import Facets, single_panel, study_facets
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import Column, draw_places, prepare_axes
from autd_analysis.report.sheet import Group, Panel, Sheet, Table
from autd_analysis.report.style import BAND, PLAIN
from autd_analysis.report.tests_table import TEST_HEADINGS, test_cells, tests_table
from autd_analysis.report.wording import Labels, format_interval, format_number, format_p, size_words
from autd_analysis.subject import Others
from autd_analysis.thresholds.comparisons import ThresholdComparison, Thresholds
from autd_analysis.thresholds.words import felt_words
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN, _FACET_IN = 2.6, 1.8
_BEYOND = 1.12
"""Where participants are drawn whose threshold lies beyond the levels, as a factor."""
_SIGN_HEADINGS = (("exact sign test", "first higher"), ("", "p"), ("", "Holm"))
_DIFFERENCE_LABEL = "Difference of thresholds (dB)"


def figures(found: Thresholds, results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of thresholds."""
    yield ResultFigure(
        "thresholds",
        "Thresholds and paired differences" if found.comparisons else "Thresholds",
        "Panel A: every participant's threshold in every condition as a dot, with the geometric mean over "
        "participants and its 95% t interval; thresholds beyond the levels stand in grey bands. Panel B, if "
        "comparisons are planned: every participant's difference in dB. All numbers are in the tables of "
        "thresholds.",
        lambda options: draw_thresholds(found, results.trials, options),
        tuple(_caption(found, results.trials, tests=False)),
    )


def draw_thresholds_on(found: Thresholds, results: Others, axes: "Axes", options: FigureOptions) -> None:
    """Draw the panel of thresholds on given axes."""
    _draw_levels(axes, found, single_panel(study_facets(results.trials.design, options)), ())


def draw_thresholds(found: Thresholds, trials: Trials, options: FigureOptions) -> "Figure":
    """Draw the figure, within `autd_analysis.report.style.figure_style`."""
    facets = study_facets(trials.design, options).within(options.width_in - 0.8)
    return Sheet(
        head=f"{facets.study}: {size_words(trials)}",
        simulated=trials.simulated,
        legend=facets.legend,
        groups=[
            _thresholds_group(found, facets),
            *difference_groups(_differences(found.comparisons), facets, _DIFFERENCE_LABEL),
        ],
        table=_table(found.comparisons, facets.labels),
        caption=tuple(_caption(found, trials, tests=options.test_table)),
    ).draw(options)


def _draw_levels(axes: "Axes", found: Thresholds, facets: Facets, panel: Condition) -> None:
    method = found.method
    prepare_axes(axes, _label(found, facets), facets.ticks, facets.x_label)
    axes.set_yscale("log")
    smallest, largest = method.range.smallest, method.range.largest
    axes.set_ylim(smallest / _BEYOND**2, largest * _BEYOND**2)
    axes.axhspan(largest, largest * _BEYOND**2, color=BAND, linewidth=0)
    axes.axhspan(smallest / _BEYOND**2, smallest, color=BAND, linewidth=0)
    _draw_level_ticks(axes, smallest, largest)
    values: dict[object, dict[str, float]] = {}
    for each in found.participants:
        beyond = {1: largest * _BEYOND, -1: smallest / _BEYOND}.get(each.beyond)
        value = beyond or each.threshold
        if value is not None:
            values.setdefault(frozenset(each.condition), {})[each.participant] = value
    means = {frozenset(group.condition): group for group in found.conditions}

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


def _label(found: Thresholds, facets: Facets) -> str:
    """Return the label of the axis: what the threshold is of, and for which rate of "felt"."""
    return f"Threshold ({facets.labels.named(found.method.varies)}), {felt_words(found.method)}"


def _differences(comparisons: Sequence[ThresholdComparison]) -> list[Difference]:
    return [
        (found.contrast, Column(dict(found.differences_db), found.mean_db, found.interval, PLAIN))
        for found in comparisons
    ]


def _table(comparisons: Sequence[ThresholdComparison], labels: Labels) -> Table:
    rows = [
        (
            str(len(found.differences_db)),
            f"{format_number(found.mean_db)} {format_interval(found.interval, format_number)}",
            *test_cells(found.sign_flip, found.sign_flip_holm, found.paired_t, found.paired_t_holm),
            f"{found.higher_first} of {found.higher_first + found.higher_second}",
            format_p(found.sign_p),
            format_p(found.sign_holm),
        )
        for found in comparisons
    ]
    headings = (*TEST_HEADINGS, *_SIGN_HEADINGS)
    return tests_table([found.contrast for found in comparisons], labels, headings, rows)


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


def _thresholds_group(found: Thresholds, facets: Facets) -> Group:
    panels = [
        Panel(
            lambda axes, panel=panel: _draw_levels(axes, found, facets, panel),  # type: ignore[misc]
            facets.strip(panel),
        )
        for panel in facets.panel_conditions
    ]
    columns = len(facets.side_by_side)
    return Group(
        title="Threshold",
        x_label=facets.x_label,
        y_label=_label(found, facets),
        panels=panels,
        height_in=_FACET_IN if len(panels) > 1 else _PANEL_IN,
        least_in=max(0.8, facets.least_in(len(facets.ticks), columns)),
        ticks=facets.ticks,
        columns=facets.columns,
        weight=len(facets.ticks) * max(2, columns),
    )


def _caption(found: Thresholds, trials: Trials, *, tests: bool) -> Iterator[str]:
    people = len(trials.participants)
    compared = " (B)" if found.comparisons else ""
    yield (
        f"Small markers: participants (n = {people}; thin lines join the same one); large markers: geometric "
        f"mean of thresholds and mean of differences{compared} over participants; bars: its 95% t interval, "
        "in dB (20 log10 of the level)."
    )
    undetermined = sum(group.undetermined for group in found.conditions)
    if undetermined:
        yield (
            f"{undetermined} threshold{'s are' if undetermined > 1 else ' is'} undetermined and not in the "
            "means; those that seem to lie beyond the levels are drawn in the grey bands."
        )
    if found.comparisons and tests:
        yield (
            "Tests two-sided, p adjusted by Holm's method for each kind of test; the sign test also "
            "counts thresholds that seem to lie beyond the levels."
        )
