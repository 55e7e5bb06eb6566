"""Trials from any table of answers, whoever recorded it: CSV or TSV, one file or several."""

import glob
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from autd_analysis.data.checks import copies, trial_warnings, uneven_cells
from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.data.foreign.answers import refuse_status, trial_types, understood_answers
from autd_analysis.data.foreign.columns import (
    bare_stem,
    columns_of,
    factor_names,
    is_bids,
    participants_from_names,
    refuse_nonsense,
    require_columns,
)
from autd_analysis.data.foreign.factors import (
    checked_comparisons,
    refuse_strange_factors,
    refuse_too_many,
    study_factor,
)
from autd_analysis.data.foreign.lines import (
    expanded,
    table_lines,
    with_catch,
    with_sessions,
    without_empty,
    without_excluded,
)
from autd_analysis.data.foreign.remarks import (
    empty,
    from_names,
    look_alikes,
    mixed_origins,
    not_read,
    of_answers,
    of_catch_trials,
    of_levels,
    of_nobody,
    of_tables,
    slow,
)
from autd_analysis.data.foreign.request import (
    TableRequest,
    columns_option,
    command,
    words_option,
)
from autd_analysis.data.foreign.row import Line, Meaning, is_simulated, trial_row
from autd_analysis.data.foreign.words import (
    TRIAL_STATUS,
    Levels,
    is_missing,
    joined_labels,
    levels_of,
    one_label,
    plain_words,
)
from autd_analysis.data.trial_table import TrialRow
from autd_analysis.data.trials import Trials, data_frame
from autd_trials.errors import UsageError
from autd_trials.tables import Table
from autd_trials.tables import read_table as read_text

_UNSAID = {"trial_type": "stimulus", "trial_status": "complete"}
"""What holds of trials where no column says it."""


def table_paths(named: Sequence[str | Path]) -> tuple[Path, ...]:
    """Return the files that names and patterns mean, each once, those of a pattern in the order of names.

    Raises
    ------
    UsageError
        A pattern fits no file, or a file is named twice.
    """
    paths: list[Path] = []
    for each in named:
        path = Path(each)
        if path.exists() or not glob.has_magic(str(each)):
            paths.append(path)
            continue
        found = sorted(Path(name) for name in glob.glob(str(each)) if Path(name).is_file())  # noqa: PTH207
        if not found:
            raise UsageError("no file fits this pattern", where=str(each), do="name files that are there")
        paths += found
    twice = [path for path, count in Counter(path.resolve() for path in paths).items() if count > 1]
    if twice:
        raise UsageError("the file is named twice", where=str(twice[0]), do="name it once")
    return tuple(paths)


def read_tables(paths: Sequence[Path], request: TableRequest) -> Trials:
    """Read tables of answers as one.

    Without a column for trials every line is a trial of its own, and their order is unknown. Lines without
    an answer, interrupted ones and practice are kept but not counted, and said to be. A BIDS table of events
    (``*_events.tsv``) needs no names for those columns that are called as in
    `autd_analysis.data.foreign.columns.KNOWN`, and may have participant and session in its name.

    Parameters
    ----------
    paths
        The files, at least one: delimited text, as `autd_trials.tables.read_table` takes it from others.
    request
        Which column is what.

    Raises
    ------
    UsageError
        A table cannot be read, lacks a column, or has answers, levels or trials that make no sense.
    """
    refuse_nonsense(request)
    refuse_strange_factors(request)
    files = _opened(paths, request)
    found = _trial_lines(files, request)
    meaning, factors = _understood(found, files.where, request)
    design = Design(
        title(paths),
        None,
        factors,
        checked_comparisons(files.where, request.comparisons, factors, found.levels),
    )
    rows = _numbered_through(
        [trial_row(line, count, meaning) for count, line in enumerate(found.lines, start=1)], found.lines
    )
    _refuse_duplicates(found.lines, rows, request)
    simulated = [is_simulated(line) for line in found.lines]
    return Trials(
        design=design,
        table=data_frame(rows, design),
        simulated=any(simulated),
        warnings=(
            *of_tables(files.tables),
            *copies(paths),
            *from_names(paths, files.labels, files.columns),
            *of_nobody(rows),
            *joined_labels("participants", meaning.participants),
            *joined_labels("sessions", meaning.sessions),
            *trial_warnings([], {_shown(paths): rows}, design),
            *uneven_cells(rows),
            *look_alikes(design),
            *of_levels(factors, found.levels, request),
            *found.excluded,
            *empty(found.skipped),
            *of_answers(meaning.answers, request, files.columns),
            *of_catch_trials(rows, found.lines, factors, found.levels),
            *slow(rows, request),
            *not_read(files.tables, files.columns, request),
            *mixed_origins(simulated),
        ),
        inputs=tuple(paths),
        ordered=all("trial" in its_columns for its_columns in files.columns),
        command=command(paths, request),
    )


