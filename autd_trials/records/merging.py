"""What people added to a file that is made again: kept, whatever is made now.

Each function is given what was made last (`base`), what lies there now (`theirs`) and what is made now
(`ours`). What people added to `base` is carried into `ours`. What they took out or overwrote of it comes
back: it is made from the logs.
"""

from collections.abc import Mapping
from difflib import SequenceMatcher
from typing import Any

from autd_trials.tables import MISSING, shielded


def merge_lines(base: str, theirs: str, ours: str) -> str:
    """Return a text with the lines that people added, each behind the line it stood behind.

    None comes before the first line, which says what the data are.
    """
    made, there, new = (text.splitlines() for text in (base, theirs, ours))
    at: dict[int, list[str]] = {}
    places = _new_places(made, new)
    for tag, start, _, first, last in SequenceMatcher(None, made, there, autojunk=False).get_opcodes():
        if tag in ("insert", "replace"):
            at.setdefault(max(1, places[start]), []).extend(there[first:last])
    lines = []
    for number, line in enumerate(new):
        lines += at.pop(number, []) if number else []
        lines.append(line)
    for number in sorted(at):
        lines += at[number]
    return "".join(f"{line}\n" for line in lines)


def _new_places(made: list[str], new: list[str]) -> list[int]:
    """Return for each place before, between and behind the old lines where it is among the new ones."""
    places = [0] * (len(made) + 1)
    for start, new_start, size in SequenceMatcher(None, made, new, autojunk=False).get_matching_blocks():
        for offset in range(size):
            places[start + offset + 1] = new_start + offset + 1
    for number in range(1, len(places)):
        places[number] = places[number] or places[number - 1]
    return places


def merge_objects(base: Any, theirs: Any, ours: Any) -> Any:
    """Return a JSON value with the keys that people added, and with the values that they changed."""
    if not isinstance(theirs, Mapping) or not isinstance(ours, Mapping):
        return ours if theirs == base else theirs
    made = base if isinstance(base, Mapping) else {}
    merged = {
        key: merge_objects(made[key], theirs[key], value) if key in theirs and key in made else value
        for key, value in ours.items()
    }
    added = {key: value for key, value in theirs.items() if key not in ours and key not in made}
    return merged | added


class NotATableError(Exception):
    """A file that people edited cannot be read as the table that was made."""


def merge_table(base: str, theirs: str, ours: str) -> str:
    """Return a tab-separated table with the columns and rows that people added; the first column is the key.

    Raises
    ------
    NotATableError
        `theirs` is no such table any more.
    """
    made, there, new = (_rows(text) for text in (base, theirs, ours))
    key = new.header[0]
    if key not in there.header:
        raise NotATableError
    added = [name for name in there.header if name not in new.header and name not in made.header]
    header = [*new.header, *added]
    rows = {row[key]: dict(row) for row in new.rows}
    for row in there.rows:
        own = {name: row[name] for name in added}
        if row[key] in rows:
            rows[row[key]] |= own
        elif row[key] not in {old[key] for old in made.rows} or set(own.values()) - {MISSING, ""}:
            rows[row[key]] = row
    lines = [header, *([row.get(name, "") or MISSING for name in header] for row in rows.values())]
    return "".join("\t".join(map(shielded, line)) + "\n" for line in lines)


class _Table:
    def __init__(self, header: list[str], rows: list[dict[str, str]]) -> None:
        self.header = header
        self.rows = rows


def _rows(text: str) -> _Table:
    lines = [line.split("\t") for line in text.removeprefix("\ufeff").splitlines() if line.strip("\t ")]
    header = [name.strip() for name in lines[0]] if lines else [""]
    if len(set(header)) < len(header) or any(len(line) > len(header) for line in lines):
        raise NotATableError
    return _Table(header, [dict(zip(header, line + [""] * len(header), strict=False)) for line in lines[1:]])
