"""What is forgiven in tables of others: lines before the names, names again, columns without names."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass

from autd_trials.errors import UsageError

_HEAD_BYTES = 65_536
_MOST_BEFORE = 20
_MOST_LOOKED_AT = 60


@dataclass(frozen=True)
class Opening:
    """How a table begins.

    Attributes
    ----------
    separator
        What separates its cells.
    before
        How many rows with text come before the names of the columns.
    """

    separator: str
    before: int


def opening(content: bytes, separators: Sequence[str]) -> Opening | None:
    """Return how a table begins: with the separator that gives every row as many cells as there are names.

    Lines before the names have one cell with text. Of several separators that which has fewest of them.

    Parameters
    ----------
    content
        The table, in UTF-8.
    separators
        Those that may be.

    Returns
    -------
    Opening or None
        None if no separator fits, or more than one.
    """
    found = [(before, sign) for sign in separators if (before := _before(content, sign)) is not None]
    least = min((before for before, _ in found), default=0)
    fitting = [sign for before, sign in found if before == least]
    return Opening(fitting[0], least) if len(fitting) == 1 else None


def without_outer_quotes(content: bytes) -> bytes | None:
    """Return a table each of whose lines was put in quotes as a whole, without them; None for any other."""
    text = content.decode()
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except csv.Error:
        return None
    cells = [cells[0] for cells in rows if cells]
    quoted = all(len(cells) <= 1 for cells in rows) and all(re.search(r"[,;\t]", cell) for cell in cells)
    if not cells or not quoted or text.count('"') < 2 * len(cells):
        return None
    return "".join(f"{cells[0] if cells else ''}\n" for cells in rows).encode()


def _before(content: bytes, separator: str) -> int | None:
    """Return how many rows come before the names if a separator fits, else None."""
    cut = content[:_HEAD_BYTES]
    whole = len(cut) == len(content)
    text = (cut if whole else cut[: cut.rfind(b"\n") + 1]).decode(errors="ignore")
    rows: list[list[str]] = []
    try:
        for cells in csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True):
            if any(map(str.strip, cells)):
                rows.append(cells)
            if len(rows) > _MOST_LOOKED_AT:
                break
    except csv.Error:
        if whole:
            return None
    before = next((index for index, cells in enumerate(rows) if filled(cells) > 1), None)
    if before is None or before > _MOST_BEFORE:
        return None
    width = _width(rows[before])
    most = max(width, len(rows[before]))
    fits = all(_width(cells) <= most and len(cells) >= width for cells in rows[before:])
    return before if fits else None


def filled(cells: Sequence[str]) -> int:
    """Return how many cells of a row have text."""
    return sum(1 for cell in cells if cell.strip())


def _width(cells: Sequence[str]) -> int:
    """Return how many cells a row has up to the last with text."""
    return max((index for index, cell in enumerate(cells, start=1) if cell.strip()), default=0)


def fitted(cells: list[str], header: Sequence[str]) -> list[str]:
    """Return a row as long as the names, if what it has too much, or too little, is empty."""
    if len(cells) > len(header) and _width(cells) <= len(header):
        return cells[: len(header)]
    if len(cells) < len(header) and not any(header[len(cells) :]):
        return cells + [""] * (len(header) - len(cells))
    return cells


def is_header_again(cells: Sequence[str], header: Sequence[str], where: str) -> bool:
    """Return whether a row names the columns once more, as where files were joined.

    Raises
    ------
    UsageError
        It names the same columns in another order.
    """
    again = [cell.strip().casefold() for cell in cells]
    names = [name.casefold() for name in header]
    if again == names:
        return True
    if len(names) > 1 and sorted(again) == sorted(names):
        raise UsageError(
            "this line names the columns once more, in another order",
            where=where,
            do="make what begins here a file of its own, and give both",
        )
    return False


def named_columns(header: Sequence[str], rows: Sequence[Sequence[str]]) -> dict[int, str]:
    """Return the place and name of every column; those without a name get one, or are left out if empty."""
    names = dict(enumerate(header))
    for place, name in enumerate(header):
        if name:
            continue
        if not any(cells[place].strip() for cells in rows):
            del names[place]
            continue
        number = place + 1
        while f"column {number}" in names.values():
            number += 1
        names[place] = f"column {number}"
    return names


def listed_lines(lines: Sequence[int]) -> str:
    """Return the first few numbers of lines in words."""
    more = f" and {len(lines) - 5} more" if len(lines) > 5 else ""
    return ", ".join(map(str, lines[:5])) + more
