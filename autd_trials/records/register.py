"""The register of a study's logs: where each log's chain stood when the data set was made last.

A log by itself does not show that its end was cut off, and a study does not show that a whole session is
gone. The register does. It lies beside the logs (``sourcedata/chains.tsv``); a line of it is only replaced
while the log still holds what the line says, so that what was found wrong once stays found.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from autd_trials.records.chain import Head
from autd_trials.records.layout import source_folder
from autd_trials.records.problem import Problem

REGISTER = "chains.tsv"
_HEADER = ("log", "lines", "chain", "simulated", "table_sha256")
_LINE = re.compile(r"([^\t\n]+)\t([0-9]{1,9})\t([0-9a-f]{64})\t(yes|no)\t([0-9a-f]{64}|n/a)")


@dataclass(frozen=True)
class Entry:
    """What the register says of a log.

    Parameters
    ----------
    head
        Where its chain stood.
    simulated
        Whether it is of a simulated session.
    table_sha256
        SHA-256 of the table of trials that was made of it; None if there was no trial.
    """

    head: Head
    simulated: bool
    table_sha256: str | None


@dataclass(frozen=True)
class Register:
    """The entries by log (its path below sourcedata), and the lines that are none."""

    entries: Mapping[str, Entry]
    problems: tuple[Problem, ...] = ()
    unreadable: tuple[str, ...] = ()


def read_register(study: Path) -> Register:
    """Return a study's register; an empty one where there is none."""
    path = source_folder(study) / REGISTER
    try:
        lines = path.read_text(encoding="utf-8", errors="backslashreplace").splitlines()
    except FileNotFoundError:
        return Register({})
    except OSError as error:
        return Register({}, (Problem(path, None, f"cannot be read: {error.strerror}"),))
    entries: dict[str, Entry] = {}
    problems, unreadable = [], []
    for number, line in enumerate(lines, start=1):
        match = _LINE.fullmatch(line)
        if match and match[1] not in entries:
            table_sha256 = None if match[5] == "n/a" else match[5]
            entries[match[1]] = Entry(Head(int(match[2]), match[3]), match[4] == "yes", table_sha256)
        elif number > 1 or line.split("\t") != list(_HEADER):
            problems.append(Problem(path, number, "this line of the register was damaged or put in"))
            unreadable.append(line)
    return Register(entries, tuple(problems), tuple(unreadable))


def register_text(known: Register, renewed: Mapping[str, Entry]) -> str:
    """Return the register's text.

    Parameters
    ----------
    known
        What it says so far.
    renewed
        New entries, by log, of those that still hold what the register says of them.
    """
    rows = [
        (
            name,
            str(entry.head.lines),
            entry.head.chain,
            "yes" if entry.simulated else "no",
            entry.table_sha256 or "n/a",
        )
        for name, entry in sorted({**known.entries, **renewed}.items())
    ]
    lines = ["\t".join(row) for row in (_HEADER, *rows)]
    return "".join(f"{line}\n" for line in (*lines, *known.unreadable))
