"""What was recorded before and matters now: a participant's exposure, sessions that were not finished."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path

from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import FileHeldError, HeldFile, NoLocksError
from autd_trials.records.layout import log_paths, source_folder
from autd_trials.records.log import has_begun, is_being_written, no_locks, read_log
from autd_trials.records.sessions import StudySession, goes_on, read_session
from autd_trials.session.preflight import Used
from autd_trials.session.standing import Charge, standing
from autd_trials.stimulus import DUTY_WINDOW_S

_DAY = timedelta(hours=24)
_TAIL_BYTES = 4096


def used_before(study: Path, participant: str, now: datetime, session: str | None = None) -> Used:
    """Return what a participant was exposed to, from all logs of the study.

    Parameters
    ----------
    study
        The study's folder.
    participant
        The participant's id.
    now
        The wall-clock time now, aware. What was logged later than now counts too: a clock was set back.
    session
        The session that goes on; its exposure is summed apart as well.

    Raises
    ------
    UsageError
        A log of the participant cannot be read: nobody knows what they were exposed to.
    """
    charges: list[Charge] = []
    session_s = 0.0
    for path in log_paths(study):
        if path.parent.parent.name == f"sub-{participant}" and has_begun(path):
            found = standing(read_log(path).events)
            charges += found.charges.values()
            session_s += found.exposure_s if found.start.session == session else 0.0
    bursts = sorted((c.onset, c.end) for c in charges if c.end > now - timedelta(seconds=DUTY_WINDOW_S))
    return Used(
        session_s=session_s,
        today_s=sum(charge.exposure_s for charge in charges if charge.onset > now - _DAY),
        bursts=tuple((onset, end) for onset, end in bursts if end > onset),
    )


def unfinished_sessions(study: Path) -> list[StudySession]:
    """Return the sessions, sorted, that did not come to their last trial and that nobody is running now."""
    paths = [path for path in log_paths(study) if has_begun(path) and not _says_success(path)]
    sessions = [read_session(study, path) for path in paths if not is_being_written(path)]
    return [session for session in sessions if goes_on(session)]


@contextmanager
def participant_lock(study: Path, participant: str) -> Iterator[None]:
    """Keep other runs from a session with the same participant while the context lasts.

    Raises
    ------
    UsageError
        Another run has a session with them, or the file system cannot lock files.
    DeviceError
        The disk refuses.
    """
    path = source_folder(study) / f".sub-{participant}.lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        held = HeldFile(path)
    except NoLocksError as error:
        raise no_locks(path, error) from error
    except FileHeldError as error:
        raise UsageError(
            f"another run (process {error.pid}) has a session with participant {participant}",
            where=str(study),
            do="wait for it to end: one person cannot be in two sessions at once",
        ) from error
    except OSError as error:
        raise DeviceError(
            f"disk: nothing can be written: {error.strerror or error}",
            where=str(path.parent),
            do="mend the disk, or choose another folder with --data",
        ) from error
    try:
        yield
    finally:
        held.release()


def _says_success(path: Path) -> bool:
    """Return whether a log's last line is a good end, without reading the others."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _TAIL_BYTES))
        last = file.read().rstrip(b"\n").rpartition(b"\n")[2]
    return b'"event":"session-end"' in last and b'"status":"success"' in last