@dataclass(frozen=True)
class _Files:
    """The files, what each of their columns is, and whose answers each has by its name, if that says so."""

    paths: Sequence[Path]
    tables: Sequence[Table]
    columns: Sequence[Mapping[str, str]]
    labels: Sequence[str] | None

    @property
    def where(self) -> str:
        """Their place, for messages about all of them."""
        more = f" and {len(self.paths) - 1} more" if len(self.paths) > 1 else ""
        return f"{self.paths[0]}{more}"


def _opened(paths: Sequence[Path], request: TableRequest) -> _Files:
    """Read the files' cells; raises UsageError if one lacks a column."""
    tables = [_read(path, request) for path in paths]
    columns = [columns_of(table, request) for table in tables]
    labels = participants_from_names(paths) if request.participant is None else None
    for table, its_columns in zip(tables, columns, strict=True):
        require_columns(table, its_columns, request, names_tell=labels is not None)
    return _Files(paths, tables, columns, labels)


@dataclass(frozen=True)
class _TrialLines:
    """The lines that are trials, the levels of the factors, what was excluded in words, and empty lines."""

    lines: Sequence[Line]
    levels: Mapping[str, Levels]
    excluded: Sequence[str]
    skipped: Sequence[Line]


def _trial_lines(files: _Files, request: TableRequest) -> _TrialLines:
    """Return the lines of all files that are trials; raises UsageError if there are none."""
    read = [
        line
        for file, (table, its_columns) in enumerate(zip(files.tables, files.columns, strict=True))
        for line in table_lines(file, table, its_columns, _known_otherwise(files, file, request))
    ]
    if not read:
        raise UsageError("the table has no trials", where=files.where)
    kept, excluded = without_excluded(read, request.exclude)
    levels = {
        name: levels_of(list(dict.fromkeys(line.cells[name] for line in kept)))
        for name in factor_names(request)
    }
    answered, skipped = without_empty(kept, levels)
    lines = with_sessions(expanded(with_catch(answered, request.catch), files.where))
    if not lines:
        raise UsageError("no line is left to be a trial", where=files.where, do="exclude fewer lines")
    return _TrialLines(lines, levels, excluded, skipped)


def _understood(
    found: _TrialLines, where: str, request: TableRequest
) -> tuple[Meaning, tuple[StudyFactor, ...]]:
    """Return what words mean, and the factors; raises UsageError where words do not make trials."""
    types = trial_types(found.lines)
    refuse_status(found.lines, request)
    understood = understood_answers(found.lines, request)
    counted, catch = _counted(found.lines, types, understood)
    if not counted:
        kinds = "is complete and answered" if not catch else "that is no catch trial is complete and answered"
        raise UsageError(f"no trial {kinds}", where=where)
    factors = tuple(
        study_factor(name, counted, catch, of, request, where) for name, of in found.levels.items()
    )
    refuse_too_many(factors, where, request)
    meaning = Meaning(
        participants=one_label(line.cells["participant"] for line in found.lines),
        sessions=one_label(line.cells["session"] for line in found.lines),
        trial_types=types,
        answers=understood,
        levels={name: of.of for name, of in found.levels.items()},
        conditions={factor.name: factor.levels for factor in factors},
    )
    return meaning, factors


