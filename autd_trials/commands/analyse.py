"""`autd-trials analyse`: from a recorded study to tables and the figure."""

import argparse
from pathlib import Path

from autd_trials.commands.output import print_json, print_text, say


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("study", metavar="STUDY", type=Path, help="the study's folder, such as data/chest")
    parser.add_argument("--out", type=Path, help="where results go (STUDY/derivatives/analysis)")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")


def execute(options: argparse.Namespace) -> int:
    """Analyse the study and write the results."""
    from analysis.output import results_json, write_results
    from analysis.study import analyse
    from analysis.summary import plain_words
    from autd_trials.records.layout import analysis_folder

    results = analyse(options.study)
    folder = options.out or analysis_folder(options.study)
    write_results(results, folder)
    if options.json:
        print_json(results_json(results))
    else:
        print_text(plain_words(results))
    say(f"figure, tables and results: {folder}")
    say(f"data set: {options.study}")
    return 0
