"""Reading delimited text strictly: what is not understood is refused with its place, and work is bounded.

Read are UTF-8, with or without a byte order mark, and UTF-16 with one; cells separated by commas, tabs or
semicolons, quoted or not; decimal points, and decimal commas where they can be nothing else. Of tables that
others wrote more is forgiven, which is declared in `read_table` and remarked in the table.
"""

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.errors import UsageError
from autd_trials.tables.content import read_content
from autd_trials.tables.decimals import MAYBE_THOUSANDS, foreign_numbers, is_numeric, pointed
from autd_trials.tables.foreign import (
    fitted,
    is_header_again,
    listed_lines,
    named_columns,
    opening,
    without_outer_quotes,
)
from autd_trials.tables.spelling import level_text, number, without_shield

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_CELLS = 2_000_000
LARGEST_NUMBER = 1e12
"""What a column's numbers keep to if it does not declare its bounds: sums and squares stay finite."""

_SEPARATORS = {",": "commas", "\t": "tabs", ";": "semicolons"}
_FOREIGN_SEPARATORS = {"|": "bars", " ": "spaces"}
_STATED = re.compile(rb'"?sep=([\x20-\x7e\t])"?(?=[\r\n])')
_FIRST_LINE = re.compile(rb'\s*(?:"[^"]*"|[^"\r\n])*')
_QUOTED = re.compile(rb'"[^"]*"?')
_LONGEST_HEADER = 131_072
_LONGEST_SHOWN = 40  # characters of a cell in a message
_MOST_LISTED = 40  # columns in a message
_MUST_RISE = ", but must rise"
_PLAIN_NUMBERS = "write numbers with a decimal point and without separators of thousands"


@dataclass(frozen=True)
class Quantity:
    """A column of numbers, and what they must be.

    Attributes
    ----------
    name
        The column's name.
    least, largest
        Its bounds, both included.
    rising
        Whether each number must be larger than the one before.
    whole
        Whether the numbers must be whole.
    gaps
        Whether a cell may say ``nan``; all others must be finite.
    """

    name: str
    least: float = -LARGEST_NUMBER
    largest: float = LARGEST_NUMBER
    rising: bool = False
    whole: bool = False
    gaps: bool = False


