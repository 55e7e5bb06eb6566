"""How every figure looks, and how it is saved: the same results give the same bytes."""

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_analysis.report.wording import shortened
from autd_trials.records.disk import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
WIDTH_IN = 7.2  # two columns of a journal
HEADER_IN = 0.66
LINE_IN = 0.17
"""Height of a line of text below a figure in inches."""
LEFT, RIGHT = 0.012, 0.985
"""Where texts of a figure begin and end, of its width."""

INK = "#222222"
GREY = "#8A8A8A"
GRID = "#E6E6E6"

_NOTE = "#444444"
_NOTE_CHARACTERS = 138
_SIGNAL = "#B00020"
# Okabe and Ito's colours, which are told apart with any colour vision; the markers repeat the distinction.
_STYLES = (
    ("#0072B2", "o"),
    ("#D55E00", "s"),
    ("#009E73", "^"),
    ("#CC79A7", "D"),
    ("#E69F00", "v"),
    ("#56B4E9", "P"),
)
# Metadata that would differ from run to run is left out, so that the same results give the same bytes.
_METADATA: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
_FONT = "DejaVu Sans"  # comes with matplotlib: the same on every machine
_OTHER_FONTS = ("Noto Sans CJK JP", "IPAexGothic", "Hiragino Sans", "Yu Gothic", "Noto Sans CJK SC")
"""Where installed, for the letters that the first has not, as Japanese names of levels."""

_RC: dict[Any, Any] = {
    "font.size": 8,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "text.color": INK,
    "text.parse_math": False,  # a dollar in a label is a dollar
    "xtick.color": INK,
    "ytick.color": INK,
    "pdf.fonttype": 42,  # journals refuse matplotlib's default, Type 3
    "svg.hashsalt": "autd_trials",
}


@dataclass(frozen=True)
class Style:
    """Colour and marker of a column or a line."""

    colour: str
    marker: str


PLAIN = Style(INK, "o")


def level_style(index: int) -> Style:
    """Return the style of a factor's level by its place in the list of levels."""
    return Style(*_STYLES[index % len(_STYLES)])


def side_by_side(
    widths: Sequence[float], *, header_in: float, panels_in: float, below_in: float, right: float = RIGHT
) -> "tuple[Figure, list[Axes]]":
    """Return a figure two columns wide with panels side by side, and the panels.

    Parameters
    ----------
    widths
        The panels' widths to each other.
    header_in, panels_in, below_in
        Heights in inches: of the header, of the panels, and of axis labels and texts below them.
    right
        Where the last panel ends, of the figure's width.
    """
    from matplotlib.figure import Figure

    height_in = header_in + panels_in + below_in
    figure = Figure(figsize=(WIDTH_IN, height_in))
    grid = figure.add_gridspec(
        1,
        len(widths),
        width_ratios=widths,
        left=0.08,
        right=right,
        top=1 - header_in / height_in,
        bottom=below_in / height_in,
        wspace=0.27,
    )
    return figure, [figure.add_subplot(grid[0, place]) for place in range(len(widths))]


def figure_style() -> Any:
    """Return the context within which figures are drawn and saved."""
    import matplotlib as mpl
    from matplotlib.font_manager import get_font_names

    installed = set(get_font_names())
    families = [_FONT, *(name for name in _OTHER_FONTS if name in installed)]
    return mpl.rc_context({**_RC, "font.family": families})


def save_figure(figure: "Figure", folder: Path, stem: str, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Save a figure as PNG (300 dpi), SVG and PDF; to be called within `figure_style`.

    Parameters
    ----------
    figure
        The figure.
    folder
        An existing folder.
    stem
        The files' name without its ending.
    formats
        Which of the three.

    Returns
    -------
    list of Path
        The files. The same figure gives the same bytes.
    """
    files = [folder / f"{stem}.{kind}" for kind in formats]
    for kind, file in zip(formats, files, strict=True):
        # Fast compression: a third of the time of a picture goes into the last tenth of its size.
        options: dict[str, Any] = {"pil_kwargs": {"compress_level": 3}} if kind == "png" else {}
        with replacing(file) as half:
            figure.savefig(half, format=kind, dpi=300, metadata=_METADATA[kind], **options)
    return files


def wrapped_notes(notes: Iterable[str]) -> tuple[str, ...]:
    """Return notes as the lines that they take below a figure."""
    return tuple(line for note in notes for line in textwrap.wrap(note, _NOTE_CHARACTERS))


def draw_notes(figure: "Figure", lines: Sequence[str], first_in: float) -> None:
    """Write lines of notes, the first with its middle so many inches above the figure's lower edge."""
    for number, line in enumerate(lines):
        y = (first_in - number * LINE_IN) / figure.get_figheight()
        figure.text(LEFT, y, line, fontsize=7, color=_NOTE, va="center")


def draw_header(figure: "Figure", study: str, about: str, *, simulated: bool) -> None:
    """Write at the top which study it is and what of it, and whether the participants were simulated."""
    title = f"{shortened(study, 40)}: {about}"
    y = 1 - 0.2 / figure.get_figheight()
    figure.text(LEFT, y, title, fontsize=9, fontweight="bold", va="center")
    if simulated:
        figure.text(
            RIGHT,
            y,
            "SIMULATED PARTICIPANTS: not human data",
            fontsize=8,
            fontweight="bold",
            color=_SIGNAL,
            ha="right",
            va="center",
            bbox={"boxstyle": "round,pad=0.35", "facecolor": "none", "edgecolor": _SIGNAL, "linewidth": 0.8},
        )


def draw_panel_title(axes: "Axes", letter: str, text: str) -> None:
    """Write a panel's letter and title above its left end."""
    for words, weight, shift in ((letter, "bold", 0), (text, "normal", 11)):
        axes.annotate(
            words,
            xy=(0, 1),
            xycoords="axes fraction",
            xytext=(shift, 6),
            textcoords="offset points",
            fontweight=weight,
            annotation_clip=False,
        )
