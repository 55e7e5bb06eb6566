"""The BIDS data set of a study, made from its logs alone; what people added to its files is kept."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import FileHeldError, HeldFile, NoLocksError
from autd_trials.records.dataset import (
    PARTICIPANT_COLUMNS,
    changes_text,
    dataset_description,
    log_description,
    task_description,
)
from autd_trials.records.disk import json_text, replace_text
from autd_trials.records.kept import MADE, lay_aside, write_kept
from autd_trials.records.layout import source_folder
from autd_trials.records.log_table import LOG_COLUMNS, log_rows
from autd_trials.records.problem import Problem
from autd_trials.records.readme import readme_text
from autd_trials.records.register import REGISTER, Entry, read_register, register_text
from autd_trials.records.sessions import StudySession, never_begun, study_sessions
from autd_trials.records.sessions_table import SESSION_COLUMNS
from autd_trials.records.trials_table import trial_columns, trial_rows
from autd_trials.records.verify import contains, verify_study
from autd_trials.tables import describe, tsv

_PATIENCE_S = 60.0
"""For another export of the same study to end."""


@dataclass(frozen=True)
class Export:
    """What an export did.

    Parameters
    ----------
    files
        The files of the data set, sorted.
    problems
        What is wrong with the study's records.
    told
        Files that people had edited and that could not be kept as they were, a sentence each.
    """

    files: list[Path]
    problems: list[Problem]
    told: list[str]


def export_study(study: Path) -> Export:
    """Make the tables and descriptions of a study from its logs; the logs themselves are only read.

    Parameters
    ----------
    study
        The study's folder.

    Returns
    -------
    Export
        The files, and what a person should know.

    Raises
    ------
    UsageError
        There is no log, one cannot be read, or there is a table whose log is gone.
    DeviceError
        The disk refuses.
    """
    sessions = study_sessions(study)
    if not sessions:
        raise UsageError("there is no recorded session", where=str(study), do="give the folder of a study")
    _require_one_task(sessions)
    with _one_export(study), _disk(study):
        problems = verify_study(study)
        tables = _trial_tables(sessions)
        texts = _study_texts(study, sessions, problems) | _session_texts(study, sessions)
        _refuse_orphans(study, set(tables))
        told = [lay_aside(study, problem.file) for problem in problems if problem.file in tables]
        for path, text in sorted(tables.items()):
            replace_text(path, text)
        for path, text in sorted(texts.items()):
            if (kept := write_kept(study, path, text)) is not None:
                told.append(kept)
        _register(study, sessions, tables)
    return Export(sorted([*texts, *tables]), problems, told)


@contextmanager
def _one_export(study: Path) -> Iterator[None]:
    """Let one export of a study run at a time; on a file system without locks, several."""
    lock = source_folder(study) / MADE / ".lock"
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        held = HeldFile(lock, patience_s=_PATIENCE_S)
    except NoLocksError:
        yield
        return
    except FileHeldError as error:
        raise UsageError(
            f"process {error.pid} is making this data set", where=str(study), do="try again when it has ended"
        ) from error
    except OSError as error:
        raise _disk_error(lock, error) from error
    try:
        yield
    finally:
        held.release()


@contextmanager
def _disk(study: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise _disk_error(Path(error.filename or study), error) from error


def _disk_error(path: Path, error: OSError) -> DeviceError:
    return DeviceError(
        f"disk: cannot write: {error.strerror}",
        where=str(path),
        do="the logs are safe: mend the disk, then run autd-trials export",
    )


def _study_texts(study: Path, sessions: list[StudySession], problems: list[Problem]) -> dict[Path, str]:
    task = sessions[0].paths.task
    texts = {
        study / "dataset_description.json": json_text(dataset_description(sessions)),
        study / "README.md": readme_text(sessions, never_begun(study), problems),
        study / "CHANGES": changes_text(sessions),
        study / "participants.tsv": tsv(PARTICIPANT_COLUMNS, _by_participant(sessions)),
        study / "participants.json": json_text(describe(PARTICIPANT_COLUMNS)),
    }
    if any(trial_rows(session.log) for session in sessions):
        texts[study / f"task-{task}_events.json"] = json_text(task_description(sessions))
    if any(log_rows(session.log) for session in sessions):
        texts[study / f"task-{task}_acq-log_beh.json"] = json_text(log_description(sessions))
    return texts


def _trial_tables(sessions: list[StudySession]) -> dict[Path, str]:
    """Return the tables of trials; a session without a trial has none."""
    columns = trial_columns(session.log.start.protocol for session in sessions)
    rows = {session.paths.events: trial_rows(session.log) for session in sessions}
    return {path: tsv(columns, there) for path, there in rows.items() if there}


def _session_texts(study: Path, sessions: list[StudySession]) -> dict[Path, str]:
    texts: dict[Path, str] = {}
    for group in _by_participant(sessions):
        name = f"sub-{group[0].paths.participant}"
        texts[study / name / f"{name}_sessions.tsv"] = tsv(SESSION_COLUMNS, group)
        texts[study / name / f"{name}_sessions.json"] = json_text(describe(SESSION_COLUMNS))
        for session in group:
            if rows := log_rows(session.log):
                texts[session.paths.log_table] = tsv(LOG_COLUMNS, rows)
    return texts


def _register(study: Path, sessions: list[StudySession], tables: dict[Path, str]) -> None:
    """Note where the chain of each log stands, of those that still hold what was noted before."""
    known = read_register(study)
    renewed = {}
    for session in sessions:
        name = session.log.path.relative_to(source_folder(study)).as_posix()
        before = known.entries.get(name)
        if before is None or contains(session.log.path, before.head):
            table = tables.get(session.paths.events)
            renewed[name] = Entry(
                session.log.head,
                session.log.start.simulated,
                None if table is None else hashlib.sha256(table.encode("utf-8")).hexdigest(),
            )
    replace_text(source_folder(study) / REGISTER, register_text(known, renewed))


def _by_participant(sessions: list[StudySession]) -> list[list[StudySession]]:
    return [list(group) for _, group in groupby(sessions, key=lambda session: session.paths.participant)]


def _require_one_task(sessions: list[StudySession]) -> None:
    for session in sessions[1:]:
        if session.paths.task != sessions[0].paths.task:
            raise UsageError(
                f"the log is of another protocol than {sessions[0].log.path.name}",
                where=str(session.log.path),
                do="keep every protocol's logs in a study folder of its own",
            )


def _refuse_orphans(study: Path, made: set[Path]) -> None:
    # A table whose log is gone may be the only copy of what it says, so it is not deleted either.
    for table in sorted(study.glob("sub-*/ses-*/beh/*_events.tsv")):
        if table not in made:
            raise UsageError(
                "the raw log of this table is not in sourcedata",
                where=str(table),
                do="put the log back, or move the table out of the study if its session is withdrawn",
            )
