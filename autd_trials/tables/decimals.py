"""Numbers as people and programs write them: decimal commas, units behind, signs of other keyboards."""

import re
from collections.abc import Iterable, Sequence

from autd_trials.tables.spelling import FOREIGN_MISSING_WORDS, MISSING_WORDS, number

DECIMAL_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+([eE][+-]?[0-9]+)?")
MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")

_MAYBE_POINTED_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")
_PLAIN = {ord(sign) + 0xFEE0: sign for sign in "0123456789.,+-"} | {ord("\N{MINUS SIGN}"): "-"}
"""Signs of the full width of East Asian letters, and the typographic minus."""
_QUANTITY = re.compile(
    r"(?P<number>[+-]?(?:[0-9]+(?:[.,][0-9]+)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"(?:\s?(?P<unit>(?:[^\W\d_]|[%‰°/²³·^])(?:[^\W\d_]|[%‰°/²³·^ ]){0,11}))?"
)


def is_numeric(text: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma, or missing."""
    return text.lower() in MISSING_WORDS or number(text) is not None or bool(DECIMAL_COMMA.fullmatch(text))


def pointed(texts: Sequence[str]) -> list[str]:
    """Return cells with the decimal commas of numbers as points."""
    return [text.replace(",", ".") if DECIMAL_COMMA.fullmatch(text.strip()) else text for text in texts]


def quantity(text: str) -> tuple[float, str] | None:
    """Return a number and the unit behind it, which may be empty; None if a text is no such thing.

    >>> quantity("100 Hz"), quantity("2.5"), quantity("0.5mm"), quantity("1. Mai"), quantity("thin")
    ((100.0, 'Hz'), (2.5, ''), (0.5, 'mm'), None, None)
    """
    plain = number(text)
    if plain is not None:
        return plain, ""
    found = _QUANTITY.fullmatch(text)
    value = number(found["number"]) if found else None
    return None if found is None or value is None else (value, found["unit"] or "")


def foreign_numbers(
    columns: Sequence[Sequence[str]], separator: str
) -> tuple[list[Sequence[str]], list[tuple[int, str]]]:
    """Return the columns of a table that others wrote, with the numbers in them as we write them.

    In a column whose cells are all numbers, with units or without, or missing, commas become points where
    they can only be decimal ones: some of them cannot group thousands, and no number with a point says
    otherwise; or all could, but cells are separated by semicolons, or other columns have decimal commas, and
    no column has points.

    Parameters
    ----------
    columns
        The cells of each column, without spaces around them.
    separator
        What separates the cells in the file.

    Returns
    -------
    columns : list of list of str
        The cells of each column.
    doubtful : list of (int, str)
        The columns in which only the rest of the table says that commas are decimal, and such a number.
    """
    plain = [[_plain(text) for text in texts] for texts in columns]
    numbers = [_numbers(texts) for texts in plain]
    all_numbers = [text for texts in numbers if texts for text in texts]
    pointless = not any("." in text for text in all_numbers)
    commas_in_use = separator == ";" or any(_surely_decimal(texts) for texts in numbers if texts)
    written: list[Sequence[str]] = []
    doubtful = []
    for place, (texts, spelled) in enumerate(zip(plain, numbers, strict=True)):
        sure = spelled is not None and _surely_decimal(spelled)
        commas = [text for text in spelled or () if "," in text]
        if commas and not sure and pointless and commas_in_use:
            doubtful.append((place, commas[0]))
        decimal = sure or (commas_in_use and pointless and spelled is not None)
        written.append([text.replace(",", ".") for text in texts] if decimal else texts)
    return written, doubtful


def _plain(text: str) -> str:
    """Return a number of another keyboard in ASCII; other text as it is."""
    if text.isascii():
        return text
    plain = text.translate(_PLAIN)
    return plain if _QUANTITY.fullmatch(plain) else text


def _numbers(texts: Iterable[str]) -> list[str] | None:
    """Return the numbers in a column's cells; None if it is no column of numbers."""
    found = []
    for text in texts:
        if text.lower() in FOREIGN_MISSING_WORDS:
            continue
        match = _QUANTITY.fullmatch(text)
        if match is None:
            return None
        found.append(match["number"])
    return found


def _surely_decimal(numbers: Sequence[str]) -> bool:
    """Return whether the commas of a column can only be decimal ones, as the column itself shows."""
    commas = [text for text in numbers if "," in text]
    points = [text for text in numbers if "." in text]
    return not all(map(MAYBE_THOUSANDS.fullmatch, commas)) and not any(
        map(_MAYBE_POINTED_THOUSANDS.fullmatch, points)
    )
