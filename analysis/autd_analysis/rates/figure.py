"""The figure of rates: every participant in every condition, and the means over participants."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.data.design import Design, StudyFactor, shown_factors
from autd_analysis.rates.numbers import ParticipantRate, Rates, marginal_rates, over_participants
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
    HEADER_IN,
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
from autd_analysis.report.wording import factor_label, level_label, size_words
from autd_analysis.subject import Others

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANELS_IN = 3.0
AXIS_IN = 0.52  # tick and axis labels
_WIDTH_IN = 3.6


def figures(rates: Rates, results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of rates; not where an adaptive method steered them all to the same."""
    if results.trials.design.method is None:
        yield ResultFigure(
            "rates",
            "Detection rates",
            "The detection rate of every participant in every condition as a dot, with the mean over "
            "participants and its 95 % t interval. All numbers are in the tables of rates.",
            lambda: draw_rates(rates, results),
        )


def draw_rates(rates: Rates, results: Others) -> "Figure":
    """Draw the figure of rates alone, within `autd_analysis.report.style.figure_style`."""
    design = results.trials.design
    labels = rate_labels(rates, design)
    notes = wrapped_notes(rate_notes(rates, results))
    axis_in = AXIS_IN + LINE_IN * max(label.count("\n") for label in labels)
    below_in = axis_in + LINE_IN * (len(notes) + 0.6)
    header_in = HEADER_IN + LINE_IN * legend_rows(shown_factors(design)[1])
    figure, axes = side_by_side((1,), header_in=header_in, panels_in=PANELS_IN, below_in=below_in, right=0.62)
    draw_header(figure, design.protocol, size_words(results.trials), simulated=results.trials.simulated)
    draw_rates_panel(axes[0], rates, design, labels)
    draw_notes(figure, notes, below_in - axis_in - 0.9 * LINE_IN)
    return figure


def draw_rates_on(rates: Rates, results: Others, axes: "Axes") -> None:
    """Draw the panel of rates on given axes."""
    design = results.trials.design
    draw_rates_panel(axes, rates, design, rate_labels(rates, design), title=False)


def rate_labels(rates: Rates, design: Design) -> list[str]:
    """Return the labels of the places of the panel's axis."""
    x_factor, _ = shown_factors(design)
    labels = [level_label(level) for level in x_factor.levels] if x_factor else ["all stimuli"]
    if rates.participant_false_alarms is not None:
        labels.append("catch trials")
    return fitted_labels(labels, _WIDTH_IN)


def draw_rates_panel(
    axes: "Axes", rates: Rates, design: Design, labels: Sequence[str], *, title: bool = True
) -> None:
    """Draw the panel of rates."""
    x_factor, colour_factor = shown_factors(design)
    shown = [factor for factor in (x_factor, colour_factor) if factor is not None]
    groups = _groups(marginal_rates(rates.participants, shown), x_factor, colour_factor)
    if rates.participant_false_alarms is not None:
        catch_colour = colour_factor if colour_factor and not colour_factor.within_block else None
        kept = [catch_colour] if catch_colour else []
        cells = [rate for rate in rates.participant_false_alarms if bool(rate.condition) == bool(kept)]
        groups += _groups(marginal_rates(cells, kept), None, catch_colour)
    prepare_axes(
        axes, "Detection rate (felt / trials)", labels, factor_label(x_factor.name) if x_factor else ""
    )
    axes.set_ylim(-0.04, 1.04)
    for place, columns in enumerate(groups):
        draw_columns(axes, place, columns)
    if colour_factor:
        draw_legend(axes, colour_factor)
    if title:
        draw_panel_title(axes, "A", "Detection rate")


def rate_notes(rates: Rates, results: Others, about_differences: Sequence[str] = ()) -> Iterator[str]:
    """Yield what one must know to read the panel, and one of differences beside it."""
    design = results.trials.design
    yield (
        f"Small markers: participants (n = {len(results.trials.participants)}; lines join the same one). "
        "Large markers: mean over participants; bars: its 95 % t interval."
    )
    yield from about_differences
    averaged = [factor.name for factor in design.factors if factor not in shown_factors(design)]
    if averaged:
        yield f"Rates in A are averaged over {', '.join(averaged)}."
    if rates.false_alarms is None:
        yield "No catch trials: the false-alarm rate is undefined."
    if results.remarks:
        yield f"{len(results.remarks)} remark(s) on the data: see README.md beside this figure."


def _groups(
    rates: Sequence[ParticipantRate], x_factor: StudyFactor | None, colour_factor: StudyFactor | None
) -> list[list[Column]]:
    """Return the columns to draw at each place of the axis."""
    return [
        [
            _column(
                [rate for rate in rates if {*x, *colour} == set(rate.condition)],
                level_style(index) if colour else PLAIN,
            )
            for index, colour in enumerate(_pairs(colour_factor))
        ]
        for x in _pairs(x_factor)
    ]


def _pairs(factor: StudyFactor | None) -> list[tuple[tuple[str, float | str], ...]]:
    return [((factor.name, level),) for level in factor.levels] if factor else [()]


def _column(rates: Sequence[ParticipantRate], style: Style) -> Column:
    """Return the column of participants' rates in one condition."""
    summaries = over_participants(rates)
    return Column(
        values={rate.participant: float(rate.rate) for rate in rates if rate.rate is not None},
        mean=summaries[0].mean if summaries else None,
        interval=summaries[0].interval if summaries else None,
        style=style,
    )
