"""The figure of rates: every participant in every condition, paired differences, and the tests as a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.design import Condition
from autd_analysis.figure_text import comparison_table, rates_caption
from autd_analysis.panels import Column, draw_places, prepare_axes
from autd_analysis.rates import ConditionRate, ParticipantRate
from autd_analysis.report.differences import Difference, difference_groups
from autd_analysis.report.facets import Cell, Facets, study_facets
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.study import Results
from autd_analysis.style import INK, PLAIN, Style
from autd_analysis.wording import size_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RATE_LABEL = "Detection rate (felt / trials)"
DIFFERENCE_LABEL = "Difference in rate"
_CATCH = "catch trials"
_HOLLOW = Style(INK, "o", hollow=True)
_PANEL_IN = 2.6
_FACET_IN = 1.7  # height of a panel where there are several


@dataclass(frozen=True)
class RateColumns:
    """Rates by condition, for stimuli and for catch trials.

    Attributes
    ----------
    values, means
        Participants' rates, and the mean over them, in every condition of stimuli.
    catch_values, catch_means
        The same in every kind of block, of catch trials; empty without.
    between
        The factors that catch trials have too.
    """

    values: Mapping[Cell, Mapping[str, float]]
    means: Mapping[Cell, ConditionRate]
    catch_values: Mapping[Cell, Mapping[str, float]]
    catch_means: Mapping[Cell, ConditionRate]
    between: frozenset[str]

    def column(self, cell: Cell, style: Style) -> Column:
        """Return the column of a condition."""
        return _column(self.values.get(cell, {}), self.means.get(cell), style)

    def catch_column(self, cell: Cell, style: Style) -> Column:
        """Return the column of catch trials in the kind of block that a condition is of."""
        kind = frozenset(pair for pair in cell if pair[0] in self.between)
        return _column(self.catch_values.get(kind, {}), self.catch_means.get(kind), style)


def rate_columns(results: Results) -> RateColumns:
    """Return the rates of a study by condition."""
    return RateColumns(
        _values(results.participant_rates),
        {frozenset(rate.condition): rate for rate in results.rates},
        _values(results.participant_false_alarms or ()),
        {frozenset(rate.condition): rate for rate in results.false_alarms or ()},
        frozenset(factor.name for factor in results.trials.design.between_blocks),
    )


def draw_figure(results: Results, options: FigureOptions = DEFAULT) -> "Figure":
    """Draw the rates in every condition, the paired differences, and below them the tests.

    Parameters
    ----------
    results
        The study's results.
    options
        How it is made.

    Returns
    -------
    Figure
        Not bound to any window; to be drawn within `autd_analysis.style.figure_style`.
    """
    design = results.trials.design
    facets = study_facets(design, options).within(options.width_in - 0.8)
    rates = rate_columns(results)
    differences = difference_groups(rate_differences(results.comparisons), facets, DIFFERENCE_LABEL)
    legend = [*facets.legend, *([(_HOLLOW, _CATCH)] if rates.catch_means else [])]
    return Sheet(
        head=f"{facets.study}: {size_words(results.trials)}",
        simulated=results.simulated,
        legend=legend,
        groups=[_rates_group(rates, facets), *differences],
        table=comparison_table(results.comparisons, facets.labels),
        caption=rates_caption(results, tests=options.test_table),
    ).draw(options)


def draw_rates(axes: "Axes", rates: RateColumns, facets: Facets, panel: Condition = ()) -> None:
    """Draw the rates of one panel into axes.

    Parameters
    ----------
    axes
        Where to draw.
    rates
        The rates by condition.
    facets
        What is shown where.
    panel
        The levels of the factors that have panels.
    """
    prepare_axes(axes, RATE_LABEL, _rate_ticks(rates, facets), facets.x_label)
    axes.set_ylim(-0.04, 1.04)
    places = [
        [_stimuli(rates, facets, panel, x, each) for each in facets.side_by_side] for x in facets.places
    ]
    if rates.catch_means and _catch_at_each_place(rates, facets):
        for columns, x in zip(places, facets.places, strict=True):
            columns += _catch(rates, facets, panel, x)
    draw_places(axes, places)
    if rates.catch_means and not _catch_at_each_place(rates, facets):
        draw_places(axes, [_catch(rates, facets, panel, ())], first=len(places))


def rate_differences(comparisons: Sequence[ComparisonResult]) -> list[Difference]:
    """Return what was compared, with participants' differences of rates."""
    return [
        (
            result,
            Column(
                {participant: float(difference) for participant, difference in result.differences},
                result.mean,
                result.interval,
                PLAIN,
            ),
        )
        for result in comparisons
    ]


def _values(rates: Sequence[ParticipantRate]) -> dict[Cell, dict[str, float]]:
    values: dict[Cell, dict[str, float]] = {}
    for rate in rates:
        if rate.rate is not None:
            values.setdefault(frozenset(rate.condition), {})[rate.participant] = float(rate.rate)
    return values


def _column(values: Mapping[str, float], mean: ConditionRate | None, style: Style) -> Column:
    return Column(values, mean.mean if mean else None, mean.interval if mean else None, style)


def _rates_group(rates: RateColumns, facets: Facets) -> Group:
    panels = [
        Panel(
            lambda axes, panel=panel: draw_rates(axes, rates, facets, panel),  # type: ignore[misc]
            facets.strip(panel),
        )
        for panel in facets.panel_conditions
    ]
    ticks = _rate_ticks(rates, facets)
    columns = len(facets.side_by_side) * (1 + _catch_at_each_place(rates, facets))
    return Group(
        title="Detection rate",
        x_label=facets.x_label,
        y_label=RATE_LABEL,
        panels=panels,
        height_in=_FACET_IN if len(panels) > 1 else _PANEL_IN,
        least_in=max(0.8, facets.least_in(len(ticks), columns)),
        ticks=ticks,
        columns=facets.columns,
        weight=len(ticks) * max(2, columns),
    )


def _rate_ticks(rates: RateColumns, facets: Facets) -> list[str]:
    own_place = bool(rates.catch_means) and not _catch_at_each_place(rates, facets)
    return [*facets.ticks, *([_CATCH] if own_place else [])]


def _catch_at_each_place(rates: RateColumns, facets: Facets) -> bool:
    return facets.x is not None and facets.x.name in rates.between and bool(rates.catch_means)


def _stimuli(rates: RateColumns, facets: Facets, *parts: Condition) -> Column:
    return rates.column(facets.cell(*parts), facets.style(*parts))


def _catch(rates: RateColumns, facets: Facets, panel: Condition, x: Condition) -> list[Column]:
    told = facets.colour is not None and facets.colour.name in rates.between
    return [
        rates.catch_column(facets.cell(panel, x, each), _hollow(facets.style(panel, each) if told else PLAIN))
        for each in (facets.side_by_side if told else [()])
    ]


def _hollow(style: Style) -> Style:
    return Style(style.colour, style.marker, hollow=True)
