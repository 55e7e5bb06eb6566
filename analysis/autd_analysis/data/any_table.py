"""Trials from any table of single answers: CSV or TSV, whoever recorded it."""

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.data.any_row import is_simulated, trial_row
from autd_analysis.data.checks import look_alikes, trial_warnings, uneven_cells
from autd_analysis.data.design import Design, StudyFactor, refuse_reserved
from autd_analysis.data.trial_table import TABLE_SUFFIX, TrialRow
from autd_analysis.data.trials import Trials, data_frame
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison, Level
from autd_trials.tables import MISSING_WORDS, Table, level_text, number, read_table

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
    "onset_lateness",
    "start_margin",
    "silent_before",
    "emitting_after",
    "presses_before_onset",
    "presses_late",
    "underruns",
    "simulated",
)
"""What a table may have besides factors; the first two are needed. Times are in s."""

_MOST_LEVELS = 50


@dataclass(frozen=True)
class TableRequest:
    """How to read a table.

    Attributes
    ----------
    columns
        The table's column for each of our names: those in `KNOWN`, and factors. A column `simulated` is
        always read.
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

    Without a column for trials every line is a trial of its own, and their order tells nothing. Lines without
    an answer, interrupted ones and practice are kept but not counted, and said to be. A BIDS table of events
    (``*_events.tsv``) needs no names for those columns that are called as in `KNOWN`, and may have
    participant and session in its name.

    Parameters
    ----------
    path
        Delimited text, as `autd_trials.tables.read_table` takes it.
    request
        Which column is what.

    Raises
    ------
    UsageError
        The table cannot be read, lacks a column, or has answers, levels or trials that make no sense.
    """
    file = read_table(path, "table").with_decimal_points()
    columns = _columns(path, request, file.header)
    names = _factor_names(path, columns, file.header)
    stray = [name for name in request.levels if name not in names]
    if stray:
        raise UsageError(
            f"--levels names {', '.join(stray)}, which is no factor",
            where=str(path),
            do=f"name {', '.join(names)}",
        )
    lines = _lines(file, columns, _entities(path))
    if not lines:
        raise UsageError("the table has no trials", where=str(path))
    factors = tuple(_factor(path, name, lines, request) for name in names)
    design = Design(path.stem, None, factors, _checked(path, request.comparisons, factors))
    rows = [trial_row(where, cells, line, factors) for line, (where, cells) in enumerate(lines, start=1)]
    _refuse_duplicates(lines, rows)
    if not any(row.used for row in rows):
        raise UsageError("no trial is complete and answered", where=str(path))
    simulated = [is_simulated(where, cells) for where, cells in lines]
    return Trials(
        design=design,
        table=data_frame(rows, design),
        simulated=any(simulated),
        warnings=(
            *trial_warnings([], {path: rows}, design),
            *uneven_cells(rows),
            *_look_alikes(design),
            *_not_read(file.header, columns),
            *_mixed_origins(simulated),
            *_uneven_catch_trials(rows, factors),
        ),
        inputs=(path,),
        ordered="trial" in columns,
        command=_command(path, request),
    )


def _columns(path: Path, request: TableRequest, header: Sequence[str]) -> dict[str, str]:
    """Return the table's column for each of our names, also of those that need not be named."""
    unknown = [column for column in request.columns.values() if column not in header]
    if unknown:
        raise UsageError(
            f"there is no column {', '.join(map(repr, unknown))}",
            where=f"{path}:1",
            do=f"name some of {', '.join(header)}",
        )
    understood = KNOWN if path.name.endswith(TABLE_SUFFIX) else ("simulated",)
    taken = set(request.columns.values())
    return {name: name for name in understood if name in header and name not in taken} | dict(request.columns)


def _entities(path: Path) -> dict[str, str]:
    """Return participant and session as a BIDS table's name has them."""
    found = re.match(r"sub-(?P<participant>[A-Za-z0-9]+)_(ses-(?P<session>[A-Za-z0-9]+)_)?", path.name)
    is_bids = found and path.name.endswith(TABLE_SUFFIX)
    return {name: label for name, label in found.groupdict().items() if label} if found and is_bids else {}


def _factor_names(path: Path, columns: Mapping[str, str], header: Sequence[str]) -> list[str]:
    """Return the names of the factors; refuses if something that is needed is not named."""
    for needed in KNOWN[:2]:
        if needed not in columns and needed not in _entities(path):
            raise UsageError(
                f"no column is named for {needed}",
                where=str(path),
                do=f"add {needed}=COLUMN to --columns; the columns are {', '.join(header)}",
            )
    names = [name for name in columns if name not in KNOWN]
    if not names:
        others = ", ".join(column for column in header if column not in columns.values()) or "none"
        raise UsageError(
            "no factor is named",
            where=str(path),
            do=f"add FACTOR=COLUMN to --columns, such as clothing=cloth; other columns are {others}",
        )
    refuse_reserved(names, str(path), "call it otherwise in --columns: NAME=COLUMN")
    return names


