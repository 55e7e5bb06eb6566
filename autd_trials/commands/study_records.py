"""`autd-trials study STUDY verify`: whether the records of a study are as they were written."""

import argparse
from pathlib import Path

from autd_trials.commands.integrity import problem_json
from autd_trials.commands.output import print_json, print_text

_PROBLEMS_FOUND = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    verify = verbs.add_parser(
        "verify",
        help="check the chain and the consistency of all logs",
        description="Check all logs of a study: numbers and chain of their lines, whether each is consistent "
        "in itself, all of them with each other, and the tables that were made of them.",
        epilog="Exit codes: 0 nothing was found, 2 the records are not as they were written. The chain has "
        "no secret: it shows accidents and edits, not the work of somebody who computes it again with care.",
    )
    verify.add_argument("study", metavar="STUDY", type=Path, help="the study's folder, such as data/chest")
    verify.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Check the records and say what is wrong with them."""
    from autd_trials.records.layout import log_paths
    from autd_trials.records.problem import unexplained
    from autd_trials.records.verify import verify_study

    problems = verify_study(options.study)
    found = unexplained(problems)
    if options.json:
        print_json(
            {
                "study": str(options.study),
                "logs": len(log_paths(options.study)),
                "whole": not found,
                "problems": [problem_json(options.study, problem) for problem in problems],
            }
        )
    else:
        lines = [str(problem) for problem in found]
        lines += [f"{problem} (explained by the log itself)" for problem in problems if problem.explained]
        count = f"{len(found)} finding(s) in" if found else "nothing wrong with"
        print_text("\n".join([*lines, f"{count} {len(log_paths(options.study))} log(s)"]))
    return _PROBLEMS_FOUND if found else 0
