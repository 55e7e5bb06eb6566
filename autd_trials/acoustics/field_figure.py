"""Pictures of the field: planes through foci, as in the paper's Fig. 8, and a scan beside its prediction."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.field import Progress, grid_pressure
from autd_trials.acoustics.focus_metrics import PLANES, FocusMetrics
from autd_trials.acoustics.grid import Grid, box_grid
from autd_trials.acoustics.level import energy_density_j_m3
from autd_trials.acoustics.scan import Scan, ScanComparison
from autd_trials.acoustics.sources import Medium, Sources

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN = 3.0
_DOTS_PER_INCH = 120
_COLOURS = "magma"
_THRESHOLD = 2**-0.5


@dataclass(frozen=True, eq=False)
class FocusPicture:
    """A focus with its name, its metrics and the energy densities on the planes through it."""

    name: str
    metrics: FocusMetrics
    planes: dict[str, tuple[Grid, NDArray[np.float64]]]


def take_picture(
    name: str,
    sources: Sources,
    air: Air,
    metrics: FocusMetrics,
    *,
    width_mm: float,
    step_mm: float,
    progress: Progress | None = None,
) -> FocusPicture:
    """Compute the energy densities on the three planes through a focus.

    Parameters
    ----------
    name
        What the focus is called.
    sources, air
        What emits into what.
    metrics
        The focus; the planes pass through where it was asked for.
    width_mm, step_mm
        Size and resolution of the planes in mm.
    progress
        Told how far each plane is.
    """
    medium = Medium.of(air)
    planes = {}
    for plane, axes in PLANES.items():
        centre_mm = np.array(metrics.focus_mm)
        grid = box_grid(centre_mm, np.eye(3)[list(axes)], width_mm=width_mm, step_mm=step_mm)
        planes[plane] = (grid, energy_density_j_m3(grid_pressure(sources, medium, grid, progress), air))
    return FocusPicture(name, metrics, planes)


def draw_foci(pictures: Sequence[FocusPicture], title: str, notes: Sequence[str], stem: Path) -> list[Path]:
    """Draw a row of planes for each focus into ``stem.png`` and ``stem.svg``; return both."""
    from matplotlib.figure import Figure

    rows = len(pictures)
    height_in = _PANEL_IN * rows + 0.5 + 0.22 * (len(notes) + 1)
    figure = Figure(figsize=(3 * _PANEL_IN + 2.4, height_in), layout="constrained")
    axes = figure.subplots(rows, len(PLANES), squeeze=False)
    for row, picture in zip(axes, pictures, strict=True):
        for place, plane in zip(row, PLANES, strict=True):
            _draw_plane(place, picture, plane)
    figure.suptitle(title, x=0.01, ha="left", weight="bold")
    figure.supxlabel("\n".join((_LEGEND, *notes)), x=0.01, ha="left", fontsize=8)
    return save_figure(figure, stem)


def draw_scan(scan: Scan, predicted_pa: NDArray[np.float64], found: ScanComparison, stem: Path) -> list[Path]:
    """Draw measured and predicted rms pressures of a scan, projected along its thinnest direction.

    Parameters
    ----------
    scan
        What was measured.
    predicted_pa
        The rms pressures predicted at the same points, neither moved nor scaled, shape (n,).
    found
        What the comparison said.
    stem
        Path without a suffix.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2 * _PANEL_IN + 3, _PANEL_IN + 1.2), layout="constrained")
    spans = np.ptp(scan.points_mm, axis=0)
    first, second = sorted(np.argsort(spans)[-2:])
    names = "xyz"
    largest = max(scan.rms_pa.max(), predicted_pa.max())
    for axes, title, values in zip(
        figure.subplots(1, 2), ("measured", "predicted"), (scan.rms_pa, predicted_pa), strict=True
    ):
        order = np.argsort(values)  # the strongest on top
        drawn = axes.scatter(
            *scan.points_mm[order][:, [first, second]].T,
            c=values[order],
            s=9,
            cmap=_COLOURS,
            vmin=0,
            vmax=largest,
        )
        axes.set(title=title, xlabel=f"{names[first]} (mm)", ylabel=f"{names[second]} (mm)", aspect="equal")
        figure.colorbar(drawn, ax=axes, label="rms pressure (Pa)")
    shift = ", ".join(f"{x:.1f}" for x in found.shift_mm)
    words = f"moved by ({shift}) mm, {found.level_db:+.1f} dB; residual {found.residual:.0%}"
    figure.supxlabel(f"measured = predicted, {words}", x=0.01, ha="left", fontsize=9)
    return save_figure(figure, stem)


def save_figure(figure: "Figure", stem: Path) -> list[Path]:
    """Write a figure as ``stem.png`` and ``stem.svg``, the same bytes for the same content; return both."""
    import matplotlib as mpl

    paths = [stem.with_name(f"{stem.name}.{suffix}") for suffix in ("png", "svg")]
    with mpl.rc_context({"svg.hashsalt": "autd_trials"}):
        figure.savefig(paths[0], dpi=_DOTS_PER_INCH)
        figure.set_layout_engine("none")  # keeps the places that were found, which takes half of the time
        figure.savefig(paths[1], metadata={"Date": None})
    return paths


_LEGEND = (
    "White line: 1 / sqrt 2 of the largest energy density; sizes are of the region around the maximum. "
    "+: where the focus was asked for; o: the maximum. e = p_rms^2 / (rho c^2)."
)


def _draw_plane(axes: "Axes", picture: FocusPicture, plane: str) -> None:
    grid, energy = picture.planes[plane]
    first, second = PLANES[plane]
    origin, last = grid.origin_mm, grid.points_mm[-1]
    image = axes.imshow(
        energy.T,
        origin="lower",
        extent=(origin[first], last[first], origin[second], last[second]),
        cmap=_COLOURS,
        vmin=0,
        vmax=picture.metrics.energy_density_max_j_m3,
        interpolation="bilinear",
    )
    across = np.linspace(origin[first], last[first], grid.counts[0])
    up = np.linspace(origin[second], last[second], grid.counts[1])
    level = _THRESHOLD * picture.metrics.energy_density_max_j_m3
    if energy.max() > level:
        axes.contour(across, up, energy.T, levels=[level], colors="white", linewidths=0.8)
    for place, marker in ((picture.metrics.focus_mm, "+"), (picture.metrics.maximum_mm, "o")):
        axes.plot(place[first], place[second], marker, color="#56B4E9", markersize=7, fillstyle="none")
    axes.set(xlabel=f"{plane[0]} (mm)", ylabel=f"{plane[1]} (mm)")
    axes.set_title(
        f"{picture.name}, {plane}: {picture.metrics.diameters_mm[plane]:.1f} mm across", fontsize=9
    )
    assert axes.figure is not None
    axes.figure.colorbar(image, ax=axes, label="e (J/m³)", shrink=0.8)
