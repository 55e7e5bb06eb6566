"""The figure of timing: how late onsets were, and how fast people answered."""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from autd_analysis.data.design import Condition, Design, StudyFactor, shown_factors
from autd_analysis.data.trials import Trials
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import (
    Column,
    draw_columns,
    draw_legend,
    fitted_labels,
    legend_rows,
    prepare_axes,
)
from autd_analysis.report.style import (
    GREY,
    GRID,
    HEADER_IN,
    INK,
    LINE_IN,
    PLAIN,
    Style,
    draw_header,
    draw_notes,
    draw_panel_title,
    level_style,
    side_by_side,
    wrapped_notes,
)
from autd_analysis.report.wording import factor_label, level_label
from autd_analysis.subject import Others
from autd_analysis.timing.numbers import (
    ParticipantResponseTime,
    TimeSummary,
    Timing,
    response_times,
    response_times_over_participants,
)
from autd_analysis.timing.words import timing_sentences

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANELS_IN = 2.6
_AXIS_IN = 0.52
_MEDIANS_IN = 2.6  # least width of the panel of medians


def figures(found: Timing, results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of timing, where onset lateness or response times were recorded."""
    if found.lateness.values_s or found.people:
        yield ResultFigure(
            "timing",
            "Timing: onsets and response times",
            "Cumulative shares of onset lateness and of each participant's response times, and every "
            "participant's median response time in every condition with the mean over participants and its "
            "95 % t interval, as far as they were recorded. All numbers are in the tables of timing and of "
            "response times.",
            lambda: draw_timing(found, results.trials),
        )


def draw_medians_on(found: Timing, results: Others, axes: "Axes") -> None:
    """Draw the panel of participants' median response times on given axes."""
    if found.people:
        _draw_medians(axes, None, results.trials)


def draw_timing(found: Timing, trials: Trials) -> "Figure":
    """Draw onset lateness, where it was measured, and response times, where there are any."""
    panels = list(_panels(found, trials))
    notes = wrapped_notes(_notes(found))
    axis_in = _AXIS_IN + LINE_IN * max(label.count("\n") for label in _labels(trials.design))
    header_in = HEADER_IN + LINE_IN * legend_rows(shown_factors(trials.design)[1])
    below_in = axis_in + LINE_IN * (len(notes) + 0.6)
    widths = [width for width, _ in panels]
    figure, axes = side_by_side(widths, header_in=header_in, panels_in=_PANELS_IN, below_in=below_in)
    draw_header(figure, trials.design.protocol, "timing", simulated=trials.simulated)
    for panel, letter, (_, draw) in zip(axes, "ABC", panels, strict=False):
        draw(panel, letter)
    draw_notes(figure, notes, below_in - axis_in - 0.9 * LINE_IN)
    return figure


def _panels(found: Timing, trials: Trials) -> "Iterator[tuple[float, Callable[[Axes, str], None]]]":
    """Return the width of each panel that has something to show, and what draws it."""
    if found.lateness.values_s:
        yield 1, lambda axes, letter: _draw_lateness(axes, letter, found.lateness)
    if found.people:
        yield 1, lambda axes, letter: _draw_distributions(axes, letter, found.people)
        yield 1.75, lambda axes, letter: _draw_medians(axes, letter, trials)


def _draw_lateness(axes: "Axes", letter: str, lateness: TimeSummary) -> None:
    _draw_shares(axes, 1000 * np.array(lateness.values_s), INK, 1.4)
    axes.set(xlabel="Onset lateness (ms)", ylabel="Cumulative share of trials", ylim=(0, 1.02))
    axes.grid(visible=True, color=GRID, linewidth=0.6)
    draw_panel_title(axes, letter, "Onset lateness")


def _draw_distributions(axes: "Axes", letter: str, times: Sequence[ParticipantResponseTime]) -> None:
    for time in times:
        _draw_shares(axes, np.array(time.values_s), GREY, 0.8)
    _draw_shares(axes, np.sort(np.concatenate([time.values_s for time in times])), INK, 1.8)
    axes.set(xlabel="Response time (s)", ylabel="Cumulative share of felt trials", ylim=(0, 1.02))
    axes.set_xlim(left=0)
    axes.grid(visible=True, color=GRID, linewidth=0.6)
    draw_panel_title(axes, letter, "Response times")


def _draw_shares(axes: "Axes", ascending: "np.ndarray", colour: str, width: float) -> None:
    axes.ecdf(ascending, color=colour, linewidth=width)


def _draw_medians(axes: "Axes", letter: str | None, trials: Trials) -> None:
    x_factor, colour_factor = shown_factors(trials.design)
    shown = [factor for factor in (x_factor, colour_factor) if factor is not None]
    times = response_times(trials, shown)
    x_label = factor_label(x_factor.name) if x_factor else ""
    prepare_axes(axes, "Median response time (s)", _labels(trials.design), x_label)
    for place, x in enumerate(_levels(x_factor)):
        draw_columns(
            axes,
            place,
            [
                _column(
                    [time for time in times if {*x, *colour} == set(time.condition)],
                    level_style(index) if colour else PLAIN,
                )
                for index, colour in enumerate(_levels(colour_factor))
            ],
        )
    axes.set_ylim(0, 1.06 * axes.dataLim.y1)
    if colour_factor:
        draw_legend(axes, colour_factor)
    if letter:
        draw_panel_title(axes, letter, "Participants' medians")


def _labels(design: Design) -> list[str]:
    x_factor, _ = shown_factors(design)
    labels = [level_label(level) for level in x_factor.levels] if x_factor else ["all stimuli"]
    return fitted_labels(labels, _MEDIANS_IN)


def _levels(factor: StudyFactor | None) -> list[Condition]:
    return [((factor.name, level),) for level in factor.levels] if factor else [()]


def _column(times: Sequence[ParticipantResponseTime], style: Style) -> Column:
    (summary,) = response_times_over_participants(times)
    medians = {time.participant: time.quartiles_s[1] for time in times if time.quartiles_s}
    return Column(medians, summary.mean_s, summary.interval_s, style)


def _notes(found: Timing) -> Iterator[str]:
    times = found.people
    if times:
        answers = sum(len(time.values_s) for time in times)
        yield (
            f"Response times of {answers} felt stimuli (n = {len(times)}). Thin lines: "
            "participants; thick line: all trials. Small markers: participants' medians (lines join the same "
            "one); large markers: mean over participants; bars: its 95 % t interval."
        )
    yield from timing_sentences(found)
