"""Tables of results as HTML, to be read: rounded, and without columns that say nothing or always the same."""

from collections.abc import Iterator, Sequence
from typing import Any

from autd_analysis.report.elements import Content, Element, tag, wide
from autd_analysis.report.table import ResultTable, Row
from autd_analysis.report.wording import MINUS
from autd_trials.tables import Column, Value, cell_text

_DIGITS = 4
_LONG = 24  # characters of a cell that may be broken into lines
_MOST_COLUMNS, _MOST_ROWS = 12, 8  # beyond that many columns, a table of not more rows is laid on its side
_EVERYWHERE = "simulated"
"""A column that the page's head speaks for."""


def table_section(table: ResultTable) -> Element:
    """Return a folded table with the description of its columns."""
    heading = tag("summary", tag("code", f"{table.name}.tsv"), f" {table.about}")
    if not table.rows:
        return tag("details", heading, tag("p", "It has no rows."))
    columns = [column for column in table.columns if column.name != _EVERYWHERE]
    constant = {column.name: text for column in columns if (text := _everywhere_the_same(column, table.rows))}
    shown = [column for column in columns if column.name not in constant]
    on_its_side = len(shown) > _MOST_COLUMNS and len(table.rows) <= _MOST_ROWS
    lay_out, kind = (_on_its_side, "side") if on_its_side else (_upright, "upright")
    content = (tag("caption", tag("span", f"{table.name}.tsv")), *lay_out(table.rows, shown))
    return tag(
        "details",
        heading,
        wide(tag("table", *content, class_=kind), table.name),
        *_notes(constant),
        tag("details", tag("summary", f"Columns of {table.name}"), _descriptions(columns)),
    )


def _everywhere_the_same(column: Column[Any], rows: Sequence[Row]) -> str | None:
    """Return what a column says if it is n/a throughout, or the same words in several rows."""
    values = {row[column.name] for row in rows}
    if values == {None}:
        return cell_text(None)
    (value, *others) = values
    return value if len(rows) > 1 and not others and isinstance(value, str) else None


def _notes(constant: dict[str, str]) -> Iterator[Element]:
    if constant:
        facts = "; ".join(f"{name}: {text}" for name, text in constant.items())
        yield tag("p", f"The same in every row: {facts}.", class_="note")


def _upright(rows: Sequence[Row], columns: Sequence[Column[Any]]) -> Iterator[Element]:
    yield tag("thead", tag("tr", *(_head(column, "col") for column in columns)))
    yield tag("tbody", *(tag("tr", *(_cell(row[column.name]) for column in columns)) for row in rows))


def _on_its_side(rows: Sequence[Row], columns: Sequence[Column[Any]]) -> Iterator[Element]:
    yield tag(
        "tbody",
        *(tag("tr", _head(column, "row"), *(_cell(row[column.name]) for row in rows)) for column in columns),
    )


def _head(column: Column[Any], scope: str) -> Element:
    return tag("th", *_breakable(column.name), scope=scope, title=column.description)


def _breakable(name: str) -> Iterator[Content]:
    """Let a name be broken into lines after its underscores."""
    *parts, last = name.split("_")
    for part in parts:
        yield f"{part}_"
        yield tag("wbr")
    yield last


def _cell(value: Value) -> Element:
    if isinstance(value, float | int) and not isinstance(value, bool):
        return tag("td", _rounded(value), class_="number")
    text = cell_text(value)
    return tag("td", text, class_="words") if len(text) > _LONG else tag("td", text)


def _rounded(value: float) -> str:
    text = str(value) if isinstance(value, int) else f"{value:.{_DIGITS}g}"
    return text.replace("-", MINUS)


def _descriptions(columns: Sequence[Column[Any]]) -> Element:
    pairs = (each for column in columns for each in (tag("dt", column.name), tag("dd", column.description)))
    return tag("dl", *pairs)
