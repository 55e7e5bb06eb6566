"""The sessions of a study: listing and finding them, and a place and a number for the next one."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import FileHeldError, HeldFile, NoLocksError
from autd_trials.records.ids import refuse_look_alikes
from autd_trials.records.layout import SessionPaths, log_paths, source_folder
from autd_trials.records.log import EventLog, LogContents, has_begun, no_locks, read_log
from autd_trials.records.roster import check_place, holder_of, next_session, number_of, place_of
from autd_trials.session.standing import Standing, standing

_PATIENCE_S = 10.0
"""For other runs to record the start of their sessions, which takes each a fraction of a second."""


@dataclass(frozen=True)
class StudySession:
    """A recorded session: where its files lie and what its log says."""

    paths: SessionPaths
    log: LogContents

    @cached_property
    def standing(self) -> Standing:
        """Where the session stands."""
        return standing(self.log.events)


@dataclass(frozen=True)
class NewSession:
    """A session about to begin.

    Parameters
    ----------
    paths
        Where its files will lie.
    place
        The participant's place in the roster, from 1.
    number
        The session's number in the order of its participant's sessions, from 1.
    """

    paths: SessionPaths
    place: int
    number: int


def study_sessions(study: Path) -> list[StudySession]:
    """Return the sessions of a study, sorted by participant and session; those that never began are left out.

    Raises
    ------
    UsageError
        A log cannot be read, or lies where it does not belong.
    """
    sessions = [read_session(study, path) for path in log_paths(study) if has_begun(path)]
    return sorted(sessions, key=lambda session: (session.paths.participant, session.paths.session))


def never_begun(study: Path) -> list[Path]:
    """Return the logs, sorted, of sessions that were cut short before their first event was on the disk."""
    return [path for path in log_paths(study) if not has_begun(path)]


def find_session(study: Path, participant: str | None = None, session: str | None = None) -> StudySession:
    """Return the session to go on with: the one named, else the only interrupted one.

    Raises
    ------
    UsageError
        There is none, or there are several; the message lists what there is.
    """
    named = [
        found
        for found in study_sessions(study)
        if participant in (None, found.paths.participant) and session in (None, found.paths.session)
    ]
    wanted = named if session is not None else [found for found in named if goes_on(found)]
    if len(wanted) == 1:
        return wanted[0]
    listing = "".join(f"\n  {_describe(found)}" for found in wanted or named)
    raise UsageError(
        f"{'several sessions' if wanted else 'no session'} to go on with{':' if listing else ''}{listing}",
        where=str(study),
        do="name one with --participant and --session" if named else "start one without --resume",
    )


def take_up(found: StudySession) -> EventLog:
    """Reopen the log of a session that was found, to go on with it.

    Raises
    ------
    UsageError
        Another run is writing it, or went on with it since it was read; or it had no trial yet and its place
        was given to another participant meanwhile.
    DeviceError
        The disk refuses.
    """
    _refuse_lost_place(found)
    log = EventLog.reopen(found.paths.log)
    if read_log(found.paths.log) == found.log:
        return log
    log.close()
    raise UsageError(
        "another run went on with this session meanwhile",
        where=str(found.paths.log),
        do="look with --resume where it stands now",
    )


@contextmanager
def study_lock(study: Path) -> Iterator[None]:
    """Keep other runs from beginning a session of this study, waiting while another one does.

    To be held from `new_session` until the session's start is in its log, and no longer: only then does the
    log say which place is taken.

    Raises
    ------
    UsageError
        Another run is just beginning one.
    DeviceError
        The disk refuses.
    """
    path = source_folder(study) / ".lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        held = HeldFile(path, patience_s=_PATIENCE_S)
    except NoLocksError as error:
        raise no_locks(path, error) from error
    except OSError as error:
        raise DeviceError(
            f"disk: nothing can be written: {error.strerror}",
            where=str(path.parent),
            do="mend the disk, or choose another folder with --data",
        ) from error
    except FileHeldError as error:
        raise UsageError(
            f"another run (process {error.pid}) is just beginning a session of this study",
            where=str(study),
            do="try again when it has begun",
        ) from error
    try:
        yield
        if not held.intact:
            raise DeviceError(
                "disk: the study's lock was removed or replaced while a session was recorded",
                where=str(path),
                do="find out what did that: another run may have been given the same place",
            )
    finally:
        held.release()


def new_session(
    study: Path,
    task: str,
    participant: str,
    session: str | None = None,
    *,
    place: int | None = None,
    simulated: bool = False,
) -> NewSession:
    """Return where a new session's files go and the participant's place.

    Parameters
    ----------
    study, task
        The study's folder, and its BIDS task label.
    participant, session
        Ids; without one for the session, its participant's next number.
    place
        The place that was asked for: to fill that of somebody who dropped out.
    simulated
        Whether a program will answer.

    Raises
    ------
    UsageError
        An id is not a BIDS label or looks like another, the session has been recorded, or the place is taken.
    """
    paths = SessionPaths(study, participant, session or next_session(study, participant), task)
    refuse_look_alikes(study, participant, paths.session)
    if paths.log.exists():
        raise UsageError(
            f"session {paths.session} of participant {participant} has been recorded already",
            where=str(paths.log),
            do="choose another session id, or go on with this one with --resume",
        )
    return NewSession(
        paths,
        place_of(study, participant, simulated=simulated)
        if place is None
        else check_place(study, participant, place, simulated=simulated),
        number_of(study, participant, paths.session, simulated=simulated),
    )


def read_session(study: Path, path: Path) -> StudySession:
    """Return the session whose log lies at a path; raises as `study_sessions` does."""
    log = read_log(path)
    start = log.start
    paths = SessionPaths(study, start.participant, start.session, start.protocol.task)
    if paths.log != path:
        raise UsageError(
            f"the log of {paths.log.name} lies where it does not belong",
            where=str(path),
            do=f"move it back to {paths.log}",
        )
    return StudySession(paths, log)


def goes_on(found: StudySession) -> bool:
    """Return whether a session waits to be gone on with: not if it was ended before its first trial."""
    where = found.standing
    return where.status == "interrupted" or (where.status != "success" and bool(where.attempts))


def _refuse_lost_place(found: StudySession) -> None:
    start, place = found.log.start, found.log.start.plan.place
    holder = holder_of(found.paths.study, place, simulated=start.simulated)
    if not found.standing.attempts and holder not in (None, start.participant):
        raise UsageError(
            f"the session had no trial yet, and its place {place} was given to participant {holder}",
            where=str(found.paths.log),
            do="begin a new session for this participant, without --resume",
        )


def _describe(found: StudySession) -> str:
    where = found.standing
    done = f"{len(where.complete)} of {len(found.log.start.plan.trials)} trials"
    return f"participant {found.paths.participant}, session {found.paths.session}: {where.status}, {done}"