def title(paths: Sequence[Path]) -> str:
    """Return what the study is called: as its file, or as the folder of its files."""
    if len(paths) == 1:
        return bare_stem(paths[0])
    return paths[0].resolve().parent.name or bare_stem(paths[0])


def _shown(paths: Sequence[Path]) -> Path:
    return paths[0] if len(paths) == 1 else Path(f"{len(paths)} tables")


def _read(path: Path, request: TableRequest) -> Table:
    table = read_text(path, "table", foreign=True, encoding=request.encoding).with_decimal_points()
    return replace(table, header=tuple(plain_words(name) for name in table.header))


def _known_otherwise(files: _Files, file: int, request: TableRequest) -> dict[str, str]:
    """Return cells that a file's name, or what was asked for, says of all its lines."""
    session = _session(files.paths[file]) or ("1" if len(files.paths) == 1 else "")
    known = {"session": session, "response": "", **_UNSAID}
    if request.participant is not None:
        known["participant"] = request.participant
    elif files.labels is not None:
        known["participant"] = files.labels[file]
    return known


def _session(path: Path) -> str | None:
    if not is_bids(path):
        return None
    parts = dict(part.split("-", 1) for part in path.name.split("_") if "-" in part)
    return parts.get("ses")


def _counted(
    lines: Sequence[Line], types: Mapping[str, str], understood: Mapping[str, bool | None]
) -> tuple[list[Line], list[Line]]:
    """Return the lines of complete and answered stimuli, and those of catch trials."""
    stimuli, catch = (
        [line for line in lines if types[line.cells["trial_type"]] == kind] for kind in ("stimulus", "catch")
    )
    counted = [
        line
        for line in stimuli
        if understood[line.cells["response"]] is not None
        and TRIAL_STATUS[line.cells["trial_status"].lower()] == "complete"
    ]
    return counted, catch


def _numbered_through(rows: Sequence[TrialRow], lines: Sequence[Line]) -> list[TrialRow]:
    """Return the trials of each session numbered through it, where numbers begin anew in each block."""
    if "block" not in lines[0].cells or "trial" not in lines[0].cells:
        return list(rows)
    keys = [
        (row.participant, row.session, row.block, row.trial) for row in rows if row.trial_status == "complete"
    ]
    in_session = {(participant, session, trial) for participant, session, _, trial in keys}
    if len(in_session) == len(keys) or len(set(keys)) < len(keys):
        return list(rows)
    places: dict[tuple[str, str], set[tuple[int, int]]] = defaultdict(set)
    for row in rows:
        places[row.participant, row.session].add((row.block, row.trial))
    numbers = {
        (session, place): count
        for session, its_places in places.items()
        for count, place in enumerate(sorted(its_places), start=1)
    }
    return [
        replace(row, trial=numbers[(row.participant, row.session), (row.block, row.trial)]) for row in rows
    ]


def _refuse_duplicates(lines: Sequence[Line], rows: Sequence[TrialRow], request: TableRequest) -> None:
    seen: dict[tuple[str, str, int], str] = {}
    for line, row in zip(lines, rows, strict=True):
        if is_missing(line.cells.get("trial", "")) or row.trial_status != "complete":
            continue
        key = (row.participant, row.session, row.trial)
        if key in seen:
            rest = {ours: theirs for ours, theirs in request.columns.items() if ours != "trial"}
            without = (
                columns_option(rest)
                if "trial" in request.columns
                else words_option("--ignore", [*request.ignore, "trial"])
            )
            raise UsageError(
                f"trial {row.trial} of {row.participant} is complete twice, here and in {seen[key]}",
                where=line.where,
                do="take one of them out, name the column of sessions or of blocks, or leave the numbers of "
                f"trials out: {without}",
            )
        seen[key] = line.where