@dataclass(frozen=True, eq=False)
class Table:
    """A table as it was read: every row has a cell under every name.

    Attributes
    ----------
    path
        The file.
    separator
        What separates its cells.
    header
        The names of its columns, all different.
    rows
        The cells of every row as they are written.
    lines
        The number of the line in which each row begins, from 1.
    header_line
        The same of the names.
    foreign
        Whether others wrote it, and more was forgiven.
    remarks
        What was forgiven and might matter.
    """

    path: Path
    separator: str
    header: tuple[str, ...]
    rows: Sequence[Sequence[str]]
    lines: Sequence[int]
    header_line: int = 1
    foreign: bool = False
    remarks: tuple[str, ...] = ()

    @property
    def where_header(self) -> str:
        """The place of the names, for a message."""
        return f"{self.path}:{self.header_line}"

    def where(self, row: int) -> str:
        """Return a row's place for a message; rows are counted from 0."""
        return f"{self.path}:{self.lines[row]}"

    def require(self, names: Sequence[str], advice: str = "") -> None:
        """Raise UsageError if a column is missing; `advice` says what the columns must be."""
        missing = [name for name in names if name not in self.header]
        if missing:
            raise UsageError(
                f"the columns {', '.join(missing)} are missing; there are {_listed(self.header)}",
                where=self.where_header,
                do=f"name them {', '.join(names)}" + (f": {advice}" if advice else ""),
            )

    def column(self, name: str) -> list[str]:
        """Return the cells of a column as they are written, but for spaces around them."""
        place = self.header.index(name)
        return [without_shield(row[place].strip()) for row in self.rows]

    def records(self) -> Iterator[tuple[str, dict[str, str]]]:
        """Yield every row's place and its cells by column, without spaces around them."""
        for row, cells in enumerate(self.rows):
            texts = (without_shield(cell.strip()) for cell in cells)
            yield self.where(row), dict(zip(self.header, texts, strict=True))

    def with_decimal_points(self) -> "Table":
        """Return the table with the decimal commas of its numeric columns as points.

        A column is numeric if all its cells are numbers or missing. Commas are left alone where they may be
        something else. What others wrote is judged column by column, as `foreign_numbers` says.
        """
        columns = [self.column(name) for name in self.header]
        if self.foreign:
            written, doubtful = foreign_numbers(columns, self.separator)
            remarks = (
                f"commas in {self.header[place]} are read as decimal ones, {text} as {text.replace(',', '.')}"
                for place, text in doubtful
            )
            return replace(self, rows=list(zip(*written, strict=True)), remarks=(*self.remarks, *remarks))
        numeric = [index for index, texts in enumerate(columns) if all(map(is_numeric, texts))]
        if not self._has_decimal_commas(chain(*(columns[index] for index in numeric))):
            return self
        for index in numeric:
            columns[index] = pointed(columns[index])
        return replace(self, rows=list(zip(*columns, strict=True)))

    def quantities(self, columns: Sequence[Quantity], advice: str = "") -> "NDArray[np.float64]":
        """Return columns of numbers, shape (rows, columns).

        Parameters
        ----------
        columns
            The columns and what their numbers must be.
        advice
            What the columns must be, in words.

        Raises
        ------
        UsageError
            A column is missing, or a cell is not what its column declares; the first such row is named.
        """
        import numpy as np

        self.require([column.name for column in columns], advice)
        places = [self.header.index(column.name) for column in columns]
        texts: list[Sequence[str]] = [[row[place] for row in self.rows] for place in places]
        if self._has_decimal_commas(chain(*texts)):
            texts = [pointed(each) for each in texts]
        values = np.empty((len(self.rows), len(columns)))
        refused: list[tuple[int, int, str]] = []
        for place, (column, its_texts) in enumerate(zip(columns, texts, strict=True)):
            values[:, place] = _numbers(its_texts)
            first = _first_refused(column, values[:, place], its_texts)
            if first is not None:
                refused.append((first[0], place, first[1]))
        if refused:
            row, place, what = min(refused)
            raise UsageError(what, where=self.where(row), do=_mend(what, texts[place][row], advice))
        return values

    def _has_decimal_commas(self, texts: Iterable[str]) -> bool:
        """Return whether commas in these numbers can only be decimal ones."""
        if self.separator == ",":
            return False
        spelled = list(texts)
        commas = [text.strip() for text in spelled if "," in text]
        if not commas or any("." in text for text in spelled):
            return False
        # Who separates by semicolons does so because the comma is in use. With tabs 1,234 may be over 1000.
        return self.separator == ";" or not all(map(MAYBE_THOUSANDS.fullmatch, commas))


def read_quantities(
    path: Path, what: str, columns: Sequence[Quantity], *, advice: str = "", unfinished: bool = False
) -> "NDArray[np.float64]":
    """Read columns of numbers, shape (rows, columns): `read_table`, then `Table.quantities`."""
    return read_table(path, what, unfinished=unfinished).quantities(columns, advice)


