"""The options of commands that draw figures: width, colours, order and names of levels, texts, formats."""

import argparse
from typing import TYPE_CHECKING

from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from autd_analysis.report.figure_options import FigureOptions


def add_figure_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of figures."""
    group = parser.add_argument_group("figures")
    group.add_argument(
        "--figure-width",
        metavar="WIDTH",
        help="single, middle or double (85, 114 or 174 mm: a journal's columns), or a number of mm (double)",
    )
    group.add_argument(
        "--colours",
        metavar="COLOUR,...",
        help="of levels in their order: '#0072B2,#D55E00' or tab:blue,black",
    )
    group.add_argument(
        "--order",
        action="append",
        default=[],
        metavar="FACTOR=LEVEL,...",
        help="a factor's levels in the order in which they are shown; may be repeated",
    )
    group.add_argument(
        "--labels",
        action="append",
        default=[],
        metavar="FACTOR[:LEVEL]=TEXT",
        help="what a factor or a level is called, as in clothing:none='no clothing'; may be repeated",
    )
    group.add_argument("--no-caption", action="store_true", help="figures without the words below them")
    group.add_argument("--no-test-table", action="store_true", help="the figure of rates without its tests")
    group.add_argument("--format", metavar="FORMAT,...", help="of png, svg, pdf and tiff (png,svg,pdf)")


def figure_options(options: argparse.Namespace) -> "FigureOptions":
    """Return what the options say of figures; raises UsageError where they cannot be understood."""
    from autd_analysis.data.foreign.request import parse_levels
    from autd_analysis.report.figure_options import DEFAULT, FigureOptions

    titles, labels = _names(options.labels)
    return FigureOptions(
        width=options.figure_width or DEFAULT.width,
        colours=tuple(_words(options.colours, "--colours")) if options.colours else (),
        order=parse_levels(options.order, "--order"),
        titles=titles,
        labels=labels,
        caption=not options.no_caption,
        test_table=not options.no_test_table,
        formats=tuple(_words(options.format, "--format")) if options.format else DEFAULT.formats,
    )


def _names(given: list[str]) -> tuple[dict[str, str], dict[str, dict[str, str]]]:
    """Read FACTOR=TEXT and FACTOR:LEVEL=TEXT."""
    titles: dict[str, str] = {}
    labels: dict[str, dict[str, str]] = {}
    for each in given:
        name, separator, words = each.partition("=")
        factor, colon, level = (part.strip() for part in name.partition(":"))
        if not separator or not factor or not words.strip() or (colon and not level):
            raise UsageError(
                f"--labels has {each!r}",
                do="write FACTOR=TEXT or FACTOR:LEVEL=TEXT, as in clothing:none=bare",
            )
        if colon:
            labels.setdefault(factor, {})[level] = words.strip()
        else:
            titles[factor] = words.strip()
    return titles, labels


def _words(text: str, option: str) -> list[str]:
    words = [word.strip() for word in text.split(",")]
    if not all(words) or len(set(words)) < len(words):
        raise UsageError(f"{option} has {text!r}", do="write words with commas between them, each once")
    return words
