"""`autd-trials analyse`: from a recorded study or any table of answers to tables, figures and the report."""

import argparse
import glob
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.figure_arguments import add_figure_arguments, figure_options
from autd_trials.commands.integrity import say_of_records
from autd_trials.commands.output import print_json, print_text, say
from autd_trials.commands.progress import progress_bar
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from autd_analysis.data.foreign.request import TableRequest
    from autd_analysis.data.trials import Trials
    from autd_analysis.psychometric.options import PsychometricOptions
    from autd_analysis.report.figure_options import FigureOptions
    from autd_analysis.results import Results
    from autd_analysis.study import Progress

_OF_TABLES = (
    "columns", "levels", "compare", "yes", "catch", "exclude", "ignore", "participant", "encoding"
)  # fmt: skip
_OF_FUNCTIONS = ("guess", "lapse", "core")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "study",
        metavar="STUDY",
        nargs="+",
        help="a study's folder, such as data/chest, or a CSV or TSV table, or several, or 'data/*.csv'",
    )
    parser.add_argument(
        "--only",
        type=_subjects,
        metavar="SUBJECT,...",
        help="these subjects alone: rates, comparisons, interactions, detectability, order, models, "
        "sensitivity, thresholds, psychometric, timing",
    )
    parser.add_argument("--without", type=_subjects, metavar="SUBJECT,...", help="all subjects but these")
    parser.add_argument(
        "--out", type=Path, help="where results go (STUDY/derivatives/analysis, TABLE-analysis)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    add_figure_arguments(parser)
    _add_function_arguments(parser.add_argument_group("psychometric functions"))
    _add_table_arguments(
        parser.add_argument_group(
            "tables",
            "A word that holds a comma is put in double quotes: 'cloth=\"thick, woollen\",thin'. COLUMN is "
            "one of our names in --columns, or one of the table.",
        )
    )


def _add_function_arguments(group: "argparse._ArgumentGroup") -> None:
    group.add_argument(
        "--guess",
        metavar="RATE",
        help="rate of felt (or right) answers far below the threshold: a number, such as 0.5 for two "
        "alternatives; shared or free to estimate it (shared with catch trials, else 0)",
    )
    group.add_argument(
        "--lapse", metavar="RATE", help="rate of misses far above it: a number, shared or free (0.02)"
    )
    group.add_argument("--core", metavar="FORM", help="normal, logistic or weibull (normal)")


def _add_table_arguments(group: "argparse._ArgumentGroup") -> None:
    group.add_argument(
        "--columns",
        metavar="NAME=COLUMN,...",
        help="participant, response and the factors, perhaps session, trial, block, trial_type, "
        "response_time, ...; felt and n instead of response are counts; NAME alone is that column",
    )
    group.add_argument(
        "--levels",
        action="append",
        default=[],
        metavar="FACTOR=LEVEL,...",
        help="a factor's levels in order; may be repeated",
    )
    group.add_argument(
        "--compare",
        action="append",
        default=[],
        metavar="FACTOR=FIRST,SECOND[@OTHER]",
        help="two levels, at each level of another factor; may be repeated",
    )
    group.add_argument(
        "--yes",
        action="append",
        default=[],
        metavar="WORD,...",
        help="answers that mean felt (or right); all others then do not (yes, true, 1, felt, correct, ...)",
    )
    group.add_argument(
        "--catch",
        action="append",
        default=[],
        metavar="COLUMN=VALUE,...",
        help="what makes a line a catch trial, as amplitude=0; may be repeated",
    )
    group.add_argument(
        "--exclude",
        action="append",
        default=[],
        metavar="COLUMN=VALUE,...",
        help="lines to leave out, as participant=P3,P7; n/a is an empty cell; may be repeated",
    )
    group.add_argument(
        "--ignore", action="append", default=[], metavar="COLUMN,...", help="columns not to read"
    )
    group.add_argument("--participant", metavar="ID", help="whose answers these are, if no column says so")
    group.add_argument("--encoding", metavar="NAME", help="of the text, if it is not found: cp932, ...")


def execute(options: argparse.Namespace) -> int:
    """Analyse the study and write the results."""
    from autd_analysis.report.summary import plain_words
    from autd_analysis.report.writing import results_json, write_results

    figures = figure_options(options)
    with progress_bar("subjects") as progress:
        results, folder = _analyse(options, figures, progress)
    results = write_results(results, folder, figures).results
    if options.json:
        print_json(results_json(results))
    else:
        print_text(plain_words(results))
    say(f"report, figures and tables: {folder}")
    for subject, failed in results.failures.items():
        say(f"{subject}: {failed.cause}")
    return 1 if results.failures else 0


def _analyse(
    options: argparse.Namespace, figures: "FigureOptions", progress: "Progress"
) -> "tuple[Results, Path]":
    """Return the results and the folder where they go."""
    from autd_analysis.report.figure_options import labelled_trials
    from autd_analysis.study import analyse

    functions = _functions(options)
    trials, folder = _read(options)
    trials = labelled_trials(replace(trials, command=" ".join([trials.command, *_typed(options)])), figures)
    results = analyse(trials, options.only, options.without, psychometric=functions, progress=progress)
    return results, folder


def _read(options: argparse.Namespace) -> "tuple[Trials, Path]":
    """Return the trials, and the folder where results go."""
    folders = [name for name in options.study if Path(name).is_dir()]
    if not folders:
        return _of_tables(options)
    study = Path(folders[0])
    if len(options.study) > 1:
        raise UsageError(
            "a study's folder is analysed alone", where=str(study), do="give one folder, or tables only"
        )
    given = [f"--{name}" for name in _OF_TABLES if getattr(options, name)]
    if given:
        raise UsageError(
            f"these are for tables: {', '.join(given)}; a study's protocol says what is what",
            where=str(study),
            do="leave them out, or give a CSV or TSV file",
        )
    return _of_study(study, options)


def _of_study(study: Path, options: argparse.Namespace) -> "tuple[Trials, Path]":
    from autd_analysis.data.trials import read_trials

    from autd_trials.records.layout import analysis_folder

    folder = _results_folder(options.out or analysis_folder(study))
    trials = read_trials(study)
    say(f"data set: {study}")
    say_of_records(study, trials.problems)
    return trials, folder


def _of_tables(options: argparse.Namespace) -> "tuple[Trials, Path]":
    from autd_analysis.data.foreign.tables import read_tables, table_paths

    missing = [name for name in options.study if not Path(name).exists() and not glob.has_magic(name)]
    if missing:
        raise UsageError(
            "there is no such file or folder",
            where=missing[0],
            do="give a study's folder, DATA/PROTOCOL, or a table",
        )
    paths = table_paths(options.study)
    folder = _results_folder(options.out or _beside(paths))
    return read_tables(paths, table_request(options)), folder


def table_request(options: argparse.Namespace) -> "TableRequest":
    """Return how a table is to be read, as it was typed."""
    from autd_analysis.data.foreign.request import (
        TableRequest,
        parse_choices,
        parse_columns,
        parse_comparison,
        parse_levels,
        parse_words,
    )

    return TableRequest(
        columns=parse_columns(options.columns or ""),
        levels=parse_levels(options.levels),
        comparisons=tuple(map(parse_comparison, options.compare)),
        yes=parse_words(options.yes),
        catch=parse_choices(options.catch, "--catch"),
        exclude=parse_choices(options.exclude, "--exclude"),
        ignore=parse_words(options.ignore),
        participant=options.participant,
        encoding=options.encoding,
        guess_known=options.guess is not None,
    )


def _subjects(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _functions(options: argparse.Namespace) -> "PsychometricOptions":
    """Return how psychometric functions are to be fitted."""
    from autd_analysis.psychometric.options import DEFAULT, PsychometricOptions, read_rate

    return PsychometricOptions(
        guess=DEFAULT.guess if options.guess is None else read_rate(options.guess, "guess"),
        lapse=DEFAULT.lapse if options.lapse is None else read_rate(options.lapse, "lapse"),
        core=DEFAULT.core if options.core is None else options.core,
    )


def _typed(options: argparse.Namespace) -> "Sequence[str]":
    """Return what was typed of psychometric functions, to be typed again."""
    given = {name: getattr(options, name) for name in _OF_FUNCTIONS}
    return [f"--{name} {shlex.quote(word)}" for name, word in given.items() if word is not None]


def _beside(paths: "Sequence[Path]") -> Path:
    """Return the folder of results beside the tables, or here if they are in a data set's own folder."""
    from autd_analysis.data.foreign.tables import title

    name = f"{title(paths)}-analysis"
    return Path(name) if paths[0].parent.name == "beh" else paths[0].with_name(name)


def _results_folder(folder: Path) -> Path:
    """Return a folder for results; what cannot be one is refused before anything is computed."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(
            "results cannot go here: this is no folder", where=str(folder), do="give another --out"
        )
    return folder
