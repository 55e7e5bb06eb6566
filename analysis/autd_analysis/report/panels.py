"""What panels are drawn with: columns of participants' dots with their mean, joined from column to column."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.basics.intervals import Interval
from autd_analysis.report.lettering import tick_labels
from autd_analysis.report.style import GREY, GRID, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_GROUP_WIDTH = 0.84  # of the distance between two places of the axis
_WIDEST_SLOT_IN = 0.62  # what a column takes at most: in a wide panel, columns of a place stay together
_SPREAD = 0.55  # of a column's slot: what participants with the same value may take side by side
_DOT_POINTS, _SMALLEST_DOT = 4.0, 1.6  # diameter of a participant's dot
_MEAN_POINTS, _SMALLEST_MEAN = 7.0, 3.0
_FEW = 8  # participants whose lines are drawn at full darkness
_POINTS_PER_INCH = 72


@dataclass(frozen=True)
class Column:
    """One value per participant, their mean and its interval; None where undefined."""

    values: Mapping[str, float]
    mean: float | None
    interval: Interval | None
    style: Style


def prepare_axes(axes: "Axes", y_label: str, labels: Sequence[str], x_label: str) -> None:
    """Prepare axes with a place for each label along x, and horizontal lines to read values at."""
    fitted = tick_labels(labels, _width_in(axes) / len(labels))
    axes.set_xticks(range(len(labels)), fitted.texts, rotation=90 if fitted.upright else 0)
    axes.set_xlim(-0.5, len(labels) - 0.5)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.tick_params(axis="x", length=0, labelsize=fitted.size)
    axes.tick_params(axis="y", which="both", labelsize=7)
    for label in axes.get_xticklabels():
        label.set_linespacing(1.0)
    axes.yaxis.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def draw_places(axes: "Axes", places: Sequence[Sequence[Column]], first: float = 0) -> None:
    """Draw columns at places along the category axis, each participant joined by a thin line.

    Parameters
    ----------
    axes
        Where to draw; its limits must stand already.
    places
        The columns of each place, from left to right. Lines join the columns of a place; where each place has
        one column, they join the places.
    first
        The first place on the axis.
    """
    drawn = [_placed(axes, first + place, columns) for place, columns in enumerate(places)]
    if all(len(columns) <= 1 for columns in places):
        _join(axes, [dots for place in drawn for dots, _ in place])
    else:
        for place in drawn:
            _join(axes, [dots for dots, _ in place])
    for place, columns in zip(drawn, places, strict=True):
        points = _slot_in(axes, len(columns)) * _POINTS_PER_INCH
        for (dots, mean_x), column in zip(place, columns, strict=True):
            _draw_dots(axes, column, dots, points)
            _draw_mean(axes, column, mean_x, points)


def _placed(
    axes: "Axes", place: float, columns: Sequence[Column]
) -> list[tuple[dict[str, tuple[float, float]], float]]:
    """Return the participants' points of each column, and where its mean stands: on its outer side."""
    unit_in = _width_in(axes) / abs(axes.get_xlim()[1] - axes.get_xlim()[0])
    slot = _slot_in(axes, len(columns)) / unit_in
    alike = max((n for column in columns for n in Counter(column.values.values()).values()), default=1)
    dot = _dot_points(slot * unit_in * _POINTS_PER_INCH) / _POINTS_PER_INCH / unit_in
    spacing = min(dot, _SPREAD * slot / alike)
    placed = []
    for index, column in enumerate(columns):
        centre = place + (index - (len(columns) - 1) / 2) * slot
        side = -1.0 if index < len(columns) / 2 else 1.0
        placed.append((_dots(column, centre - 0.18 * side * slot, spacing), centre + 0.27 * side * slot))
    return placed


def _slot_in(axes: "Axes", columns: int) -> float:
    """Return the width of a column in inches."""
    place_in = _width_in(axes) / abs(axes.get_xlim()[1] - axes.get_xlim()[0])
    return min(_GROUP_WIDTH * place_in / max(columns, 2), _WIDEST_SLOT_IN)


def _dots(column: Column, centre: float, spacing: float) -> dict[str, tuple[float, float]]:
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
    from matplotlib.collections import LineCollection

    people = list(dict.fromkeys(participant for column in dots for participant in column))
    lines = [[column[participant] for column in dots if participant in column] for participant in people]
    alpha = 0.55 * max(0.2, min(1.0, _FEW / max(1, len(people))))
    joined = [line for line in lines if len(line) > 1]
    if joined:
        axes.add_collection(
            LineCollection(joined, color=GREY, linewidth=0.6, alpha=alpha, zorder=1), autolim=False
        )


def _draw_dots(
    axes: "Axes", column: Column, positions: Mapping[str, tuple[float, float]], slot_points: float
) -> None:
    if positions:
        x, y = zip(*positions.values(), strict=True)
        axes.scatter(
            x,
            y,
            s=_dot_points(slot_points) ** 2,
            marker=column.style.marker,
            facecolor=column.style.fill,
            edgecolor=column.style.colour,
            alpha=0.6,
            linewidths=0.5 if column.style.hollow else 0,
            zorder=2,
        )


def _draw_mean(axes: "Axes", column: Column, x: float, slot_points: float) -> None:
    if column.mean is None:
        return
    size = max(_SMALLEST_MEAN, min(_MEAN_POINTS, 0.55 * slot_points))
    if column.interval is not None:
        axes.vlines(
            x,
            column.interval.low,
            column.interval.high,
            color=column.style.colour,
            linewidth=1.8 * size / _MEAN_POINTS,
            zorder=3,
        )
    axes.plot(
        x,
        column.mean,
        marker=column.style.marker,
        markersize=size,
        color=column.style.colour,
        markerfacecolor=column.style.fill,
        markeredgecolor=column.style.colour if column.style.hollow else "white",
        markeredgewidth=0.8,
        linestyle="none",
        zorder=4,
    )


def _dot_points(slot_points: float) -> float:
    return max(_SMALLEST_DOT, min(_DOT_POINTS, 0.3 * slot_points))


def _width_in(axes: "Axes") -> float:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return float(figure.get_figwidth() * axes.get_position().width)
