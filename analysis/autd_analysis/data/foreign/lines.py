"""The lines of somebody's tables that are trials: read, left out as asked, marked, one for every trial."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from autd_analysis.data.foreign.columns import COUNTS
from autd_analysis.data.foreign.request import Choice, choice_option
from autd_analysis.data.foreign.row import Line, counts
from autd_analysis.data.foreign.words import (
    TRIAL_TYPES,
    Levels,
    few,
    is_missing,
    is_same,
    one_label,
    plain_words,
)
from autd_trials.errors import UsageError
from autd_trials.tables import FOREIGN_MISSING_WORDS, Table

_MOST_TRIALS = 1_000_000


def table_lines(
    file: int, table: Table, columns: Mapping[str, str], known: Mapping[str, str]
) -> Iterator[Line]:
    """Yield the lines of a table; `known` are cells of all of them that the table itself need not have."""
    for where, cells in table.records():
        others = {name: plain_words(cell) for name, cell in cells.items()}
        yield Line(
            where, file, {**known, **{ours: others[theirs] for ours, theirs in columns.items()}}, others
        )


def without_excluded(lines: Sequence[Line], exclude: Sequence[Choice]) -> tuple[list[Line], list[str]]:
    """Return the lines that are not to be left out, and what was left out in words."""
    kept, remarks = list(lines), []
    for name, value in exclude:
        left_out = [line for line in lines if is_same(_cell(line, name, value, lines, "--exclude"), value)]
        if not left_out:
            raise _never(name, value, lines, "--exclude")
        remarks.append(f"{len(left_out)} line(s) with {name} {value} left out, as asked for")
        gone = set(map(id, left_out))
        kept = [line for line in kept if id(line) not in gone]
    return kept, remarks


def without_empty(lines: Sequence[Line], levels: Mapping[str, Levels]) -> tuple[list[Line], list[Line]]:
    """Return the lines that are trials, and those that have neither an answer nor a level, such as breaks."""
    answered = ("response", *COUNTS)

    def is_empty(line: Line) -> bool:
        cells = line.cells
        return (
            all(cells.get(name, "").lower() in FOREIGN_MISSING_WORDS for name in answered)
            and all(of.of[cells[name]] is None for name, of in levels.items())
            and TRIAL_TYPES.get(cells["trial_type"].lower()) != "catch"
        )

    empty = list(map(is_empty, lines))
    return (
        [line for line, left_out in zip(lines, empty, strict=True) if not left_out],
        [line for line, left_out in zip(lines, empty, strict=True) if left_out],
    )


def with_catch(lines: Sequence[Line], catch: Sequence[Choice]) -> list[Line]:
    """Return the lines with those marked as catch trials that were said to be."""
    if not catch or not lines:
        return list(lines)
    for name, value in catch:
        if not any(is_same(_cell(line, name, value, lines, "--catch"), value) for line in lines):
            raise _never(name, value, lines, "--catch")
    by_type = any(name in ("trial_type", lines[0].cells.get("trial_type")) for name, _ in catch)

    def marked(line: Line) -> Line:
        if any(is_same(line.named(name) or "", value) for name, value in catch):
            return replace(line, cells={**line.cells, "trial_type": "catch"})
        word = line.cells["trial_type"]
        other = by_type and TRIAL_TYPES.get(word.lower(), "catch") == "catch"
        return replace(line, cells={**line.cells, "trial_type": "stimulus"}) if other else line

    return [marked(line) for line in lines]


def with_sessions(lines: Sequence[Line]) -> list[Line]:
    """Return the lines with sessions: where none is said, a participant's files are one each."""
    if not any(is_missing(line.cells["session"]) for line in lines):
        return list(lines)
    labels = one_label(line.cells["participant"] for line in lines)
    files: dict[str, list[int]] = defaultdict(list)
    for line in lines:
        its_files = files[labels[line.cells["participant"]]]
        if is_missing(line.cells["session"]) and line.file not in its_files:
            its_files.append(line.file)

    def said(line: Line) -> Line:
        if not is_missing(line.cells["session"]):
            return line
        session = files[labels[line.cells["participant"]]].index(line.file) + 1
        return replace(line, cells={**line.cells, "session": str(session)})

    return [said(line) for line in lines]


def expanded(lines: Sequence[Line], where: str) -> list[Line]:
    """Return a line for every trial, also where the table counts them."""
    if not lines or "n" not in lines[0].cells:
        return list(lines)
    trials: list[Line] = []
    for line in lines:
        felt, n = counts(line)
        if len(trials) + n > _MOST_TRIALS:
            raise UsageError(f"the table counts over {_MOST_TRIALS:,} trials", where=where)
        for answer, times in (("1", felt), ("0", n - felt)):
            trials += [replace(line, cells={**line.cells, "response": answer})] * times
    return trials


def _cell(line: Line, name: str, value: str, lines: Sequence[Line], option: str) -> str:
    found = line.named(name)
    if found is None:
        names = [*lines[0].others]
        like = next(
            (each for each in names if any(is_same(other.others.get(each, ""), value) for other in lines)),
            None,
        )
        advice = (
            f"name one of them, perhaps {choice_option(option, like, value)}" if like else "name one of them"
        )
        raise UsageError(
            f"{option} names {name}, which is no column; the columns are {', '.join(names)}",
            where=line.where,
            do=advice,
        )
    return found


def _never(name: str, value: str, lines: Sequence[Line], option: str) -> UsageError:
    found = list(dict.fromkeys(line.named(name) or "n/a" for line in lines))
    return UsageError(
        f"{name} is nowhere {value}; it is {few(found)}",
        where=option,
        do=f"say one of these, perhaps {choice_option(option, name, found[-1])}",
    )
