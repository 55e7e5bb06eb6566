"""The figure of timing: how late onsets were, and how fast people answered."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.data.design import Condition
from autd_analysis.data.trials import Trials
from autd_analysis.report.facets import Facets, single_panel, study_facets
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import Column, draw_places, prepare_axes
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.report.style import GREY, GRID, INK
from autd_analysis.subject import Others
from autd_analysis.timing.numbers import ParticipantResponseTime, TimeSummary, Timing
from autd_analysis.timing.words import timing_sentences

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN, _FACET_IN = 2.3, 1.6
_LEAST_IN = 1.5
_SHARE_LABEL = "Cumulative share of trials"
_MEDIAN_LABEL = "Median response time (s)"


def figures(found: Timing, results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of timing, where onset lateness or response times were recorded."""
    if found.lateness.values_s or found.people:
        yield ResultFigure(
            "timing",
            "Timing: onsets and response times",
            "Cumulative shares of onset lateness and of each participant's response times, and every "
            "participant's median response time in every condition with the mean over participants and its "
            "95% t interval, as far as they were recorded. All numbers are in the tables of timing and of "
            "response times.",
            lambda options: draw_timing(found, results.trials, options),
            tuple(_caption(found)),
        )


def draw_medians_on(found: Timing, results: Others, axes: "Axes", options: FigureOptions) -> None:
    """Draw the panel of participants' median response times on given axes."""
    if found.people:
        _draw_medians(axes, found, single_panel(study_facets(results.trials.design, options)), ())


def draw_timing(found: Timing, trials: Trials, options: FigureOptions) -> "Figure":
    """Draw onset lateness, where it was measured, and response times, where there are any.

    Parameters
    ----------
    found
        All that is known of the times.
    trials
        The study's trials.
    options
        How it is made.
    """
    facets = study_facets(trials.design, options).within(options.width_in - 0.8)
    return Sheet(
        head=f"{facets.study}: timing",
        simulated=trials.simulated,
        legend=facets.legend if found.people else (),
        groups=list(_groups(found, facets)),
        caption=tuple(_caption(found)),
    ).draw(options)


def _draw_lateness(axes: "Axes", lateness: TimeSummary) -> None:
    """Draw the cumulative share of onsets by how late they were."""
    axes.ecdf([1000 * value for value in lateness.values_s], color=INK, linewidth=1.4)
    axes.set(xlabel="Onset lateness (ms)", ylabel=_SHARE_LABEL, ylim=(0, 1.02))
    axes.grid(visible=True, color=GRID, linewidth=0.6)


def _draw_response_times(axes: "Axes", people: Sequence[ParticipantResponseTime]) -> None:
    """Draw the cumulative share of each participant's response times, and of all."""
    for each in people:
        axes.ecdf(each.values_s, color=GREY, linewidth=0.8, alpha=max(0.3, min(1.0, 12 / len(people))))
    axes.ecdf(sorted(value for each in people for value in each.values_s), color=INK, linewidth=1.8)
    axes.set(xlabel="Response time (s)", ylabel=_SHARE_LABEL, ylim=(0, 1.02))
    axes.set_xlim(left=0)
    axes.grid(visible=True, color=GRID, linewidth=0.6)


def _draw_medians(axes: "Axes", found: Timing, facets: Facets, panel: Condition) -> None:
    """Draw participants' median response times, and the mean over them, in the conditions of a panel."""
    prepare_axes(axes, _MEDIAN_LABEL, facets.ticks, facets.x_label)
    medians: dict[object, dict[str, float]] = {}
    for each in found.participants:
        if each.quartiles_s:
            medians.setdefault(frozenset(each.condition), {})[each.participant] = each.quartiles_s[1]
    means = {frozenset(each.condition): each for each in found.conditions}

    def column(x: Condition, colour: Condition) -> Column:
        cell = facets.cell(panel, x, colour)
        mean = means.get(cell)
        return Column(
            medians.get(cell, {}),
            mean.mean_s if mean else None,
            mean.interval_s if mean else None,
            facets.style(panel, x, colour),
        )

    draw_places(axes, [[column(x, colour) for colour in facets.side_by_side] for x in facets.places])
    highest = [value for its in medians.values() for value in its.values()]
    highest += [mean.interval_s.high for mean in found.conditions if mean.interval_s]
    axes.set_ylim(0, 1.06 * max(highest, default=1.0))


def _groups(found: Timing, facets: Facets) -> Iterator[Group]:
    if found.lateness.values_s:
        yield Group(
            title="Onset lateness",
            x_label="Onset lateness (ms)",
            y_label=_SHARE_LABEL,
            panels=[Panel(lambda axes: _draw_lateness(axes, found.lateness))],
            height_in=_PANEL_IN,
            least_in=_LEAST_IN,
        )
    if found.people:
        yield Group(
            title="Response times",
            x_label="Response time (s)",
            y_label=_SHARE_LABEL,
            panels=[Panel(lambda axes: _draw_response_times(axes, found.people))],
            height_in=_PANEL_IN,
            least_in=_LEAST_IN,
        )
        panels = [
            Panel(
                lambda axes, panel=panel: _draw_medians(axes, found, facets, panel),  # type: ignore[misc]
                facets.strip(panel),
            )
            for panel in facets.panel_conditions
        ]
        yield Group(
            title="Participants' medians",
            x_label=facets.x_label,
            y_label=_MEDIAN_LABEL,
            panels=panels,
            height_in=_FACET_IN if len(panels) > 1 else _PANEL_IN,
            least_in=max(1.0, facets.least_in(len(facets.ticks), len(facets.side_by_side))),
            ticks=facets.ticks,
            columns=facets.columns,
            weight=1.75,
        )


def _caption(found: Timing) -> Iterator[str]:
    if found.people:
        answers = sum(len(each.values_s) for each in found.people)
        yield (
            f"Response times of {answers} felt stimuli (n = {len(found.people)}). Thin lines: participants; "
            "thick line: all trials. Small markers: participants' medians (thin lines join the same one); "
            "large markers: mean over participants; bars: its 95% t interval."
        )
    yield from timing_sentences(found)
