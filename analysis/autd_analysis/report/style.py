"""How every figure looks, and how it is saved: the same results give the same bytes."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_analysis.report.fonts import families_for
from autd_trials.records.disk import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK = "#222222"
GREY = "#8A8A8A"
GRID = "#E6E6E6"
BAND = "#F2F2F2"
NOTE = "#444444"
SIGNAL = "#B00020"
PAPER = "#FFFFFF"

# Okabe and Ito's colours, which any colour vision distinguishes, but for their yellow, which is hardly seen
# on white; the markers repeat the distinction, and make it where colours come again.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
# Metadata that would differ from run to run is left out, so that the same results give the same bytes.
_METADATA: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
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
    """Colour and marker of a column or a line; `hollow` markers are filled with white."""

    colour: str
    marker: str
    hollow: bool = False

    @property
    def fill(self) -> str:
        """What markers are filled with."""
        return PAPER if self.hollow else self.colour


PLAIN = Style(INK, "o")


def level_style(index: int, colours: Sequence[str] = ()) -> Style:
    """Return the style of a factor's level by its place in the list of levels.

    Parameters
    ----------
    index
        The place. 8 times as many as there are colours (56) have styles that differ.
    colours
        A person's; Okabe and Ito's without any.
    """
    chosen = tuple(colours) or _COLOURS
    round_, place = divmod(index, len(chosen))
    return Style(chosen[place], _MARKERS[(place + round_) % len(_MARKERS)])


def figure_style(text: str = "") -> Any:
    """Return the context within which figures are drawn and saved.

    Parameters
    ----------
    text
        All names that will be written; fonts are chosen that have their characters.
    """
    import matplotlib as mpl

    return mpl.rc_context({**_RC, "font.family": list(families_for(text))})


def drawing_of(figure: "Figure") -> bytes:
    """Return a figure as SVG; to be called within `figure_style`."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata=_METADATA["svg"], transparent=True)
    return buffer.getvalue()


def save_figure(figure: "Figure", folder: Path, stem: str, formats: Sequence[str]) -> list[Path]:
    """Save a figure, pictures with 300 dots per inch; to be called within `figure_style`.

    Parameters
    ----------
    figure
        The figure.
    folder
        An existing folder.
    stem
        The files' name without its ending.
    formats
        Of `autd_analysis.report.figure_options.FORMATS`.

    Returns
    -------
    list of Path
        The files. The same figure gives the same bytes.
    """
    files = [folder / f"{stem}.{kind}" for kind in formats]
    for kind, file in zip(formats, files, strict=True):
        # Fast compression: a third of the time of a picture goes into the last tenth of its size.
        options: dict[str, Any] = {"pil_kwargs": {"compress_level": 3}} if kind == "png" else {}
        if kind == "tiff":
            options = {"pil_kwargs": {"compression": "tiff_lzw"}}
        else:
            options["metadata"] = _METADATA[kind]
        with replacing(file) as half:
            figure.savefig(half, format=kind, dpi=300, **options)
    return files