def _lines(
    file: Table, columns: Mapping[str, str], entities: Mapping[str, str]
) -> list[tuple[str, dict[str, str]]]:
    """Return each line's place and its cells under our names."""
    return [
        (place, {**entities, **{ours: cells[theirs] for ours, theirs in columns.items()}})
        for place, cells in file.records()
    ]


def _look_alikes(design: Design) -> "Iterator[str]":
    for factor in design.factors:
        for words in look_alikes(map(level_text, factor.levels)):
            yield f"levels of {factor.name} that differ only in case: {words}; are they one?"


def _not_read(header: Sequence[str], columns: Mapping[str, str]) -> "Iterator[str]":
    others = [column for column in header if column not in columns.values()]
    if others:
        yield f"columns of the table that were not read: {', '.join(others)}"


def _mixed_origins(simulated: Sequence[bool]) -> "Iterator[str]":
    if any(simulated) and not all(simulated):
        yield (
            f"{sum(simulated)} of {len(simulated)} lines are of simulated participants and the others are "
            "not: results of a mixture are neither"
        )


def _uneven_catch_trials(rows: Sequence[TrialRow], factors: Sequence[StudyFactor]) -> "Iterator[str]":
    catch = [row for row in rows if row.trial_type == "catch"]
    for factor in factors:
        without = sum(row.levels[factor.name] is None for row in catch)
        if 0 < without < len(catch):
            yield (
                f"{without} of {len(catch)} catch trials have no level of {factor.name}: false alarms of all "
                "its levels are taken together"
            )


def _command(path: Path, request: TableRequest) -> str:
    """Return what a person types to read the table so."""
    words = ["autd-trials", "analyse", path.name]
    if request.columns:
        words += ["--columns", ",".join(f"{name}={column}" for name, column in request.columns.items())]
    for name, levels in request.levels.items():
        words += ["--levels", f"{name}={','.join(levels)}"]
    for comparison in request.comparisons:
        at = f"@{comparison.at_each}" if comparison.at_each else ""
        levels = [level_text(comparison.first), level_text(comparison.second)]
        words += ["--compare", f"{comparison.factor}={','.join(levels)}{at}"]
    return shlex.join(words)


def _factor(
    path: Path, name: str, lines: Sequence[tuple[str, dict[str, str]]], request: TableRequest
) -> StudyFactor:
    found = {cells[name] for _, cells in lines if cells[name].lower() not in MISSING_WORDS}
    words = list(request.levels.get(name, ())) or sorted(found, key=_order)
    numeric = all(number(word) is not None for word in [*words, *found])
    # 25 and 25.0 are one level.
    levels: tuple[Level, ...] = tuple(dict.fromkeys(float(word) if numeric else word for word in words))
    if not 1 <= len(levels) <= _MOST_LEVELS:
        raise UsageError(f"{name} has {len(levels)} levels", where=str(path), do="is it a factor?")
    catch = [cells[name] for _, cells in lines if cells.get("trial_type") == "catch"]
    with_level = [word for word in catch if word.lower() not in MISSING_WORDS]
    # What catch trials have a level of they share with the stimuli around them, as clothes do.
    factor = StudyFactor(name, levels, {}, within_block=not catch or len(with_level) < len(catch))
    strange = sorted((word for word in found if factor.parse(word) is None), key=_order)
    if strange:
        raise UsageError(
            f"{name} has levels that --levels does not name: {', '.join(strange)}",
            where=str(path),
            do="name all levels, or leave that factor out of --levels",
        )
    return factor


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
        if comparison.at_each == comparison.factor:
            raise UsageError(
                f"{comparison.factor} is compared at each of its own levels",
                where=str(path),
                do="name another factor after @, or none",
            )
        factor = known[comparison.factor]
        levels = [factor.parse(level_text(level)) for level in (comparison.first, comparison.second)]
        if None in levels or levels[0] == levels[1]:
            allowed = ", ".join(map(level_text, factor.levels))
            raise UsageError(
                f"{comparison.first} and {comparison.second} are not two levels of {factor.name}",
                where=str(path),
                do=f"compare two of {allowed}" if len(factor.levels) > 1 else "there is one condition only",
            )
        found = comparison.model_copy(update={"first": levels[0], "second": levels[1]})
        mirrored = comparison.model_copy(update={"first": levels[1], "second": levels[0]})
        if found in checked or mirrored in checked:
            raise UsageError("--compare asks for the same comparison twice", where=str(path), do="ask once")
        checked.append(found)
    return tuple(checked)


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
                do="take one of them out, name the column of sessions, number trials through the session, or "
                "leave trial out of --columns",
            )
        seen[key] = where


def _order(word: str) -> tuple[int, float, str]:
    """Numbers by size, words after them by the alphabet."""
    value = number(word)
    return (1, 0.0, word) if value is None else (0, value, word)
