"""How numbers and levels are spelled in every table, key and label, and how such text is read back."""

import math
import re
from collections.abc import Mapping
from decimal import Decimal

from autd_trials.neutral import printable

Value = str | float | bool | None
"""What a cell may hold; None is missing."""

MISSING = "n/a"
MISSING_WORDS = frozenset({"", "n/a", "na", "nan"})
"""What a cell without a value may say, in small letters."""

FOREIGN_MISSING_WORDS = MISSING_WORDS | {
    *("none", "null", "missing", "<na>", ".", "-", "--"),
    *("#n/a", "#na", "#nv", "#n/d"),
}
"""What other programs and spreadsheets write in a cell of numbers or answers that has none."""

_SHIELDED = re.compile(r"'*[=+\-@\uff1d\uff0b\uff0d\uff20]")  # also of full width
"""How a cell begins that a spreadsheet computes, or that was kept from being computed."""


def cell_text(value: Value) -> str:
    """Return one value as a table's text: numbers as `level_text`, truth as yes or no, missing as n/a.

    In words, spaces and line breaks are one space, and what no text file may hold is a replacement character.

    >>> cell_text(True), cell_text(None), cell_text(-2.5e-05), cell_text("two words")
    ('yes', 'n/a', '-0.000025', 'two words')

    Raises
    ------
    ValueError
        A number is not finite.
    """
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return printable(" ".join(value.split())) or MISSING
    return level_text(value)


def shielded(text: str) -> str:
    """Return a cell's text so that a spreadsheet does not compute it: an apostrophe before a formula.

    Numbers stay numbers.

    >>> shielded("=1+1"), shielded("-5"), shielded("n/a"), shielded("a=b")
    ("'=1+1", '-5', 'n/a', 'a=b')
    """
    return f"'{text}" if _SHIELDED.match(text) and number(text) is None else text


def without_shield(text: str) -> str:
    """Return what `shielded` was given."""
    return text[1:] if text.startswith("'") and _SHIELDED.match(text) else text


def level_text(level: float | str) -> str:
    """Return a level as plans, tables, keys and labels spell it: exact, in plain notation.

    The text of a number is the shortest that reads back as the same number; whole numbers have no point.

    >>> level_text(25.0), level_text(5e-05), level_text("inner")
    ('25', '0.00005', 'inner')

    Raises
    ------
    ValueError
        A number is not finite.
    """
    if isinstance(level, str):
        return level
    if not math.isfinite(level):
        raise ValueError(f"{level!r} has no place in a table; missing is None")
    if level == 0:
        return "0"  # also of -0.0
    digits = format(Decimal(str(level) if isinstance(level, int) else float.__repr__(level)), "f")
    return digits.rstrip("0").rstrip(".") if "." in digits else digits


def number(text: str) -> float | None:
    """Return the finite number that a text is, written with ASCII digits and a decimal point; None otherwise.

    >>> number(" 1.5e3 "), number("1,5"), number("nan"), number("1_000")
    (1500.0, None, None, None)
    """
    # float() also takes underscores and the digits of other scripts.
    if not text.isascii() or "_" in text:
        return None
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def spelled_levels(described: Mapping[str, str]) -> dict[str, str]:
    """Return sentences about levels with their keys spelled as `level_text` does: "5e-05" as "0.00005".

    Raises
    ------
    ValueError
        Two keys are the same level.
    """
    spelled: dict[str, str] = {}
    for key, sentence in described.items():
        value = number(key)
        level = key if value is None else level_text(value)
        if level in spelled:
            raise ValueError(f"the level {level} is described twice")
        spelled[level] = sentence
    return spelled
