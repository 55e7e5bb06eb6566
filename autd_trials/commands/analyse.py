"""`autd-trials analyse`: from a recorded study or any table of answers to tables, figures and the report."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.figure_arguments import add_figure_arguments, figure_options
from autd_trials.commands.integrity import say_of_records
from autd_trials.commands.output import print_json, print_text, say
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from autd_analysis.report.figure_options import FigureOptions
    from autd_analysis.study import Results

    from autd_trials.protocol.schema import Comparison


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "study",
        metavar="STUDY",
        type=Path,
        help="a study's folder, such as data/chest, or a CSV or TSV table",
    )
    parser.add_argument(
        "--columns",
        metavar="NAME=COLUMN,...",
        help="of a table: participant, response and the factors, perhaps session, trial, trial_type, ...; "
        "NAME alone is a column of that name",
    )
    parser.add_argument(
        "--levels",
        action="append",
        default=[],
        metavar="FACTOR=LEVEL,...",
        help="of a table: a factor's levels in order; may be repeated",
    )
    parser.add_argument(
        "--compare",
        action="append",
        default=[],
        metavar="FACTOR=FIRST,SECOND[@OTHER]",
        help="of a table: two levels, at each level of another factor; may be repeated",
    )
    parser.add_argument(
        "--pooled",
        action="store_true",
        help="also make tests that pool answers over participants; they are wrong where people differ",
    )
    add_figure_arguments(parser)
    parser.add_argument(
        "--out", type=Path, help="where results go (STUDY/derivatives/analysis, TABLE-analysis)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")


def execute(options: argparse.Namespace) -> int:
    """Analyse the study and write the results."""
    from autd_analysis.output import all_remarks, results_json, write_results
    from autd_analysis.summary import plain_words

    figures = figure_options(options)
    results, folder = _analyse(options, figures)
    write_results(results, folder, figures)
    for remark in all_remarks(results, figures)[len(results.warnings) :]:
        say(remark)
    if options.json:
        print_json(results_json(results))
    else:
        print_text(plain_words(results))
    say(f"report, figures and tables: {folder}")
    return 0


def _analyse(options: argparse.Namespace, figures: "FigureOptions") -> "tuple[Results, Path]":
    """Return the results and the folder where they go."""
    from autd_analysis.any_table import TableRequest, read_any_table
    from autd_analysis.report.figure_options import labelled_trials
    from autd_analysis.study import results_of
    from autd_analysis.trials import read_trials

    from autd_trials.records.layout import analysis_folder

    if options.study.is_file():
        columns = {name: _single(words, name) for name, words in _columns(options.columns or "").items()}
        levels: dict[str, list[str]] = {}
        for each in options.levels:
            _add(levels, *_list(each, "--levels"), "--levels")
        comparisons = tuple(_comparison(each) for each in options.compare)
        trials = read_any_table(options.study, TableRequest(columns, levels, comparisons))
        folder = Path(f"{options.study.stem}-analysis")
        if options.study.parent.name != "beh":  # a data set's own folders are no place for results
            folder = options.study.with_name(folder.name)
        return results_of(labelled_trials(trials, figures), pooled=options.pooled), options.out or folder
    if not options.study.exists():
        raise UsageError(
            "there is no such file or folder",
            where=str(options.study),
            do="give a study's folder, DATA/PROTOCOL, or a table",
        )
    if options.columns or options.levels or options.compare:
        raise UsageError(
            "--columns, --levels and --compare are for tables; a study's protocol says what is what",
            where=str(options.study),
            do="leave them out, or give a CSV or TSV file",
        )
    trials = labelled_trials(read_trials(options.study), figures)
    results = results_of(trials, pooled=options.pooled)
    say(f"data set: {options.study}")
    say_of_records(options.study, results.trials.problems)
    return results, options.out or analysis_folder(options.study)


def _columns(text: str) -> dict[str, list[str]]:
    """Read NAME=COLUMN,NAME,...; a name alone is a column of that name."""
    columns: dict[str, list[str]] = {}
    for part in filter(None, text.split(",")):
        _add(columns, *_list(part if "=" in part else f"{part}={part}", "--columns"), "--columns")
    return columns


def _list(text: str, option: str) -> tuple[str, list[str]]:
    """Read NAME=WORD,WORD."""
    name, separator, words = text.partition("=")
    if not separator or not name.strip() or not all(word.strip() for word in words.split(",")):
        raise UsageError(f"{option} has {text!r}", do="write NAME=WORD, as in clothing=cloth")
    return name.strip(), [word.strip() for word in words.split(",")]


def _add(known: dict[str, list[str]], name: str, words: list[str], option: str) -> None:
    if name in known or len(set(words)) < len(words):
        raise UsageError(f"{option} names {name}, or a word for it, twice", do="name each once")
    known[name] = words


def _single(words: "Sequence[str]", name: str) -> str:
    if len(words) != 1:
        raise UsageError(f"--columns names {len(words)} columns for {name}", do="name one")
    return words[0]


def _comparison(text: str) -> "Comparison":
    from autd_trials.protocol.schema import Comparison

    compared, _, other = text.partition("@")
    factor, levels = _list(compared, "--compare")
    if len(levels) != 2:
        raise UsageError(f"--compare has {text!r}", do="name two levels: clothing=inner,both@modulation_hz")
    # Not validated: a protocol's rules for names of levels are not those of anybody's table.
    return Comparison.model_construct(factor=factor, first=levels[0], second=levels[1], at_each=other or None)
