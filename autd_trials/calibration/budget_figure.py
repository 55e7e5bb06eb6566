"""The picture of an error budget: energy left at the target against pose errors."""

from collections.abc import Sequence
from pathlib import Path

from autd_trials.acoustics.field_figure import save_figure
from autd_trials.calibration.pose_error import QUANTILES, ErrorCost

_LABELS = {"position_mm": "position error (mm)", "angle_deg": "angle error (degrees)"}
_COLOUR = "#0072B2"


def draw_error_budget(costs: Sequence[ErrorCost], title: str, stem: Path) -> list[Path]:
    """Draw mean and quantiles against the errors' sizes into ``stem.png`` and ``stem.svg``; return both."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (kind, label) in zip(panels, _LABELS.items(), strict=True):
        shown = [cost for cost in costs if cost.kind == kind]
        sizes = [cost.size for cost in shown]
        quantiles = list(zip(*(cost.quantiles for cost in shown), strict=True))
        for low, high, shade in ((0, 4, 0.15), (1, 3, 0.3)):
            name = f"{QUANTILES[low]:.0%} to {QUANTILES[high]:.0%}"
            axes.fill_between(
                sizes, quantiles[low], quantiles[high], alpha=shade, color=_COLOUR, label=name, linewidth=0
            )
        axes.plot(sizes, quantiles[2], "-", color=_COLOUR, label="median")
        axes.plot(sizes, [cost.mean for cost in shown], "ko", markersize=4, label="mean")
        axes.set(xscale="log", xlabel=label, ylim=(0, 1.02))
        axes.set_xticks(sizes, [f"{size:g}" for size in sizes], minor=False)
        axes.minorticks_off()
        axes.grid(axis="y", alpha=0.3)
    panels[0].set_ylabel("energy left at the target")
    panels[1].legend(frameon=False, loc="lower left")
    figure.suptitle(title, x=0.01, ha="left", fontsize=10)
    return save_figure(figure, stem)
