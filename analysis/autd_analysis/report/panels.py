"""The panels of the result figure: columns of participants' dots with their mean, on given axes."""

import math
import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.basics.intervals import Interval
from autd_analysis.data.design import StudyFactor
from autd_analysis.report.style import GREY, GRID, Style, level_style
from autd_analysis.report.wording import level_label, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_GROUP_WIDTH = 0.84  # of the distance between two places of the axis
_SPREAD = 0.55  # of a column's slot: what participants with the same value may take side by side
_DOT_POINTS = 4.0  # diameter of a participant's dot
_CHARACTER_IN = 0.075  # mean width of a character of a label
_HANDLE = 6  # what a legend's symbol takes, in characters
_BESIDE_TITLE, _ABOVE_TITLE = 40, 96  # characters that a line of a legend has
_LONGEST_LABEL = 40


@dataclass(frozen=True)
class Column:
    """One value per participant, their mean and its interval; None where undefined."""

    values: Mapping[str, float]
    mean: float | None
    interval: Interval | None
    style: Style


def fitted_labels(labels: Sequence[str], width_in: float) -> list[str]:
    """Return labels of places side by side within a width, broken into at most three lines each."""
    characters = max(6, int(width_in / len(labels) / _CHARACTER_IN))
    return [
        "\n".join(textwrap.wrap(label, characters, max_lines=3, placeholder="\N{HORIZONTAL ELLIPSIS}"))
        for label in labels
    ]


def prepare_axes(axes: "Axes", y_label: str, tick_labels: Sequence[str], x_label: str) -> None:
    """Prepare axes with a place for each label along x, and horizontal lines to read values at."""
    axes.set_xticks(range(len(tick_labels)), tick_labels)
    axes.set_xlim(-0.55, len(tick_labels) - 0.45)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    longest = max(len(line) for label in tick_labels for line in label.split("\n"))
    crowded = longest * _CHARACTER_IN > _size_in(axes)[0] / len(tick_labels)
    axes.tick_params(axis="x", length=0, labelsize=6 if crowded else 8)
    axes.yaxis.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def legend_rows(factor: StudyFactor | None) -> int:
    """Return how many lines a factor's legend takes above the panels' titles; 0 if it fits beside them."""
    labels = _legend_labels(factor) if factor else []
    if sum(len(label) + _HANDLE for label in labels) <= _BESIDE_TITLE:
        return 0
    return math.ceil(len(labels) / _legend_columns(labels))


def draw_legend(axes: "Axes", factor: StudyFactor) -> None:
    """Draw the legend of a factor's levels beside the panel's title, or above it if it is long."""
    from matplotlib.lines import Line2D
    from matplotlib.transforms import blended_transform_factory

    labels = _legend_labels(factor)
    styles = [level_style(index) for index in range(len(labels))]
    handles = [
        Line2D([], [], color=style.colour, marker=style.marker, linewidth=1.8, label=label)
        for style, label in zip(styles, labels, strict=True)
    ]
    above = legend_rows(factor) > 0
    across = blended_transform_factory(axes.figure.transFigure, axes.transAxes)
    axes.legend(
        handles=handles,
        frameon=False,
        loc="lower left" if above else "lower right",
        bbox_to_anchor=(0.06, 1 + 0.26 / _size_in(axes)[1]) if above else (1.01, 0.985),
        bbox_transform=across if above else axes.transAxes,
        ncols=_legend_columns(labels) if above else len(labels),
        fontsize=8,
        columnspacing=1.4,
        handlelength=1.6,
        handletextpad=0.5,
        borderaxespad=0,
    )


def _legend_labels(factor: StudyFactor) -> list[str]:
    return [shortened(level_label(level), _LONGEST_LABEL) for level in factor.levels]


def _legend_columns(labels: Sequence[str]) -> int:
    return max(1, _ABOVE_TITLE // (max(map(len, labels)) + _HANDLE))


def _size_in(axes: "Axes") -> tuple[float, float]:
    """Return width and height of axes in inches."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    box = axes.get_position()
    return figure.get_figwidth() * box.width, figure.get_figheight() * box.height


def draw_columns(axes: "Axes", place: float, columns: Sequence[Column]) -> None:
    """Draw columns side by side around one place of the category axis, each participant joined by a line.

    Parameters
    ----------
    axes
        Where to draw.
    place
        The middle of the group on the category axis.
    columns
        From left to right. The mean stands beside its participants, on the outer side of two columns.
    """
    slot = _GROUP_WIDTH / max(len(columns), 2)
    most_alike = max((n for column in columns for n in Counter(column.values.values()).values()), default=1)
    spacing = min(_dot_width(axes), _SPREAD * slot / most_alike)
    centres = [place + (index - (len(columns) - 1) / 2) * slot for index in range(len(columns))]
    sides = [-1.0 if index < len(columns) / 2 else 1.0 for index in range(len(columns))]
    dots = [
        _dot_positions(column, centre - 0.18 * side * slot, spacing)
        for column, centre, side in zip(columns, centres, sides, strict=True)
    ]
    _join(axes, dots)
    for column, positions, centre, side in zip(columns, dots, centres, sides, strict=True):
        _draw_dots(axes, column, positions)
        _draw_mean(axes, column, centre + 0.27 * side * slot)


def _dot_width(axes: "Axes") -> float:
    """Return the width of a dot on the category axis, whose limits must stand already."""
    low, high = axes.get_xlim()
    return _DOT_POINTS * (high - low) / (72 * _size_in(axes)[0])


def _dot_positions(column: Column, centre: float, spacing: float) -> dict[str, tuple[float, float]]:
    """Return each participant's point; those with the same value stand side by side."""
    shared = Counter(column.values.values())
    placed: Counter[float] = Counter()
    positions = {}
    for participant, value in column.values.items():
        shift = placed[value] - (shared[value] - 1) / 2
        positions[participant] = (centre + spacing * shift, value)
        placed[value] += 1
    return positions


def _join(axes: "Axes", dots: Sequence[Mapping[str, tuple[float, float]]]) -> None:
    for participant in dict.fromkeys(participant for column in dots for participant in column):
        points = [column[participant] for column in dots if participant in column]
        axes.plot(*zip(*points, strict=True), color=GREY, linewidth=0.6, alpha=0.55, zorder=1)


def _draw_dots(axes: "Axes", column: Column, positions: Mapping[str, tuple[float, float]]) -> None:
    if positions:
        x, y = zip(*positions.values(), strict=True)
        axes.scatter(
            x,
            y,
            s=_DOT_POINTS**2,
            marker=column.style.marker,
            color=column.style.colour,
            alpha=0.6,
            linewidths=0,
            zorder=2,
        )


def _draw_mean(axes: "Axes", column: Column, x: float) -> None:
    if column.mean is None:
        return
    if column.interval is not None:
        axes.vlines(
            x, column.interval.low, column.interval.high, color=column.style.colour, linewidth=1.8, zorder=3
        )
    axes.plot(
        x,
        column.mean,
        marker=column.style.marker,
        markersize=7,
        color=column.style.colour,
        markeredgecolor="white",
        markeredgewidth=0.8,
        linestyle="none",
        zorder=4,
    )
