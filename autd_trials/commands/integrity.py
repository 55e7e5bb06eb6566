"""How the commands say what is wrong with a study's records, so that nobody can miss it."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_trials.commands.output import say

if TYPE_CHECKING:
    from autd_trials.records.problem import Problem


def say_of_records(study: Path, problems: "Sequence[Problem]", told: Iterable[str] = ()) -> None:
    """Say on standard error what is wrong with the records, and which edited files were made again."""
    from autd_trials.records.problem import in_short, unexplained

    for line in told:
        say(f"note: {line}")
    count = len(unexplained(problems))
    if not count:
        return
    say(f"\n*** WARNING: the records are not as they were written: {count} finding(s) ***")
    for line in in_short(problems):
        say(f"  {line}")
    say(f"  -> explain this before you trust the data: autd-trials study verify {study}\n")


def problem_json(study: Path, problem: "Problem") -> dict[str, Any]:
    """Return a finding as JSON."""
    file = problem.file
    return {
        "file": str(file.relative_to(study) if file.is_relative_to(study) else file),
        "line": problem.line,
        "what": problem.what,
        "explained": problem.explained,
    }
