"""The figure of timing: how late onsets were, and how fast people answered."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.design import Condition
from autd_analysis.panels import Column, draw_places, prepare_axes
from autd_analysis.report.facets import Facets, study_facets
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.study import Results
from autd_analysis.style import GREY, GRID, INK
from autd_analysis.timing import ParticipantResponseTime, TimeSummary, TimingResults, timing_results
from autd_analysis.timing_words import timing_sentences

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN, _FACET_IN = 2.3, 1.6
_LEAST_IN = 1.5
_SHARE_LABEL = "Cumulative share of trials"
_MEDIAN_LABEL = "Median response time (s)"


def draw_timing(results: Results, options: FigureOptions = DEFAULT) -> "Figure | None":
    """Draw onset lateness, where it was measured, and response times, where there are any.

    Parameters
    ----------
    results
        The study's results.
    options
        How it is made.

    Returns
    -------
    Figure or None
        None if neither was recorded.
    """
    times = timing_results(results.trials)
    facets = study_facets(results.trials.design, options).within(options.width_in - 0.8)
    groups = list(_groups(times, facets))
    if not groups:
        return None
    answered = any(each.values_s for each in times.people)
    return Sheet(
        head=f"{facets.study}: timing",
        simulated=results.simulated,
        legend=facets.legend if answered else (),
        groups=groups,
        caption=timing_caption(results),
    ).draw(options)


def draw_lateness(axes: "Axes", lateness: TimeSummary) -> None:
    """Draw the cumulative share of onsets by how late they were."""
    axes.ecdf([1000 * value for value in lateness.values_s], color=INK, linewidth=1.4)
    axes.set(xlabel="Onset lateness (ms)", ylabel=_SHARE_LABEL, ylim=(0, 1.02))
    axes.grid(visible=True, color=GRID, linewidth=0.6)


def draw_response_times(axes: "Axes", people: Sequence[ParticipantResponseTime]) -> None:
    """Draw the cumulative share of each participant's response times, and of all."""
    answered = [each for each in people if each.values_s]
    for each in answered:
        axes.ecdf(each.values_s, color=GREY, linewidth=0.8, alpha=max(0.3, min(1.0, 12 / len(answered))))
    axes.ecdf(sorted(value for each in answered for value in each.values_s), color=INK, linewidth=1.8)
    axes.set(xlabel="Response time (s)", ylabel=_SHARE_LABEL, ylim=(0, 1.02))
    axes.set_xlim(left=0)
    axes.grid(visible=True, color=GRID, linewidth=0.6)


def draw_medians(axes: "Axes", times: TimingResults, facets: Facets, panel: Condition = ()) -> None:
    """Draw participants' median response times, and the mean over them, in the conditions of a panel."""
    prepare_axes(axes, _MEDIAN_LABEL, facets.ticks, facets.x_label)
    medians: dict[object, dict[str, float]] = {}
    for each in times.cells:
        if each.quartiles_s:
            medians.setdefault(frozenset(each.condition), {})[each.participant] = each.quartiles_s[1]
    means = {frozenset(each.condition): each for each in times.means}

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
    highest += [mean.interval_s.high for mean in times.means if mean.interval_s]
    axes.set_ylim(0, 1.06 * max(highest, default=1.0))


def timing_caption(results: Results) -> tuple[str, ...]:
    """Return what one must know to read the figure."""
    return tuple(_caption(results))


def _groups(times: TimingResults, facets: Facets) -> Iterator[Group]:
    lateness = next(each for each in times.onsets if each.name == "onset_lateness")
    if lateness.values_s:
        yield Group(
            title="Onset lateness",
            x_label="Onset lateness (ms)",
            y_label=_SHARE_LABEL,
            panels=[Panel(lambda axes: draw_lateness(axes, lateness))],
            height_in=_PANEL_IN,
            least_in=_LEAST_IN,
        )
    if any(each.values_s for each in times.people):
        yield Group(
            title="Response times",
            x_label="Response time (s)",
            y_label=_SHARE_LABEL,
            panels=[Panel(lambda axes: draw_response_times(axes, times.people))],
            height_in=_PANEL_IN,
            least_in=_LEAST_IN,
        )
        panels = [
            Panel(
                lambda axes, panel=panel: draw_medians(axes, times, facets, panel),  # type: ignore[misc]
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


def _caption(results: Results) -> Iterator[str]:
    times = [each for each in timing_results(results.trials).people if each.values_s]
    if times:
        answers = sum(len(each.values_s) for each in times)
        yield (
            f"Response times of {answers} felt stimuli (n = {len(times)}). Thin lines: "
            "participants; thick line: all trials. Small markers: participants' medians (thin lines join the "
            "same one); large markers: mean over participants; bars: its 95% t interval."
        )
    yield from timing_sentences(results.trials)