def read_table(
    path: Path,
    what: str,
    *,
    separator: str | None = None,
    unfinished: bool = False,
    foreign: bool = False,
    encoding: str | None = None,
) -> Table:
    """Read a table whose first line names its columns; rows without any text are left out.

    Parameters
    ----------
    path
        The file.
    what
        What it is, for messages.
    separator
        What separates cells. If it is not given, it is what a first line ``sep=...`` says, or what separates
        the names of the columns.
    unfinished
        Whether the file may have been cut off while it was written: a last line without its end is left out.
    foreign
        Whether others wrote the table, who cannot be asked for better. Then these are forgiven, and what
        might matter is among the table's remarks: gzip; Windows-1252 (Latin-1) and UTF-16 without a mark;
        lines of one cell before the names; the names once more further down, where files were joined; columns
        without a name; empty cells behind the last column; lines in quotes as a whole; bars or single spaces
        between cells; separators that only the rows tell apart.
    encoding
        The encoding, where it is known.

    Raises
    ------
    UsageError
        The file cannot be read, is larger than 32 MB or 2,000,000 cells, or is no table: it is no text, a
        name is missing or there twice, a row is longer or shorter than the first line, or a cell has over
        131,072 characters.
    """
    found = read_content(path, what, foreign=foreign, encoding=encoding)
    content = found.text
    if unfinished:
        content = content[: content.rfind(b"\n") + 1]
    stated = _STATED.match(content)
    separator = separator or (stated[1].decode() if stated else None)
    start = None
    separators = _SEPARATORS | _FOREIGN_SEPARATORS if foreign else _SEPARATORS
    if foreign and not stated and (inner := without_outer_quotes(content)) is not None:
        content = inner
    if foreign and separator in (None, *separators):
        table = content[stated.end() :] if stated else content
        start = opening(table, [separator] if separator else [*_SEPARATORS])
        if start is None and separator is None and not _signs(content):
            start = opening(table, [*_FOREIGN_SEPARATORS])
    if start is not None:
        separator = start.separator
    separator = separator or _detected(content, path)
    if content.count(separator.encode()) + content.count(b"\n") + content.count(b"\r") > MOST_CELLS:
        raise UsageError(f"the {what} has over {MOST_CELLS:,} cells", where=str(path), do="give a part of it")
    if separator not in separators:
        raise UsageError(
            f"the cells are separated by {separator!r}",
            where=f"{path}:1",
            do=f"separate them by {', '.join(_SEPARATORS.values())}",
        )
    before = start.before if start is not None else 0
    parsed = _parsed(
        content, path, what, separator, first_line=2 if stated else 1, before=before, foreign=foreign
    )
    return replace(parsed, remarks=(*found.remarks, *parsed.remarks))


def _detected(content: bytes, path: Path) -> str:
    """Return what separates the names in the first line; of a single name, what the file's name says."""
    found = _signs(content)
    if len(found) > 1:
        raise UsageError(
            f"the first line has {' and '.join(_SEPARATORS[sign] for sign in found)}, so what separates the "
            "columns is not clear",
            where=f"{path}:1",
            do="put names of columns that hold such a sign in double quotes",
        )
    return found[0] if found else "\t" if path.suffix.lower() == ".tsv" else ","


def _signs(content: bytes) -> list[str]:
    """Return what may separate the names in the first line."""
    first = _FIRST_LINE.match(content[:_LONGEST_HEADER])
    names = _QUOTED.sub(b"", first[0] if first else b"")
    return [sign for sign in _SEPARATORS if sign.encode() in names]


def _parsed(
    content: bytes, path: Path, what: str, separator: str, *, first_line: int, before: int, foreign: bool
) -> Table:
    lines = io.TextIOWrapper(io.BytesIO(content), encoding="utf-8", newline="")
    reader = csv.reader(lines, delimiter=separator, strict=True)
    header: tuple[str, ...] = ()
    header_line = 1
    rows: list[list[str]] = []
    starts: list[int] = []
    skipped: list[str] = []  # what stands before the names
    again: list[int] = []  # lines that name the columns once more
    end = 0  # the last line of the row before
    try:
        for cells in reader:
            start, end = end + 1, reader.line_num
            if not any(cells) or start < first_line or not any(map(str.strip, cells)):
                continue
            if len(skipped) < before:
                skipped.append(" ".join(map(str.strip, cells)).strip())
            elif not header:
                header, header_line = tuple(name.strip() for name in cells), start
                _check_header(header, f"{path}:{start}", foreign=foreign)
            elif len(row := fitted(cells, header) if foreign else cells) != len(header):
                raise _wrong_length(cells, header, separator, f"{path}:{start}")
            elif foreign and is_header_again(row, header, f"{path}:{start}"):
                again.append(start)
            else:
                rows.append(row)
                starts.append(start)
    except csv.Error as error:
        raise UsageError(
            f"the {what} cannot be read: {error}",
            where=f"{path}:{end + 1}",
            do="see that every quote is closed, and that no cell has over 131,072 characters",
        ) from error
    if not header:
        raise UsageError(
            f"the {what} is empty", where=f"{path}:1", do="give a table whose first line names its columns"
        )
    names = named_columns(header, rows)
    if len(names) < len(header):
        rows = [[cells[place] for place in names] for cells in rows]
    remarks = tuple(_forgiven(skipped, again)) if foreign else ()
    return Table(path, separator, tuple(names.values()), rows, starts, header_line, foreign, remarks)


