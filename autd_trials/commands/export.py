"""`autd-trials export`: the BIDS data set, made again from the logs."""

import argparse
from pathlib import Path

from autd_trials.commands.integrity import problem_json, say_of_records
from autd_trials.commands.output import print_json, say


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("study", metavar="STUDY", type=Path, help="the study's folder, such as data/chest")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Make the data set."""
    from autd_trials.records.bids import export_study

    done = export_study(options.study)
    say(f"wrote {len(done.files)} files of the BIDS data set in {options.study}")
    say_of_records(options.study, done.problems, done.told)
    if options.json:
        print_json(
            {
                "study": str(options.study),
                "files": [str(file) for file in done.files],
                "problems": [problem_json(options.study, problem) for problem in done.problems],
                "told": done.told,
            }
        )
    return 0
