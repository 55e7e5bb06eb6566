"""Columns declared once, with what they mean and how they are got; tables written as BIDS wants them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from autd_trials.tables.spelling import Value, cell_text, shielded

Row = TypeVar("Row", contravariant=True)
Of = TypeVar("Of")
Part = TypeVar("Part")


@dataclass(frozen=True)
class Column(Generic[Row]):
    """A column: what it means, and how its value is got from what a row is about.

    Attributes
    ----------
    name
        The column's name.
    description
        One sentence or two.
    get
        Returns the value of a row.
    units
        Unit in BIDS' spelling, for a quantity.
    levels
        The values that may occur, each with its meaning, for a category.
    """

    name: str
    description: str
    get: Callable[[Row], Value]
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict)


def tsv(columns: Sequence[Column[Of]], rows: Iterable[Of]) -> str:
    """Return a table as tab-separated text, its first line the columns' names; nothing in it is a formula."""
    lines = [[shielded(column.name) for column in columns]]
    lines += [[_quoted(shielded(cell_text(column.get(row)))) for column in columns] for row in rows]
    return "".join("\t".join(line) + "\n" for line in lines)


def cells(columns: Iterable[Column[Of]], row: Of) -> dict[str, Value]:
    """Return a row's values by the columns' names."""
    return {column.name: column.get(row) for column in columns}


def describe(columns: Iterable[Column[Any]]) -> dict[str, Any]:
    """Return the part of a BIDS sidecar that describes columns."""
    return {column.name: _description(column) for column in columns}


def of(part: Callable[[Of], Part | None], get: Callable[[Part], Value]) -> Callable[[Of], Value]:
    """Return how a value is got from a part of a row; it is missing where the part is."""

    def value(row: Of) -> Value:
        found = part(row)
        return None if found is None else get(found)

    return value


def _quoted(text: str) -> str:
    # A quote elsewhere is only a character; at the beginning it would be taken for a quoted cell.
    return '"' + text.replace('"', '""') + '"' if text.startswith('"') else text


def _description(column: Column[Any]) -> dict[str, Any]:
    about: dict[str, Any] = {"Description": column.description}
    if column.units:
        about["Units"] = column.units
    if column.levels:
        about["Levels"] = dict(column.levels)
    return about
