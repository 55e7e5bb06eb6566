"""A figure of results: declared with what there is to see, drawn and saved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.report.style import FORMATS, figure_style, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ResultFigure:
    """A figure of results.

    Attributes
    ----------
    name
        The files' name without its ending.
    title
        What it shows, in a few words.
    about
        What there is to see, for those who cannot see it.
    draw
        Draws it within `autd_analysis.report.style.figure_style`.
    """

    name: str
    title: str
    about: str
    draw: "Callable[[], Figure]"


@dataclass(frozen=True)
class SavedFigure:
    """A figure that was drawn, and its files, one of each format."""

    figure: ResultFigure
    files: tuple[Path, ...]

    @property
    def svg(self) -> Path:
        """The file that a browser shows at any size."""
        return next(file for file in self.files if file.suffix == ".svg")


def save_figure_of(figure: ResultFigure, folder: Path, formats: Sequence[str] = FORMATS) -> SavedFigure:
    """Draw a figure and save it in each format; the same results give the same bytes.

    Parameters
    ----------
    figure
        The figure.
    folder
        An existing folder.
    formats
        Of PNG (300 dpi), SVG and PDF.
    """
    with figure_style():
        return SavedFigure(figure, tuple(save_figure(figure.draw(), folder, figure.name, formats)))
