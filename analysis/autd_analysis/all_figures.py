"""All results of a study as figures."""

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.figure_text import rates_caption
from autd_analysis.figures import draw_figure
from autd_analysis.psychometric.results import PsychometricResults
from autd_analysis.psychometric_figure import draw_psychometric, psychometric_caption
from autd_analysis.report.facets import study_facets
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.study import Results
from autd_analysis.style import drawing_of, figure_style, save_figure
from autd_analysis.threshold_figure import draw_thresholds, threshold_caption
from autd_analysis.timing_figure import draw_timing, timing_caption
from autd_analysis.wording import study_labels

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
    caption
        How to read it, a sentence or more each.
    draw
        Draws it within `autd_analysis.style.figure_style`; None if there is nothing to show.
    """

    name: str
    title: str
    about: str
    caption: tuple[str, ...]
    draw: "Callable[[Results, FigureOptions], Figure | None]"


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


def figures_of(results: Results) -> Iterator[ResultFigure]:
    """Yield the figures of a study, in the order in which a report shows them."""
    if results.thresholds:
        yield ResultFigure(
            "thresholds",
            "Thresholds and paired differences",
            "Panel A: every participant's threshold in every condition as a dot, with the geometric mean "
            "over participants and its 95% t interval; thresholds beyond the levels stand in grey bands. "
            "Panel B, if comparisons are planned: every participant's difference in dB. "
            "All numbers are in the tables of thresholds.",
            threshold_caption(results, tests=False),
            draw_thresholds,
        )
    else:
        yield ResultFigure(
            "rates",
            "Detection rates and paired differences",
            "Panel A: the detection rate of every participant in every condition as a dot, with the mean "
            "over participants and its 95% t interval. Panel B, if comparisons are planned: every "
            "participant's difference between the compared conditions, likewise. "
            "All numbers are in the tables of rates and of comparisons.",
            rates_caption(results, tests=False),
            draw_figure,
        )
    for found in results.psychometric:
        yield ResultFigure(
            "psychometric" if len(results.psychometric) == 1 else f"psychometric_{found.along}",
            f"Psychometric functions along {study_labels(results.trials.design).words(found.along)}",
            "A panel for each condition: every participant's rates as dots and fitted function as a thin "
            "line; the function of an average participant as a thick line, with its threshold and interval. "
            "All numbers are in the tables of psychometric functions.",
            psychometric_caption(found),
            partial(_draw_psychometric, found),
        )
    yield ResultFigure(
        "timing",
        "Timing: onsets and response times",
        "Cumulative shares of onset lateness and of each participant's response times, and every "
        "participant's median response time in every condition with the mean over participants and its 95% "
        "t interval, as far as they were recorded. All numbers are in the tables of timing and of response "
        "times.",
        timing_caption(results),
        draw_timing,
    )


def _draw_psychometric(found: PsychometricResults, results: Results, options: FigureOptions) -> "Figure":
    return draw_psychometric(results, found, options)


def save_figures(results: Results, folder: Path, options: FigureOptions = DEFAULT) -> tuple[SavedFigure, ...]:
    """Draw all figures of a study and save each in every format that is asked for.

    Parameters
    ----------
    results
        The study's results.
    folder
        An existing folder.
    options
        How they are made.

    Returns
    -------
    tuple of SavedFigure
        Those that have something to show. The same results give the same bytes.
    """
    bare = dataclasses.replace(options, width_mm=PAGE_WIDTH_MM, caption=False, test_table=False)
    saved = []
    with figure_style(study_facets(results.trials.design, options).text):
        for each in figures_of(results):
            figure = each.draw(results, options)
            on_page = each.draw(results, bare) if figure is not None else None
            if figure is not None and on_page is not None:
                files = save_figure(figure, folder, each.name, options.formats)
                saved.append(SavedFigure(each, tuple(files), drawing_of(on_page)))
    return tuple(saved)
