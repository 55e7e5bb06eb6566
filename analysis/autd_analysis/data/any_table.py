"""Trials from any table of answers, whoever recorded it: CSV or TSV, one file or several."""

import glob
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from autd_analysis.data.any_columns import (
    bare_stem,
    columns_of,
    factor_names,
    is_bids,
    participants_from_names,
    refuse_nonsense,
    require_columns,
)
from autd_analysis.data.any_factors import (
    checked_comparisons,
    refuse_strange_factors,
    refuse_too_many,
    study_factor,
)
from autd_analysis.data.any_lines import (
    expanded,
    table_lines,
    with_catch,
    with_sessions,
    without_empty,
    without_excluded,
)
from autd_analysis.data.any_remarks import (
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
from autd_analysis.data.any_row import Line, Meaning, is_simulated, trial_row
from autd_analysis.data.any_words import (
    TRIAL_STATUS,
    TRIAL_TYPES,
    answers,
    few,
    is_missing,
    joined_labels,
    levels_of,
    one_label,
    plain_words,
)
from autd_analysis.data.checks import copies, trial_warnings, uneven_cells
from autd_analysis.data.design import Design
from autd_analysis.data.table_request import (
    Choice,
    TableRequest,
    choice_option,
    columns_option,
    command,
    parse_choices,
    parse_columns,
    parse_comparison,
    parse_words,
    words_option,
)
from autd_analysis.data.trial_table import TrialRow
from autd_analysis.data.trials import Trials, data_frame
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison
from autd_trials.tables import Table, level_text, number
from autd_trials.tables import read_table as read_text

_UNSAID = {"trial_type": "stimulus", "trial_status": "complete"}
"""What holds of trials where no column says it."""

_LIKE_CATCH = re.compile(
    r"^(1|true|yes)$|catch|no|blank|absent|null|sham|empty|zero|ohne|kein", re.IGNORECASE
)

Typed = str | Sequence[str]
Chosen = Typed | Mapping[str, object]


def read_table(
    paths: str | Path | Sequence[str | Path],
    *,
    columns: str | Mapping[str, str],
    levels: Mapping[str, Sequence[object]] | None = None,
    compare: Typed | Sequence[Comparison] = (),
    yes: object = (),
    catch: Chosen = (),
    exclude: Chosen = (),
    ignore: Typed = (),
    participant: str | None = None,
    encoding: str | None = None,
) -> Trials:
    """Read a table of answers, as ``autd-trials analyse`` does with the options of the same names.

    Parameters
    ----------
    paths
        One file, several, or a pattern such as ``"data/*.csv"``: CSV or TSV, also with semicolons, decimal
        commas, in UTF-16 or Latin-1, or packed by gzip. Files are read as one table; without a column of
        participants their names say whose answers they have.
    columns
        The table's column for each of our names, as ``{"participant": "who", "hz": "freq", ...}`` or
        ``"participant=who,response=felt,hz=freq"``. What is none of
        `autd_analysis.data.any_columns.KNOWN` is a factor. ``felt`` and ``n`` instead of ``response``
        are counts: so many of so many trials in a line.
    levels
        The order of factors' levels.
    compare
        What to compare within participants, as ``"clothing=inner,outer@hz"``.
    yes
        The answers that mean felt (or right); all others then do not.
    catch
        What makes a line a catch trial, as ``{"amplitude": 0}`` or ``"amplitude=0"``.
    exclude
        Lines that are left out, as ``{"participant": ["P3", "P7"]}`` or ``"phase=practice"``.
    ignore
        Columns of which it is not said that they were not read.
    participant
        Whose answers these are, if the table does not say so.
    encoding
        The files' encoding, if it is not found.

    Returns
    -------
    Trials
        The trials; its `warnings` say what was not read, not counted, or taken for something.

    Raises
    ------
    UsageError
        A table cannot be read, lacks a column, or has answers, levels or trials that make no sense.
    """
    listed = [paths] if isinstance(paths, str | Path) else list(paths)
    request = TableRequest(
        columns=parse_columns(columns) if isinstance(columns, str) else dict(columns),
        levels={name: tuple(map(_typed, words)) for name, words in (levels or {}).items()},
        comparisons=tuple(
            parse_comparison(each) if isinstance(each, str) else each
            for each in ([compare] if isinstance(compare, str) else compare)
        ),
        yes=_several(yes),
        catch=_choices(catch, "--catch"),
        exclude=_choices(exclude, "--exclude"),
        ignore=_several(ignore),
        participant=participant,
        encoding=encoding,
    )
    return read_any_table(table_paths(listed), request)


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


def read_any_table(paths: Sequence[Path], request: TableRequest) -> Trials:
    """Read tables of answers as one.

    Without a column for trials every line is a trial of its own, and their order tells nothing. Lines without
    an answer, interrupted ones and practice are kept but not counted, and said to be. A BIDS table of events
    (``*_events.tsv``) needs no names for those columns that are called as in
    `autd_analysis.data.any_columns.KNOWN`, and may have participant and session in its name.

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
    where = str(paths[0]) if len(paths) == 1 else f"{paths[0]} and {len(paths) - 1} more"
    tables = [_read(path, request) for path in paths]
    columns = [columns_of(table, request) for table in tables]
    labels = participants_from_names(paths) if request.participant is None else None
    for table, its_columns in zip(tables, columns, strict=True):
        require_columns(table, its_columns, request, names_tell=labels is not None)
    names = factor_names(request)
    read = [
        line
        for file, (table, its_columns) in enumerate(zip(tables, columns, strict=True))
        for line in table_lines(file, table, its_columns, _known_otherwise(table.path, file, labels, request))
    ]
    if not read:
        raise UsageError("the table has no trials", where=where)
    kept, excluded = without_excluded(read, request.exclude)
    levels = {name: levels_of(list(dict.fromkeys(line.cells[name] for line in kept))) for name in names}
    answered, skipped = without_empty(kept, levels)
    lines = with_sessions(expanded(with_catch(answered, request.catch), where))
    if not lines:
        raise UsageError("no line is left to be a trial", where=where, do="exclude fewer lines")
    types = _trial_types(lines)
    _refuse_status(lines, request)
    understood = _answers(lines, request)
    counted, catch = _counted(lines, types, understood)
    if not counted:
        kinds = "is complete and answered" if not catch else "that is no catch trial is complete and answered"
        raise UsageError(f"no trial {kinds}", where=where)
    factors = tuple(study_factor(name, counted, catch, levels[name], request, where) for name in names)
    refuse_too_many(factors, where, request)
    design = Design(
        title(paths), None, factors, checked_comparisons(where, request.comparisons, factors, levels)
    )
    meaning = Meaning(
        participants=one_label(line.cells["participant"] for line in lines),
        sessions=one_label(line.cells["session"] for line in lines),
        trial_types=types,
        answers=understood,
        levels={name: of.of for name, of in levels.items()},
        conditions={factor.name: factor.levels for factor in factors},
    )
    rows = _numbered_through(
        [trial_row(line, count, meaning) for count, line in enumerate(lines, start=1)], lines
    )
    _refuse_duplicates(lines, rows, request)
    simulated = [is_simulated(line) for line in lines]
    return Trials(
        design=design,
        table=data_frame(rows, design),
        simulated=any(simulated),
        warnings=(
            *of_tables(tables),
            *copies(paths),
            *from_names(paths, labels, columns),
            *of_nobody(rows),
            *joined_labels("participants", meaning.participants),
            *joined_labels("sessions", meaning.sessions),
            *trial_warnings([], {_shown(paths): rows}, design),
            *uneven_cells(rows),
            *look_alikes(design),
            *of_levels(factors, levels, request),
            *excluded,
            *empty(skipped),
            *of_answers(meaning.answers, request, columns),
            *of_catch_trials(rows, lines, factors, levels),
            *slow(rows, request),
            *not_read(tables, columns, request),
            *mixed_origins(simulated),
        ),
        inputs=tuple(paths),
        ordered=all("trial" in its_columns for its_columns in columns),
        command=command(paths, request),
    )


def _several(words: object) -> tuple[str, ...]:
    if isinstance(words, str):
        return parse_words([words])
    return tuple(map(_typed, words)) if isinstance(words, Iterable) else (_typed(words),)


def _typed(word: object) -> str:
    """Return a word or number of Python as it is typed."""
    is_number = isinstance(word, int | float) and not isinstance(word, bool)
    return level_text(word) if is_number else str(word)  # type: ignore[arg-type]


def _choices(chosen: Chosen, option: str) -> tuple[Choice, ...]:
    if isinstance(chosen, Mapping):
        return tuple((name, word) for name, words in chosen.items() for word in _several(words))
    return parse_choices([chosen] if isinstance(chosen, str) else chosen, option)


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


def _known_otherwise(
    path: Path, file: int, labels: Sequence[str] | None, request: TableRequest
) -> dict[str, str]:
    """Return cells that a file's name, or what was asked for, says of all its lines."""
    known = {"session": _session(path) or "", "response": "", **_UNSAID}
    if request.participant is not None:
        known["participant"] = request.participant
    elif labels is not None:
        known["participant"] = labels[file]
    return known


def _session(path: Path) -> str | None:
    if not is_bids(path):
        return None
    parts = dict(part.split("-", 1) for part in path.name.split("_") if "-" in part)
    return parts.get("ses")


def _trial_types(lines: Sequence[Line]) -> dict[str, str]:
    """Return what each word for a type of trial means."""
    found = Counter(line.cells["trial_type"] for line in lines)
    types = {word: TRIAL_TYPES.get(word.lower(), "") for word in found}
    types |= {word: "stimulus" for word in found if is_missing(word)}
    unknown = sorted(word for word, kind in types.items() if not kind)
    if unknown:
        first = next(line for line in lines if line.cells["trial_type"] in unknown)
        catch = min(unknown, key=lambda word: (not _LIKE_CATCH.search(word), found[word]))
        raise UsageError(
            f"trial_type is {', '.join(map(repr, unknown[:5]))}",
            where=first.where,
            do="write stimulus, catch or practice, or say which is that of catch trials: "
            f"{choice_option('--catch', 'trial_type', catch)}",
        )
    return types


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


def _refuse_status(lines: Sequence[Line], request: TableRequest) -> None:
    """Raise UsageError if a word for the status of a trial is not understood."""
    found = dict.fromkeys(line.cells["trial_status"] for line in lines)
    unknown = [word for word in found if word.lower() not in TRIAL_STATUS]
    if unknown:
        rest = {ours: theirs for ours, theirs in request.columns.items() if ours != "trial_status"}
        first = next(line for line in lines if line.cells["trial_status"] in unknown)
        raise UsageError(
            f"trial_status is {few([repr(word) for word in unknown])}",
            where=first.where,
            do="write complete or interrupted, or leave it out: "
            + (
                columns_option(rest)
                if len(unknown) == len(found)
                else choice_option("--exclude", "trial_status", *unknown)
            ),
        )


def _answers(lines: Sequence[Line], request: TableRequest) -> dict[str, bool | None]:
    """Return what each answer means."""
    found = Counter(line.cells["response"] for line in lines)
    understood = answers(found, request.yes)
    unknown = [word for word in found if word not in understood]
    if unknown:
        first = next(line for line in lines if line.cells["response"] in unknown)
        if not request.yes and _are_rates(found):
            raise UsageError(
                f"response is {few([repr(word) for word in unknown])}, which is no answer but a rate",
                where=first.where,
                do="give a line a trial, or counts: felt=COLUMN,n=COLUMN in --columns",
            )
        stray = sum(found[word] for word in unknown) * 10 < len(lines) and len(unknown) <= 5
        advice = (
            f"write 1, 0 or n/a, or leave such lines out: {first.excluding('response')}"
            if stray
            else f"say which mean felt, as in {words_option('--yes', [_likely_yes(unknown)])}"
        )
        raise UsageError(
            f"response is {few([repr(word) for word in unknown])}, which is no yes or no",
            where=first.where,
            do=advice,
        )
    if request.yes and True not in understood.values():
        words = [word for word, meaning in understood.items() if meaning is not None]
        raise UsageError(
            f"no answer is {' or '.join(request.yes)}; they are {few(words) or 'all missing'}",
            where="--yes",
            do=f"name some of them, as in {words_option('--yes', [_likely_yes(words)])}" if words else None,
        )
    return understood


def _are_rates(found: Iterable[str]) -> bool:
    """Return whether answers are shares of trials."""
    values = [number(word) for word in found]
    shares = [value for value in values if value is not None and 0 <= value <= 1]
    return len(shares) == len(values) and len(set(shares) - {0, 1}) > 1


def _likely_yes(words: Sequence[str]) -> str:
    """Return which of the answers may mean felt: the largest number, or the first word."""
    numbers = [word for word in words if number(word) is not None]
    return (
        max(numbers, key=lambda word: number(word) or 0) if len(numbers) == len(words) else sorted(words)[0]
    )


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