def _forgiven(skipped: Sequence[str], again: Sequence[int]) -> Iterator[str]:
    if skipped:
        yield f"{len(skipped)} line(s) before the names of the columns skipped: {_listed(skipped)}"
    if again:
        yield (
            f"{len(again)} line(s) that name the columns once more skipped: {listed_lines(again)}; "
            "it seems that files were joined"
        )


def _check_header(header: Sequence[str], where: str, *, foreign: bool) -> None:
    if not foreign and not all(header):
        number_ = header.index("") + 1
        raise UsageError(
            f"column {number_} of {len(header)} has no name", where=where, do="name it or take it out"
        )
    twice = [name for name, count in Counter(header).items() if name and count > 1]
    if twice:
        raise UsageError(
            f"these columns are there more than once: {_listed(twice)}",
            where=where,
            do="give every column a name of its own",
        )


def _wrong_length(cells: Sequence[str], header: Sequence[str], separator: str, where: str) -> UsageError:
    commas = separator == "," and len(cells) > len(header)
    return UsageError(
        f"{len(cells)} cells under {len(header)} column names",
        where=where,
        do=f"{_PLAIN_NUMBERS}; put cells that hold a comma in double quotes"
        if commas
        else "give every row a cell under every name",
    )


def _numbers(texts: Sequence[str]) -> "NDArray[np.float64]":
    """Return the numbers that texts are, NaN for those that are none."""
    import numpy as np

    joined = "".join(texts)
    if joined.isascii() and "_" not in joined:  # then float() and number() differ only in what is not finite
        with suppress(ValueError):  # some are no numbers: each is then read by itself, which takes longer
            return np.fromiter(map(float, texts), np.float64, len(texts))
    found = (number(text) for text in texts)
    return np.array([math.nan if value is None else value for value in found], dtype=np.float64)


def _first_refused(
    column: Quantity, values: "NDArray[np.float64]", texts: Sequence[str]
) -> tuple[int, str] | None:
    """Return the first row whose number is not what its column declares, and what is wrong with it."""
    import numpy as np

    finite = np.isfinite(values)
    bad = ~finite | (values < column.least) | (values > column.largest)
    if column.whole:
        bad |= values % 1 != 0
    if column.rising:
        bad[1:] |= ~(values[1:] > values[:-1])
    if column.gaps:
        bad &= ~np.array([text.strip().lower() == "nan" for text in texts], dtype=bool)
    if not bad.any():
        return None
    row = int(bad.argmax())
    text, value = _shortened(texts[row]), values[row]
    what = f"{column.name} is {text}"
    if not text:
        what = f"{column.name} is empty"
    elif not finite[row]:
        what = f"{column.name} is {text!r}, which is not a finite number"
    elif value < column.least:
        what += f", but must be at least {level_text(column.least)}"
    elif value > column.largest:
        what += f", but must be at most {level_text(column.largest)}"
    elif column.whole and value % 1:
        what += ", but must be a whole number"
    else:
        what += f" after {_shortened(texts[row - 1])}{_MUST_RISE}"
    return row, what


def _mend(what: str, text: str, advice: str) -> str:
    if "," in text:
        return _PLAIN_NUMBERS
    if what.endswith(_MUST_RISE):
        return "put the lines in order; if a clock was set back meanwhile, record again"
    return f"correct or remove this line: {advice}" if advice else "correct or remove this line"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(map(_shortened, names[:_MOST_LISTED])) + more


def _shortened(text: str) -> str:
    spelled = text.strip()
    return spelled if len(spelled) <= _LONGEST_SHOWN else f"{spelled[:_LONGEST_SHOWN]}..."
