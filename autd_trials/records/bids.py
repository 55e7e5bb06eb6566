"""The BIDS data set of a study, made from its logs alone: byte for byte the same every time."""

from itertools import groupby
from pathlib import Path

from autd_trials.errors import DeviceError, UsageError
from autd_trials.records.dataset import (
    PARTICIPANT_COLUMNS,
    changes_text,
    dataset_description,
    task_description,
)
from autd_trials.records.disk import json_text, replace_text
from autd_trials.records.readme import readme_text
from autd_trials.records.sessions import StudySession, never_begun, study_sessions
from autd_trials.records.sessions_table import SESSION_COLUMNS
from autd_trials.records.trials_table import trial_columns, trial_rows
from autd_trials.tables import describe, tsv


def export_study(study: Path) -> list[Path]:
    """Make the tables and descriptions of a study from its logs; the logs themselves are only read.

    Parameters
    ----------
    study
        The study's folder.

    Returns
    -------
    list of Path
        The files that were written, sorted.

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
    texts = _study_texts(study, sessions) | _session_texts(study, sessions)
    _refuse_orphans(study, set(texts))
    for path, text in sorted(texts.items()):
        try:
            replace_text(path, text)
        except OSError as error:
            raise DeviceError(
                f"disk: cannot write: {error.strerror}",
                where=str(path),
                do="the logs are safe: mend the disk, then run autd-trials export",
            ) from error
    return sorted(texts)


def _study_texts(study: Path, sessions: list[StudySession]) -> dict[Path, str]:
    return {
        study / "dataset_description.json": json_text(dataset_description(sessions)),
        study / "README.md": readme_text(sessions, never_begun(study)),
        study / "CHANGES": changes_text(sessions),
        study / "participants.tsv": tsv(PARTICIPANT_COLUMNS, _by_participant(sessions)),
        study / "participants.json": json_text(describe(PARTICIPANT_COLUMNS)),
    }


def _session_texts(study: Path, sessions: list[StudySession]) -> dict[Path, str]:
    task_sidecar = study / f"task-{sessions[0].paths.task}_events.json"
    columns = trial_columns(session.log.start.protocol for session in sessions)
    texts: dict[Path, str] = {}
    for group in _by_participant(sessions):
        name = f"sub-{group[0].paths.participant}"
        texts[study / name / f"{name}_sessions.tsv"] = tsv(SESSION_COLUMNS, group)
        texts[study / name / f"{name}_sessions.json"] = json_text(describe(SESSION_COLUMNS))
        for session in group:
            if rows := trial_rows(session.log):
                texts[session.paths.events] = tsv(columns, rows)
                texts[task_sidecar] = json_text(task_description(sessions))
    return texts


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
