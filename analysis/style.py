"""What the result figures have in common: their look, their heading, and how they are saved."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.panels import INK
from analysis.study import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")

WIDTH_IN = 7.2
"""Two columns of a journal."""

_SIGNAL = "#B00020"
# Metadata that would differ from run to run is left out, so that the same results give the same bytes.
_METADATA: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same on every machine
    "font.size": 8,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "pdf.fonttype": 42,
    "svg.hashsalt": "autd_trials",
}


def save_drawing(draw: Callable[[], "Figure"], folder: Path, stem: str) -> list[Path]:
    """Draw a figure in the common style and save it as PNG (300 dpi), SVG and PDF.

    Parameters
    ----------
    draw
        Draws it.
    folder
        An existing folder.
    stem
        The files' name without its ending.

    Returns
    -------
    list of Path
        The files. The same drawing gives the same bytes.
    """
    import matplotlib as mpl

    files = [folder / f"{stem}.{kind}" for kind in FORMATS]
    with mpl.rc_context(_STYLE):
        figure = draw()
        for kind, file in zip(FORMATS, files, strict=True):
            half = file.with_name(f".{file.name}.part")
            figure.savefig(half, format=kind, dpi=300, metadata=_METADATA[kind])
            half.replace(file)
    return files


def draw_header(figure: "Figure", results: Results, y: float) -> None:
    """Write whose figure it is, and in red if participants were simulated."""
    trials = int(results.trials.table["used"].sum())
    people = len(results.trials.participants)
    figure.text(
        0.012,
        y,
        f"{results.trials.design.protocol}: {people} participant{'s' * (people != 1)}, {trials} trials",
        fontsize=9,
        fontweight="bold",
        va="center",
    )
    if results.simulated:
        figure.text(
            0.985,
            y,
            "SIMULATED PARTICIPANTS \N{EM DASH} not human data",
            fontsize=8,
            fontweight="bold",
            color=_SIGNAL,
            ha="right",
            va="center",
            bbox={"boxstyle": "round,pad=0.35", "facecolor": "none", "edgecolor": _SIGNAL, "linewidth": 0.8},
        )


def draw_title(axes: "Axes", letter: str, text: str) -> None:
    """Write a panel's letter and title."""
    axes.set_title(f"$\\bf{{{letter}}}$  {text}", loc="left", fontsize=8)
