"""A figure of results: declared with what there is to see, drawn and saved."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.style import drawing_of, figure_style, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH_MM = 114.0
"""Of a drawing within the report: it can be read on a phone and beside a column of text."""


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
    caption
        How to read it, a sentence or more each.
    """

    name: str
    title: str
    about: str
    draw: "Callable[[FigureOptions], Figure]"
    caption: tuple[str, ...] = ()


@dataclass(frozen=True)
class SavedFigure:
    """A figure that was drawn.

    Attributes
    ----------
    figure
        What it is.
    files
        One of each format.
    drawing
        The same as SVG for a page that has captions and tables of its own, `PAGE_WIDTH_MM` wide.
    """

    figure: ResultFigure
    files: tuple[Path, ...]
    drawing: bytes


def save_figure_of(figure: ResultFigure, folder: Path, options: FigureOptions, text: str) -> SavedFigure:
    """Draw a figure and save it in each format; the same results give the same bytes.

    Parameters
    ----------
    figure
        The figure.
    folder
        An existing folder.
    options
        How it is made.
    text
        All names that are written in it, for which fonts are chosen.
    """
    bare = dataclasses.replace(options, width=PAGE_WIDTH_MM, caption=False, test_table=False)
    with figure_style(text):
        files = save_figure(figure.draw(options), folder, figure.name, options.formats)
        return SavedFigure(figure, tuple(files), drawing_of(figure.draw(bare)))
