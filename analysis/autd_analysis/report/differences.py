"""Panels of paired differences: of rates, of thresholds, of whatever was compared within participants."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.data.contrasts import Contrast
from autd_analysis.report.facets import Facets
from autd_analysis.report.panels import Column, draw_places, prepare_axes
from autd_analysis.report.sheet import Group, Panel
from autd_analysis.report.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PANEL_IN, _FACET_IN = 2.6, 1.7
_PLACE_IN = 0.3  # least width of a place

Difference = tuple[Contrast, Column]
"""What was compared where, and the differences."""


def draw_differences(axes: "Axes", differences: Sequence[Difference], facets: Facets, label: str) -> None:
    """Draw participants' differences between the same two levels into axes.

    Parameters
    ----------
    axes
        Where to draw.
    differences
        One for each place along the axis.
    facets
        What everything is called.
    label
        What the differences are of.
    """
    prepare_axes(axes, label, _ticks(differences, facets), _axis(differences, facets))
    axes.axhline(0, color=INK, linewidth=0.7)
    draw_places(axes, [[column] for _, column in differences])


def difference_groups(differences: Sequence[Difference], facets: Facets, label: str) -> Iterator[Group]:
    """Yield groups of panels: a panel for each pair of levels, a group for each kind of place.

    Parameters
    ----------
    differences
        All that were planned.
    facets
        What everything is called.
    label
        What the differences are of.
    """
    alike: dict[tuple[str, ...], list[list[Difference]]] = {}
    for family in _families(differences):
        alike.setdefault((_axis(family, facets), *_ticks(family, facets)), []).append(family)
    limits = _limits([column for _, column in differences])
    for (x_label, *ticks), its_families in alike.items():
        single = len(its_families) == 1 and not facets.panels and not facets.apart
        yield Group(
            title="Paired difference",
            x_label=x_label,
            y_label=label,
            panels=[_panel(family, facets, label, limits) for family in its_families],
            height_in=_PANEL_IN if single else _FACET_IN,
            least_in=max(0.8, _PLACE_IN * len(ticks)),
            ticks=ticks,
            weight=2 * len(ticks),
        )


def _panel(family: Sequence[Difference], facets: Facets, label: str, limits: tuple[float, float]) -> Panel:
    contrast, _ = family[0]

    def draw(axes: "Axes") -> None:
        draw_differences(axes, family, facets, label)
        axes.set_ylim(*limits)

    return Panel(draw, facets.labels.difference(contrast))


def _families(differences: Sequence[Difference]) -> list[list[Difference]]:
    """Return differences between the same two levels at the levels of the same factor, together."""
    found: dict[tuple[Contrast, str | None], list[Difference]] = {}
    for each in differences:
        contrast, _ = each
        found.setdefault((contrast.overall, contrast.over), []).append(each)
    return list(found.values())


def _limits(columns: Sequence[Column]) -> tuple[float, float]:
    """Return the same limits for all panels, zero within."""
    ends = [0.0]
    for column in columns:
        ends += column.values.values()
        ends += [column.interval.low, column.interval.high] if column.interval else []
    low, high = min(ends), max(ends)
    margin = 0.06 * ((high - low) or 1.0)
    return low - margin, high + margin


def _ticks(differences: Sequence[Difference], facets: Facets) -> list[str]:
    """Return where each difference is; in full if they are not of the same two levels."""
    labels = facets.labels
    if len(_families(differences)) > 1:
        return [labels.contrast(contrast) for contrast, _ in differences]
    return [
        ", ".join(labels.level(name, level) for name, level in contrast.at) or "overall"
        for contrast, _ in differences
    ]


def _axis(differences: Sequence[Difference], facets: Facets) -> str:
    contrast, _ = differences[0]
    alike = len(_families(differences)) == 1
    return facets.labels.title(contrast.over) if alike and contrast.over else ""
