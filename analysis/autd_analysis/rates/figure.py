"""The figure of rates: every participant in every condition, and the means over participants."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.data.design import Condition, Design
from autd_analysis.rates.numbers import ConditionRate, ParticipantRate, Rates
from autd_analysis.report.facets import Cell, Facets, single_panel, study_facets
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import Column, draw_places, prepare_axes
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.report.style import INK, PLAIN, Style
from autd_analysis.report.wording import size_words
from autd_analysis.subject import Others

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LABEL = "Detection rate (felt / trials)"
_CATCH = "catch trials"
_HOLLOW = Style(INK, "o", hollow=True)
_PANEL_IN = 2.6
_FACET_IN = 1.7  # height of a panel where there are several


def figures(rates: Rates, results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of rates; not where an adaptive method steered them all to the same."""
    if results.trials.design.method is None:
        yield ResultFigure(
            "rates",
            "Detection rates",
            "The detection rate of every participant in every condition as a dot, with the mean over "
            "participants and its 95% t interval. All numbers are in the tables of rates.",
            lambda options: draw_rates(rates, results, options),
            rates_caption(rates, results),
        )


def draw_rates(rates: Rates, results: Others, options: FigureOptions) -> "Figure":
    """Draw the figure of rates alone, within `autd_analysis.report.style.figure_style`."""
    facets = rate_facets(results, options)
    return Sheet(
        head=f"{facets.study}: {size_words(results.trials)}",
        simulated=results.trials.simulated,
        legend=rates_legend(rates, facets),
        groups=[rates_group(rates, results.trials.design, facets)],
        caption=rates_caption(rates, results),
    ).draw(options)


def draw_rates_on(rates: Rates, results: Others, axes: "Axes", options: FigureOptions) -> None:
    """Draw the panel of rates on given axes."""
    facets = single_panel(study_facets(results.trials.design, options))
    _draw_panel(axes, _by_condition(rates, results.trials.design), facets, ())


def rate_facets(results: Others, options: FigureOptions) -> Facets:
    """Return what figures of rates show where, at their width."""
    return study_facets(results.trials.design, options).within(options.width_in - 0.8)


def rates_legend(rates: Rates, facets: Facets) -> list[tuple[Style, str]]:
    """Return what the symbols of the panels of rates stand for."""
    return [*facets.legend, *([(_HOLLOW, _CATCH)] if rates.false_alarms else [])]


def rates_group(rates: Rates, design: Design, facets: Facets) -> Group:
    """Return the panels of rates."""
    found = _by_condition(rates, design)
    panels = [
        Panel(
            lambda axes, panel=panel: _draw_panel(axes, found, facets, panel),  # type: ignore[misc]
            facets.strip(panel),
        )
        for panel in facets.panel_conditions
    ]
    ticks = _ticks(found, facets)
    columns = len(facets.side_by_side) * (1 + _catch_at_each_place(found, facets))
    return Group(
        title="Detection rate",
        x_label=facets.x_label,
        y_label=_LABEL,
        panels=panels,
        height_in=_FACET_IN if len(panels) > 1 else _PANEL_IN,
        least_in=max(0.8, facets.least_in(len(ticks), columns)),
        ticks=ticks,
        columns=facets.columns,
        weight=len(ticks) * max(2, columns),
    )


def rates_caption(rates: Rates, results: Others, about_differences: Sequence[str] = ()) -> tuple[str, ...]:
    """Return what one must know to read the panels, and those of differences beside them."""
    people = len(results.trials.participants)
    catch = " Open markers: catch trials." if rates.false_alarms else ""
    undefined = ("No catch trials: the false-alarm rate is undefined.",) if rates.false_alarms is None else ()
    return (
        f"Small markers: participants (n = {people}; thin lines join the same one). Large markers: mean over "
        f"participants; bars: its 95% t interval.{catch}",
        *about_differences,
        *undefined,
    )


@dataclass(frozen=True)
class _ByCondition:
    """Participants' rates, and the mean over them, in every condition, and in every kind of block.

    `between` are the factors that catch trials have too.
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


def _by_condition(rates: Rates, design: Design) -> _ByCondition:
    return _ByCondition(
        _values(rates.participants),
        {frozenset(rate.condition): rate for rate in rates.conditions},
        _values(rates.participant_false_alarms or ()),
        {frozenset(rate.condition): rate for rate in rates.false_alarms or ()},
        frozenset(factor.name for factor in design.between_blocks),
    )


def _values(rates: Sequence[ParticipantRate]) -> dict[Cell, dict[str, float]]:
    values: dict[Cell, dict[str, float]] = {}
    for rate in rates:
        if rate.rate is not None:
            values.setdefault(frozenset(rate.condition), {})[rate.participant] = float(rate.rate)
    return values


def _column(values: Mapping[str, float], mean: ConditionRate | None, style: Style) -> Column:
    return Column(values, mean.mean if mean else None, mean.interval if mean else None, style)


def _draw_panel(axes: "Axes", found: _ByCondition, facets: Facets, panel: Condition) -> None:
    prepare_axes(axes, _LABEL, _ticks(found, facets), facets.x_label)
    axes.set_ylim(-0.04, 1.04)
    places = [
        [
            found.column(facets.cell(panel, x, each), facets.style(panel, x, each))
            for each in facets.side_by_side
        ]
        for x in facets.places
    ]
    if _catch_at_each_place(found, facets):
        for columns, x in zip(places, facets.places, strict=True):
            columns += _catch(found, facets, panel, x)
    draw_places(axes, places)
    if _catch_apart(found, facets):
        draw_places(axes, [_catch(found, facets, panel, ())], first=len(places))


def _ticks(found: _ByCondition, facets: Facets) -> list[str]:
    return [*facets.ticks, *([_CATCH] if _catch_apart(found, facets) else [])]


def _catch_at_each_place(found: _ByCondition, facets: Facets) -> bool:
    return bool(found.catch_means) and facets.x is not None and facets.x.name in found.between


def _catch_apart(found: _ByCondition, facets: Facets) -> bool:
    return bool(found.catch_means) and not _catch_at_each_place(found, facets)


def _catch(found: _ByCondition, facets: Facets, panel: Condition, x: Condition) -> list[Column]:
    coloured = facets.colour is not None and facets.colour.name in found.between
    return [
        found.catch_column(
            facets.cell(panel, x, each), _hollow(facets.style(panel, each) if coloured else PLAIN)
        )
        for each in (facets.side_by_side if coloured else [()])
    ]


def _hollow(style: Style) -> Style:
    return Style(style.colour, style.marker, hollow=True)
