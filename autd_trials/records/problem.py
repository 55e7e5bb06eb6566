"""What is wrong with a record, in words."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Problem:
    """Something that a record should not have.

    Parameters
    ----------
    file
        The log or table that it is about, or the study's folder.
    line
        The file's line, from 1; None where it is about the whole file.
    what
        What is wrong, in a sentence.
    explained
        Whether the record itself explains it (a line torn by a crash, a log of version 1): worth knowing,
        but no sign of damage.
    """

    file: Path
    line: int | None
    what: str
    explained: bool = False

    @property
    def place(self) -> str:
        """The file's name, and the line in it."""
        return self.file.name if self.line is None else f"{self.file.name}:{self.line}"

    def __str__(self) -> str:
        return f"{self.place}: {self.what}"


def unexplained(problems: Iterable[Problem]) -> tuple[Problem, ...]:
    """Return the problems that say that something was damaged or changed."""
    return tuple(problem for problem in problems if not problem.explained)


def in_short(problems: Iterable[Problem], most: int = 3) -> list[str]:
    """Return the unexplained problems in words, at most so many of each file."""
    by_file: dict[Path, list[Problem]] = {}
    for problem in unexplained(problems):
        by_file.setdefault(problem.file, []).append(problem)
    lines = []
    for found in by_file.values():
        lines += [str(problem) for problem in found[:most]]
        if len(found) > most:
            lines.append(f"{found[0].file.name}: and {len(found) - most} more")
    return lines
