"""The picture of a calibration: the points in space, and their residuals over time, per axis."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from autd_trials.acoustics.field_figure import save_figure
from autd_trials.array.geometry import Vectors
from autd_trials.calibration.solve import Solution

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_MOST_DRAWN = 1500
_UNIT_CORNERS_MM = np.array([[0, 0, 0], [557, 0, 0], [557, 435, 0], [0, 435, 0], [0, 0, 0]], dtype=np.float64)


def draw_calibration(solution: Solution, stem: Path) -> list[Path]:
    """Draw into ``stem.png`` and ``stem.svg``; return both."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 6), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.1, 1))
    _draw_space(solution, figure.add_subplot(grid[:, 0], projection="3d"))
    panels = [figure.add_subplot(grid[row, 1]) for row in range(3)]
    for axis, axes in enumerate(panels):
        _draw_residuals(solution, axis, axes)
    panels[-1].set_xlabel("row" if solution.time_s is None else "time (s)")
    figure.suptitle(_title(solution), x=0.01, ha="left", fontsize=10)
    return save_figure(figure, stem)


def _draw_space(solution: Solution, axes: "Axes3D") -> None:
    step = max(1, solution.places_mm.shape[1] // _MOST_DRAWN)
    right = ~np.isnan(solution.places_mm[:, :, 0])
    shared = right.sum(axis=0) > 1
    middles = np.nanmean(solution.places_mm[:, shared], axis=0)[::step]
    axes.scatter(*_upright(middles), s=2, color="0.4", alpha=0.4, label="target")
    for unit, colour in zip(solution.calibration.unit_poses(), _COLOURS, strict=False):
        corners = _UNIT_CORNERS_MM @ unit.rotation.T + unit.translation_mm
        axes.plot(*_upright(corners), color=colour, label=unit.name)
        arrow = np.array([unit.centre_mm, unit.centre_mm + 300 * unit.axis])
        axes.plot(*_upright(arrow), color=colour, linewidth=0.8)
    axes.set(xlabel="x (mm)", ylabel="z (mm)", zlabel="y (mm)")
    axes.set_aspect("equal")
    axes.set_box_aspect(None, zoom=0.85)
    axes.legend(frameon=False, loc="upper left", fontsize=8)


def _upright(points_mm: Vectors) -> tuple[Vectors, Vectors, Vectors]:
    """Return coordinates as they are drawn: y upwards."""
    return points_mm[:, 0], points_mm[:, 2], points_mm[:, 1]


def _draw_residuals(solution: Solution, axis: int, axes: "Axes") -> None:
    rows = np.arange(solution.places_mm.shape[1], dtype=np.float64)
    along = rows if solution.time_s is None else solution.time_s - solution.time_s[0]
    for unit in range(1, len(solution.calibration.units)):
        gaps_mm = solution.gaps_mm(unit)[:, axis]
        rms_mm = float(np.sqrt(np.nanmean(gaps_mm**2)))
        name = solution.calibration.units[unit].name
        axes.plot(
            along,
            gaps_mm,
            ".",
            markersize=2,
            color=_COLOURS[unit % len(_COLOURS)],
            label=f"{name}: {rms_mm:.2f} mm rms",
        )
    axes.axhline(0, color="0.6", linewidth=0.8)
    axes.set_ylabel(f"{'xyz'[axis]} residual (mm)")
    axes.legend(frameon=False, fontsize=8, loc="upper right", ncols=2)


def _title(solution: Solution) -> str:
    energy = solution.calibration.predicted_energy
    title = f"{solution.cloud.points} points, {solution.calibration.time:%Y-%m-%d %H:%M}"
    if energy is None:
        return title
    return (
        f"{title}: energy left at the target {energy.mean:.3f} "
        f"(90 % within {energy.low:.3f} to {energy.high:.3f}; from the points alone)"
    )
