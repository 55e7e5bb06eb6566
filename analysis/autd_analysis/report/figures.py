"""All results of a study as figures."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.comparisons.figure import draw_figure
from autd_analysis.psychometric.figure import draw_psychometric
from autd_analysis.report.style import FORMATS, figure_style, save_figure
from autd_analysis.report.wording import factor_label
from autd_analysis.study import Results
from autd_analysis.thresholds.figure import draw_thresholds
from autd_analysis.timing.figure import draw_timing

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
        Draws it within `autd_analysis.report.style.figure_style`; None if there is nothing to show.
    """

    name: str
    title: str
    about: str
    draw: "Callable[[Results], Figure | None]"


@dataclass(frozen=True)
class SavedFigure:
    """A figure that was drawn, and its files, one of each format."""

    figure: ResultFigure
    files: tuple[Path, ...]

    @property
    def svg(self) -> Path:
        """The file that a browser shows at any size."""
        return next(file for file in self.files if file.suffix == ".svg")


def figures_of(results: Results) -> Iterator[ResultFigure]:
    """Yield the figures of a study, in the order in which a report shows them."""
    if results.thresholds:
        yield ResultFigure(
            "thresholds",
            "Thresholds and paired differences",
            "Left: every participant's threshold in every condition as a dot, with the geometric mean over "
            "participants and its 95 % t interval; participants whose threshold lies over the largest level "
            "stand above the line. Right, if comparisons are planned: every participant's difference in dB. "
            "All numbers are in the tables of thresholds.",
            draw_thresholds,
        )
    else:
        yield ResultFigure(
            "rates",
            "Detection rates and paired differences",
            "Left: the detection rate of every participant in every condition as a dot, with the mean over "
            "participants and its 95 % t interval. Right, if comparisons are planned: every participant's "
            "difference between the compared conditions, likewise. Below: the tests of these differences. "
            "All numbers are in the tables of rates and of comparisons.",
            draw_figure,
        )
    for found in results.psychometric:
        yield ResultFigure(
            "psychometric" if len(results.psychometric) == 1 else f"psychometric_{found.along}",
            f"Psychometric functions along {factor_label(found.along)}",
            "A panel for each condition: every participant's rates as dots and fitted function as a thin "
            "line; the function of an average participant as a thick line, with its threshold and interval. "
            "All numbers are in the tables of psychometric functions.",
            partial(draw_psychometric, found=found),
        )
    yield ResultFigure(
        "timing",
        "Timing: onsets and response times",
        "Cumulative shares of onset lateness and of each participant's response times, and every "
        "participant's median response time in every condition with the mean over participants and its 95 % "
        "t interval, as far as they were recorded. All numbers are in the tables of timing and of response "
        "times.",
        draw_timing,
    )


def save_figures(results: Results, folder: Path, formats: Sequence[str] = FORMATS) -> tuple[SavedFigure, ...]:
    """Draw all figures of a study and save each as PNG (300 dpi), SVG and PDF.

    Parameters
    ----------
    results
        The study's results.
    folder
        An existing folder.
    formats
        Which of the three.

    Returns
    -------
    tuple of SavedFigure
        Those that have something to show. The same results give the same bytes.
    """
    saved = []
    with figure_style():
        for each in figures_of(results):
            figure = each.draw(results)
            if figure is not None:
                saved.append(SavedFigure(each, tuple(save_figure(figure, folder, each.name, formats))))
    return tuple(saved)
