"""Reading a CSV or TSV file strictly: a cell under every name in every row, nothing dropped in silence."""

import csv
import io
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from autd_trials.errors import UsageError

_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ufffe\uffff]")
_SEPARATORS = {",": "commas", "\t": "tabs", ";": "semicolons"}


@dataclass(frozen=True)
class DelimitedFile:
    """A table's column names, and of every row its place in the file and its cells by column, stripped."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, dict[str, str]], ...]


def read_delimited(path: Path) -> DelimitedFile:
    """Read a table.

    Parameters
    ----------
    path
        CSV, or TSV if its name ends so, in UTF-8; the first line names the columns. Cells may be quoted, and
        contain line breaks then. Empty lines are skipped.

    Raises
    ------
    UsageError
        The file cannot be read, is separated otherwise, names a column twice, or has a row of another length.
    """
    text = _text(path)
    separator = "\t" if path.suffix.lower() == ".tsv" else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    try:
        header = tuple(name.strip() for name in next(reader, []))
        _check_header(path, header, separator)
        rows = []
        for cells in reader:
            place = f"{path}:{reader.line_num}"
            if not cells:
                continue
            if len(cells) != len(header):
                raise UsageError(f"{len(cells)} cells under {len(header)} column names", where=place)
            rows.append((place, {name: cell.strip() for name, cell in zip(header, cells, strict=True)}))
    except csv.Error as error:
        raise UsageError(f"no proper table: {error}", where=f"{path}:{reader.line_num}") from error
    return DelimitedFile(header, tuple(rows))


def _text(path: Path) -> str:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UsageError(
            f"the table cannot be read: it is no text in UTF-8 ({error})",
            where=str(path),
            do="save it again as CSV in UTF-8",
        ) from error
    except OSError as error:
        raise UsageError(f"the table cannot be read: {error}", where=str(path)) from error
    strange = _CONTROL.search(text)
    if strange:
        line = text.count("\n", 0, strange.start()) + 1
        raise UsageError(
            f"the table has a control character ({strange.group()!r})",
            where=f"{path}:{line}",
            do="save it again as CSV in UTF-8",
        )
    return text


def _check_header(path: Path, header: tuple[str, ...], separator: str) -> None:
    where = f"{path}:1"
    if not any(header):
        raise UsageError("the table is empty", where=where, do="give a table with a first line of names")
    other = next((sign for sign in _SEPARATORS if sign != separator and sign in header[0]), None)
    if len(header) == 1 and other is not None:
        raise UsageError(
            f"the columns are separated by {_SEPARATORS[other]}, not by {_SEPARATORS[separator]}",
            where=where,
            do="save it as .csv with commas or as .tsv with tabs (and numbers with a decimal point)",
        )
    twice = [name for name, count in Counter(header).items() if count > 1 and name]
    if twice:
        raise UsageError(
            f"these columns are there more than once: {', '.join(twice)}",
            where=where,
            do="give every column a name of its own",
        )
