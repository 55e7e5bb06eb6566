"""Trials from any table of single answers: CSV or TSV, whoever recorded it."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.checks import trial_warnings
from analysis.design import Design, StudyFactor, format_level
from analysis.trial_table import TrialRow
from analysis.trials import Trials, data_frame
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison, Level

if TYPE_CHECKING:
    from collections.abc import Iterator

KNOWN = (
    "participant",
    "response",
    "session",
    "block",
    "trial",
    "trial_type",
    "trial_status",
    "response_time",
)
"""What a table may have besides factors; the first two are needed."""

_FELT = {
    "felt": True,
    "1": True,
    "true": True,
    "yes": True,
    "not_felt": False,
    "0": False,
    "false": False,
    "no": False,
}
_MISSING = {"", "n/a", "na", "nan"}
_MOST_LEVELS = 50


@dataclass(frozen=True)
class TableRequest:
    """How to read a table.

    Attributes
    ----------
    columns
        The table's column for each of our names: those in `KNOWN`, and factors.
    levels
        Order of a factor's levels; those that are not named are refused. Others: as numbers, or by the
        alphabet.
    comparisons
        What to compare.
    """

    columns: Mapping[str, str]
    levels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    comparisons: tuple[Comparison, ...] = ()


def read_any_table(path: Path, request: TableRequest) -> Trials:
    """Read a table of single answers.

    Without a column for trials every line is a trial of its own. Lines without an answer, interrupted ones
    and practice are kept but not counted, and said to be.

    Parameters
    ----------
    path
        CSV, or TSV if its name ends so; the first line names the columns.
    request
        Which column is what.

    Raises
    ------
    UsageError
        The table cannot be read, lacks a column, or has answers, levels or trials that make no sense.
    """
    names = [name for name in request.columns if name not in KNOWN]
    for needed in KNOWN[:2]:
        if needed not in request.columns:
            raise UsageError(
                f"no column is named for {needed}", where=str(path), do=f"add {needed}=COLUMN to --columns"
            )
    if not names:
        raise UsageError(
            "no factor is named", where=str(path), do="add FACTOR=COLUMN to --columns, such as clothing=cloth"
        )
    lines = list(_lines(path, request.columns))
    if not lines:
        raise UsageError("the table has no trials", where=str(path))
    factors = tuple(_factor(path, name, lines, request) for name in names)
    design = Design(path.stem, None, factors, _checked(path, request.comparisons, factors))
    rows = [_row(where, cells, number, factors) for number, (where, cells) in enumerate(lines, start=1)]
    _refuse_duplicates(lines, rows)
    if not any(row.used for row in rows):
        raise UsageError("no trial is complete and answered", where=str(path))
    return Trials(
        design=design,
        table=data_frame(rows, design),
        simulated=False,
        warnings=trial_warnings([], {path: rows}, design),
        inputs=(path,),
    )


def _lines(path: Path, columns: Mapping[str, str]) -> "Iterator[tuple[str, dict[str, str]]]":
    """Return each line's place and its cells under our names."""
    try:
        text = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"the table cannot be read: {error}", where=str(path)) from error
    reader = csv.DictReader(text, delimiter="\t" if path.suffix == ".tsv" else ",")
    header = [name.strip() for name in reader.fieldnames or []]
    reader.fieldnames = header
    unknown = [column for column in columns.values() if column not in header]
    if unknown:
        raise UsageError(
            f"there is no column {', '.join(map(repr, unknown))}",
            where=f"{path}:1",
            do=f"name some of {', '.join(header)}" if header else "give a table with a first line of names",
        )
    for cells in reader:
        place = f"{path}:{reader.line_num}"
        yield place, {ours: (cells[theirs] or "").strip() for ours, theirs in columns.items()}


def _factor(
    path: Path, name: str, lines: Sequence[tuple[str, dict[str, str]]], request: TableRequest
) -> StudyFactor:
    found = {cells[name] for _, cells in lines if cells[name].lower() not in _MISSING}
    words = list(request.levels.get(name, ()))
    if not words:
        words = sorted(found, key=_order)
    strange = sorted(found - set(words), key=_order)
    if strange:
        raise UsageError(
            f"{name} has levels that --levels does not name: {', '.join(strange)}",
            where=str(path),
            do="name all levels, or leave that factor out of --levels",
        )
    if not 1 <= len(words) <= _MOST_LEVELS:
        raise UsageError(f"{name} has {len(words)} levels", where=str(path), do="is it a factor?")
    numeric = all(_number(word) is not None for word in words)
    levels: tuple[Level, ...] = tuple(float(word) if numeric else word for word in words)
    return StudyFactor(name, levels, {}, within_block=True)


