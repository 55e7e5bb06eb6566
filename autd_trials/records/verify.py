"""Whether the records of a study are as they were written: chain and sense of each log, and of all."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from autd_trials.errors import UsageError
from autd_trials.records.chain import Head, Line, split_lines
from autd_trials.records.consistency import inconsistencies
from autd_trials.records.layout import SessionPaths, events_table, log_paths, source_folder
from autd_trials.records.log import LogContents, read_lines
from autd_trials.records.problem import Problem
from autd_trials.records.register import REGISTER, read_register
from autd_trials.records.study_check import across_sessions
from autd_trials.session.events import Resume, TrialEnd


def verify_log(path: Path) -> list[Problem]:
    """Return what is wrong with a log, in the order of its lines.

    Parameters
    ----------
    path
        The log.

    Returns
    -------
    list of Problem
        Empty if the log is whole and could have been written like this.
    """
    return _verify(path)[1]


def verify_study(study: Path) -> list[Problem]:
    """Return what is wrong with the logs of a study: each by itself, and all together.

    Parameters
    ----------
    study
        The study's folder.

    Returns
    -------
    list of Problem
        First those of each log, then those of the study.

    Raises
    ------
    UsageError
        There is no log.
    """
    paths = log_paths(study)
    register = read_register(study)
    if not paths and not register.entries:
        raise UsageError("there is no recorded session", where=str(study), do="give the folder of a study")
    logs: list[LogContents] = []
    problems = list(register.problems)
    for path in paths:
        contents, found = _verify(path)
        problems += found
        if contents is not None:
            problems += _placement(study, contents)
            logs.append(contents)
    problems += _registered(study, paths)
    problems += across_sessions(logs)
    problems += _changed_tables(study, logs)
    return problems


def _verify(path: Path) -> tuple[LogContents | None, list[Problem]]:
    try:
        raw = split_lines(path.read_bytes())
    except OSError as error:
        return None, [Problem(path, None, f"cannot be read: {error.strerror}")]
    if len(raw) == 0 or (len(raw) == 1 and not _is_whole(path)):
        return None, [
            Problem(path, 1, "the session never began: its first line is not whole", explained=True)
        ]
    try:
        contents = read_lines(path, raw)
    except UsageError as error:
        return None, [Problem(path, 1, error.what)]
    lines = [Line.parse(line) for line in raw]
    problems = [
        *_chain(path, lines, contents),
        *inconsistencies(contents, _protocol(lines[0])),
    ]
    return contents, sorted(problems, key=lambda problem: problem.line or 0)


def _is_whole(path: Path) -> bool:
    return path.read_bytes().endswith(b"\n")


def _chain(path: Path, lines: list[Line], contents: LogContents) -> Iterator[Problem]:
    """Yield where the chain breaks, and the lines that are outside of it."""
    damaged = dict(contents.damaged)
    old = contents.start.format == 1
    if old:
        chained = next((number for number, line in enumerate(lines, start=1) if line.chain), None)
        until = f" up to line {chained - 1}" if chained else ""
        yield Problem(path, None, f"not chained (version 1){until}", explained=True)
    head, any_sealed = Head(), False
    for number, line in enumerate(lines, start=1):
        if line.chain is None:
            if number in damaged:
                yield _damaged(contents, number, lines, head)
            elif not old or any_sealed:
                yield Problem(path, number, "not in the chain: this line was put in or changed")
        elif (line.number, line.chain) != (number, head.expected(line.text)):
            yield Problem(
                path,
                number,
                "the chain breaks: this line or one before it was changed, moved, put in or removed",
            )
        elif number in damaged:
            yield Problem(path, number, "no event of this session, or another version wrote it")
        any_sealed = any_sealed or line.chain is not None
        head = head.after(line)


def _damaged(contents: LogContents, number: int, lines: list[Line], head: Head) -> Problem:
    """Return what is to be said of a line that cannot be read and has no chain of its own."""
    path = contents.path
    if number == len(lines):
        return Problem(path, number, "the last line is torn: a crash, or the end was cut off", explained=True)
    following, after = lines[number], head.after(lines[number - 1])
    if following.chain is None:
        as_it_was = _taken_up_behind(contents, number)
    else:
        as_it_was = following.chain == after.expected(following.text)
    if as_it_was:
        what = "torn, as it was when the session was taken up again behind it"
        return Problem(path, number, what, explained=True)
    return Problem(path, number, "cannot be read: this line was damaged or put in")


def _taken_up_behind(contents: LogContents, number: int) -> bool:
    """Return whether a log without a chain goes on behind a line as one that was taken up again does."""
    behind = (
        event
        for line, event in zip(contents.lines, contents.events, strict=True)
        if line > number and not isinstance(event, TrialEnd)
    )
    return isinstance(next(behind, None), Resume)


def _protocol(first: Line) -> dict[str, Any] | None:
    try:
        protocol = json.loads(first.event)["protocol"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    return protocol if isinstance(protocol, dict) else None


def _placement(study: Path, log: LogContents) -> Iterator[Problem]:
    start = log.start
    try:
        paths = SessionPaths(study, start.participant, start.session, start.protocol.task)
    except UsageError as error:
        yield Problem(log.path, 1, error.what)
        return
    if paths.log != log.path:
        yield Problem(
            log.path,
            1,
            f"the log of participant {start.participant}, session {start.session} of {start.protocol.name} "
            "lies where another belongs: a copy, or it was moved",
        )


def _registered(study: Path, paths: list[Path]) -> Iterator[Problem]:
    """Yield logs that are gone or shorter than, or otherwise than, they were when the data set was made."""
    known = {path.relative_to(source_folder(study)).as_posix(): path for path in paths}
    for name, entry in read_register(study).entries.items():
        path, head = known.get(name), entry.head
        if path is None:
            yield Problem(
                source_folder(study) / name,
                None,
                f"the log is gone; it had {head.lines} lines. Put it back; if its session was withdrawn, "
                f"take its line out of sourcedata/{REGISTER}",
            )
        elif not contains(path, head):
            yield Problem(
                path,
                None,
                f"cut off or changed: it does not hold what it held, with {head.lines} lines, when the data "
                "set was made last",
            )


def _changed_tables(study: Path, logs: list[LogContents]) -> Iterator[Problem]:
    """Yield tables of trials that somebody edited since they were made."""
    entries = read_register(study).entries
    for log in logs:
        entry = entries.get(log.path.relative_to(source_folder(study)).as_posix())
        table = events_table(study, log.path)
        made = None if entry is None else entry.table_sha256
        if made and table.is_file() and hashlib.sha256(table.read_bytes()).hexdigest() != made:
            what = "was edited since it was made from its log; autd-trials export makes it again"
            yield Problem(table, None, what)


def contains(path: Path, head: Head) -> bool:
    """Return whether a log still holds all that it held when its chain stood at `head`."""
    reached = Head()
    try:
        raw = split_lines(path.read_bytes())
    except OSError:
        return False
    if len(raw) < head.lines:
        return False
    for line in raw[: head.lines]:
        reached = reached.after(Line.parse(line))
    return reached == head
