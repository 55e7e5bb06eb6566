"""Tables as BIDS wants them: tab-separated text, and a sidecar that describes every column."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

Value = str | float | bool | None
MISSING = "n/a"


@dataclass(frozen=True)
class Column:
    """A column and what its sidecar says of it.

    Parameters
    ----------
    name
        The column's name.
    description
        One sentence or two.
    units
        Unit in BIDS' spelling, for a quantity.
    levels
        The values that may occur, each with its meaning, for a category.
    """

    name: str
    description: str
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict)


SIMULATED = Column(
    "simulated",
    "Whether a simulated participant answered.",
    levels={"yes": "A program answered.", "no": "A person answered."},
)
"""In every table of trials and of sessions: each file that someone opens says what it is."""


def tsv(columns: Sequence[Column], rows: Iterable[Mapping[str, Value]]) -> str:
    """Return a table as text; what a row does not have is ``n/a``."""
    lines = [[column.name for column in columns]]
    lines += [[cell(row.get(column.name)) for column in columns] for row in rows]
    return "".join("\t".join(line) + "\n" for line in lines)


def cell(value: Value) -> str:
    """Return one value as a table's text: numbers exactly and in plain notation, truth as yes or no."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return " ".join(value.split()) or MISSING
    if value == int(value):
        return str(int(value))
    return format(Decimal(repr(value)), "f")


def to_us(seconds: float | None) -> float | None:
    """Round a time in s to 1 us, so that its text is short and stable."""
    return None if seconds is None else round(seconds, 6)


def describe(columns: Iterable[Column]) -> dict[str, Any]:
    """Return the sidecar's part about columns."""
    return {column.name: _describe(column) for column in columns}


def json_text(content: Mapping[str, Any]) -> str:
    """Return a JSON file's text."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _describe(column: Column) -> dict[str, Any]:
    about: dict[str, Any] = {"Description": column.description}
    if column.units:
        about["Units"] = column.units
    if column.levels:
        about["Levels"] = dict(column.levels)
    return about