def _checked(
    path: Path, comparisons: tuple[Comparison, ...], factors: Sequence[StudyFactor]
) -> tuple[Comparison, ...]:
    """Return the comparisons with their levels as the factors have them."""
    known = {factor.name: factor for factor in factors}
    checked = []
    for comparison in comparisons:
        for name in filter(None, (comparison.factor, comparison.at_each)):
            if name not in known:
                raise UsageError(
                    f"{name} is compared but no factor", where=str(path), do=f"name {', '.join(known)}"
                )
        factor = known[comparison.factor]
        levels = [factor.parse(str(level)) for level in (comparison.first, comparison.second)]
        if None in levels or levels[0] == levels[1]:
            allowed = ", ".join(map(format_level, factor.levels))
            raise UsageError(
                f"{comparison.first} and {comparison.second} are not two levels of {factor.name}",
                where=str(path),
                do=f"compare two of {allowed}" if len(factor.levels) > 1 else "there is one condition only",
            )
        checked.append(comparison.model_copy(update={"first": levels[0], "second": levels[1]}))
    return tuple(checked)


def _row(where: str, cells: Mapping[str, str], number: int, factors: Sequence[StudyFactor]) -> TrialRow:
    trial_type = cells.get("trial_type") or "stimulus"
    status = cells.get("trial_status") or "complete"
    if trial_type not in ("stimulus", "catch", "practice"):
        raise UsageError(f"trial_type is {trial_type!r}", where=where, do="write stimulus, catch or practice")
    if status not in ("complete", "interrupted"):
        raise UsageError(f"trial_status is {status!r}", where=where, do="write complete or interrupted")
    if not cells["participant"]:
        raise UsageError("the participant is missing", where=where)
    return TrialRow(
        participant=cells["participant"],
        session=cells.get("session") or "1",
        block=_whole(cells.get("block"), "block", where, default=1),
        trial=_whole(cells.get("trial"), "trial", where, default=number),
        attempt=1,
        trial_type=trial_type,
        trial_status=status,
        felt=_answer(cells["response"], where),
        response_time_s=_number(cells.get("response_time", "")),
        levels={factor.name: _level(factor, cells[factor.name], trial_type, where) for factor in factors},
    )


def _answer(text: str, where: str) -> bool | None:
    if text.lower() in _MISSING:
        return None
    if text.lower() not in _FELT:
        raise UsageError(
            f"response is {text!r}, which is no yes or no",
            where=where,
            do=f"write one of {', '.join(_FELT)}, or n/a",
        )
    return _FELT[text.lower()]


def _level(factor: StudyFactor, text: str, trial_type: str, where: str) -> Level | None:
    if text.lower() in _MISSING:
        if trial_type != "stimulus":
            return None
        raise UsageError(
            f"{factor.name} is missing", where=where, do="only catch and practice trials may lack it"
        )
    return factor.parse(text)


def _refuse_duplicates(lines: Sequence[tuple[str, dict[str, str]]], rows: Sequence[TrialRow]) -> None:
    seen: dict[tuple[str, str, int], str] = {}
    for (where, cells), row in zip(lines, rows, strict=True):
        if not cells.get("trial") or row.trial_status != "complete":
            continue
        key = (row.participant, row.session, row.trial)
        if key in seen:
            raise UsageError(
                f"trial {row.trial} of {row.participant} is complete twice, here and in {seen[key]}",
                where=where,
                do="take one of them out, or name the column of sessions",
            )
        seen[key] = where


def _whole(text: str | None, name: str, where: str, *, default: int) -> int:
    if not text:
        return default
    if not text.isdecimal():
        raise UsageError(f"{name} is {text!r}", where=where, do="give a whole number")
    return int(text)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _order(word: str) -> tuple[int, float, str]:
    """Numbers by size, words after them by the alphabet."""
    number = _number(word)
    return (1, 0.0, word) if number is None else (0, number, word)
