"""The power curve: how likely each planned comparison is found, against the number of participants."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.power.run import PowerRow
from autd_analysis.report.figure_options import DEFAULT
from autd_analysis.report.sheet import Group, Panel, Sheet
from autd_analysis.report.style import GREY, GRID, figure_style, level_style, save_figure
from autd_analysis.report.wording import isolated

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NAMES = {"sign_flip": "Exact sign-flip test", "paired_t": "Paired t test", "mixed_model": "Mixed model"}
_PANEL_IN, _LEAST_IN = 2.6, 1.5
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
    comparisons = list(dict.fromkeys(row.comparison for row in rows))
    with figure_style("".join([protocol, *comparisons])):
        figure = _sheet(rows, comparisons, alpha, protocol, about).draw(DEFAULT)
        return save_figure(figure, folder, "power", DEFAULT.formats)


def _sheet(
    rows: Sequence[PowerRow], comparisons: Sequence[str], alpha: float, protocol: str, about: str
) -> Sheet:
    tests = list(dict.fromkeys(row.test for row in rows))
    panels = [
        Panel(
            lambda axes, test=test: _draw_test(  # type: ignore[misc]
                axes, [row for row in rows if row.test == test], comparisons, alpha
            ),
            _NAMES[test],
        )
        for test in tests
    ]
    return Sheet(
        head=f"{isolated(protocol)}: power",
        simulated=True,
        legend=[(level_style(index), isolated(name)) for index, name in enumerate(comparisons)],
        groups=[
            Group(
                title="Power",
                x_label="Participants",
                y_label="Share of studies that find it",
                panels=panels,
                height_in=_PANEL_IN,
                least_in=_LEAST_IN,
            )
        ],
        caption=_notes(rows, alpha, about),
    )


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
        )
        axes.plot(sizes, [row.false_positives for row in mine], ":", color=style.colour)
    for level in (alpha, _WANTED):
        axes.axhline(level, color=GREY, linewidth=0.8, zorder=0)
    axes.yaxis.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_ylim(0, 1.02)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _notes(rows: Sequence[PowerRow], alpha: float, about: str) -> list[str]:
    studies = sorted({row.studies for row in rows})
    number = str(studies[0]) if len(studies) == 1 else f"{studies[0]} to {studies[-1]}"
    return [
        f"{number} simulated studies at each point. Lines: share that finds the difference at p <= "
        f"{alpha:g}, not adjusted; bands: 95% Wilson intervals of these Monte Carlo shares. Dotted: share "
        f"that finds one where there is none. Horizontal lines: {alpha:g} and {_WANTED:g}.",
        f"People: {about}",
    ]
