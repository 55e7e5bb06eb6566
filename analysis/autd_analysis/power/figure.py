"""The power curve: how likely each planned comparison is found, against the number of participants."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.power.run import PowerRow
from autd_analysis.report.style import (
    GREY,
    GRID,
    HEADER_IN,
    LINE_IN,
    WIDTH_IN,
    draw_header,
    draw_notes,
    draw_panel_title,
    figure_style,
    level_style,
    save_figure,
    wrapped_notes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NAMES = {"sign_flip": "Exact sign-flip test", "paired_t": "Paired t test", "mixed_model": "Mixed model"}
_PANELS_IN, _AXIS_IN = 2.8, 0.52
_WANTED = 0.8


def draw_power(rows: Sequence[PowerRow], alpha: float, protocol: str, about: str, folder: Path) -> list[Path]:
    """Draw a panel for each test into ``power.png``, ``power.svg`` and ``power.pdf``.

    Parameters
    ----------
    rows
        The power of every test, comparison and size.
    alpha
        Level of significance.
    protocol
        Which studies were simulated.
    about
        What was assumed of the people.
    folder
        An existing folder.
    """
    with figure_style():
        return save_figure(_draw(rows, alpha, protocol, about), folder, "power")


def _draw(rows: Sequence[PowerRow], alpha: float, protocol: str, about: str) -> "Figure":
    from matplotlib.figure import Figure

    tests = list(dict.fromkeys(row.test for row in rows))
    comparisons = list(dict.fromkeys(row.comparison for row in rows))
    notes = wrapped_notes(_notes(rows, alpha, about))
    header_in = HEADER_IN + LINE_IN * len(comparisons)
    below_in = _AXIS_IN + LINE_IN * (len(notes) + 0.6)
    height_in = header_in + _PANELS_IN + below_in
    figure = Figure(figsize=(WIDTH_IN, height_in))
    panels = figure.subplots(1, len(tests), sharey=True, squeeze=False)[0]
    figure.subplots_adjust(
        left=0.075, right=0.985, top=1 - header_in / height_in, bottom=below_in / height_in, wspace=0.1
    )
    draw_header(figure, protocol, "power", simulated=True)
    for axes, letter, test in zip(panels, "ABC", tests, strict=False):
        _draw_test(axes, [row for row in rows if row.test == test], comparisons, alpha)
        draw_panel_title(axes, letter, _NAMES[test])
    panels[0].set_ylabel("Share of studies that find it")
    figure.legend(
        handles=panels[0].get_lines()[: 2 * len(comparisons) : 2],
        frameon=False,
        loc="upper left",
        bbox_to_anchor=(0.065, 1 - (HEADER_IN - 0.3) / height_in),
        fontsize=8,
        borderaxespad=0,
    )
    draw_notes(figure, notes, below_in - _AXIS_IN - 0.9 * LINE_IN)
    return figure


def _draw_test(axes: "Axes", rows: Sequence[PowerRow], comparisons: Sequence[str], alpha: float) -> None:
    from matplotlib.ticker import MaxNLocator

    for index, comparison in enumerate(comparisons):
        mine = [row for row in rows if row.comparison == comparison]
        sizes = [row.participants for row in mine]
        intervals = [row.power_interval for row in mine]
        low = [interval.low for interval in intervals if interval]
        high = [interval.high for interval in intervals if interval]
        style = level_style(index)
        axes.fill_between(sizes, low, high, color=style.colour, alpha=0.25, linewidth=0)
        axes.plot(
            sizes,
            [row.power for row in mine],
            color=style.colour,
            marker=style.marker,
            markersize=4,
            linewidth=1.4,
            label=comparison,
        )
        axes.plot(sizes, [row.false_positives for row in mine], ":", color=style.colour)
    for level in (alpha, _WANTED):
        axes.axhline(level, color=GREY, linewidth=0.8, zorder=0)
    axes.yaxis.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set(xlabel="Participants", ylim=(0, 1.02))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _notes(rows: Sequence[PowerRow], alpha: float, about: str) -> list[str]:
    studies = sorted({row.studies for row in rows})
    number = str(studies[0]) if len(studies) == 1 else f"{studies[0]} to {studies[-1]}"
    return [
        f"{number} simulated studies at each point. Lines: share that finds the difference at p <= "
        f"{alpha:g}, not adjusted; bands: 95 % Wilson intervals of these Monte Carlo shares. Dotted: share "
        f"that finds one where there is none. Horizontal lines: {alpha:g} and {_WANTED:g}.",
        f"People: {about}",
    ]
