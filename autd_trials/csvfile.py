"""Reading CSV files of numbers, with the place of what is wrong."""

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autd_trials.errors import UsageError


def read_numbers(
    path: Path,
    what: str,
    columns: Sequence[str],
    *,
    advice: str,
    rising: str | None = None,
    never_negative: str | None = None,
) -> NDArray[np.float64]:
    """Read named columns of finite numbers; other columns are left unread.

    Parameters
    ----------
    path
        The file; UTF-8, its first line names the columns.
    what
        What the file is, for messages.
    columns
        The columns that are needed.
    advice
        What the columns must be, in words.
    rising
        A column whose values must rise from line to line.
    never_negative
        A column whose values must be at least 0.

    Returns
    -------
    NDArray
        Shape (lines, columns).

    Raises
    ------
    UsageError
        The file cannot be read, lacks columns, or holds something else than finite rising or positive
        numbers.
    """
    before = -math.inf
    rows = []
    for where, words in read_words(path, what, columns, advice=advice):
        row = {name: _number(words[name], name, where) for name in columns}
        if never_negative is not None and row[never_negative] < 0:
            raise UsageError(f"{never_negative} is negative", where=where, do=f"correct this line: {advice}")
        if rising is not None and row[rising] <= before:
            raise UsageError(
                f"{rising} is {row[rising]:g} after {before:g}, but must rise",
                where=where,
                do="put the lines in order; if a clock was set back meanwhile, record again",
            )
        before = row[rising] if rising is not None else before
        rows.append([row[name] for name in columns])
    return np.array(rows, dtype=np.float64).reshape(-1, len(columns))


def read_words(
    path: Path, what: str, columns: Sequence[str], *, advice: str = ""
) -> Iterator[tuple[str, dict[str, str]]]:
    """Read named columns as text, each line with its place; parameters and errors as `read_numbers`."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"the {what} cannot be read: {error}", where=str(path)) from error
    reader = csv.DictReader(lines)
    header = reader.fieldnames = [name.strip() for name in reader.fieldnames or []]
    missing = [name for name in columns if name not in header]
    if missing:
        raise UsageError(
            f"the columns {', '.join(missing)} are missing; there are {', '.join(header) or 'none'}",
            where=f"{path}:1",
            do=f"name them {', '.join(columns)}" + (f": {advice}" if advice else ""),
        )
    for row in reader:
        yield f"{path}:{reader.line_num}", {name: row[name] for name in columns}


def _number(text: str | None, name: str, where: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(
            f"{name} is {text!r}, which is no finite number", where=where, do="correct or remove this line"
        )
    return value
