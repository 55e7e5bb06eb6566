"""The table of a participant's sessions (``_sessions.tsv``): one row a session."""

from collections.abc import Callable
from datetime import UTC, datetime

from autd_trials.records.columns import simulated_column, to_us
from autd_trials.records.sessions import StudySession
from autd_trials.session.events import Event, Fault, Note, Pause, Resume
from autd_trials.tables import Column


def emulated(session: StudySession) -> bool:
    """Return whether the array's firmware was emulated."""
    return session.log.start.devices.array.emulated


def bids_time(utc: str) -> str | None:
    """Return a logged time as BIDS writes it (``2026-11-22T09:00:00.000000Z``); None if it is not a time."""
    try:
        time = datetime.fromisoformat(utc)
    except ValueError:
        return None
    if time.tzinfo is None:
        time = time.replace(tzinfo=UTC)
    return time.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _count(kind: type[Event]) -> Callable[[StudySession], int]:
    return lambda session: sum(isinstance(event, kind) for event in session.log.events)


SESSION_COLUMNS: tuple[Column[StudySession], ...] = (
    Column("session_id", "The session.", lambda session: f"ses-{session.paths.session}"),
    Column("acq_time", "When the session began, in UTC.", lambda session: bids_time(session.log.start.utc)),
    Column(
        "status",
        "How the session ended.",
        lambda session: session.standing.status,
        levels={
            "success": "All trials are complete.",
            "aborted": "A person ended it.",
            "failed": "A device failed, or a limit was reached.",
            "interrupted": "The log stops without an end: a crash, or the session was still running.",
        },
    ),
    simulated_column(lambda session: session.log.start.simulated),
    Column(
        "virtual_time",
        "Whether the session ran in virtual time.",
        lambda session: session.log.start.virtual_time,
        levels={"yes": "The clock jumped over the waits.", "no": "The session ran in real time."},
    ),
    Column(
        "emulated_array",
        "Whether the array's firmware was emulated.",
        emulated,
        levels={"yes": "No sound was emitted.", "no": "A real array emitted."},
    ),
    Column(
        "trials_planned", "Trials in the session's plan.", lambda session: len(session.log.start.plan.trials)
    ),
    Column("trials_complete", "Trials that are complete.", lambda session: len(session.standing.complete)),
    Column(
        "attempts_interrupted",
        "Attempts at a trial that do not count.",
        lambda session: session.standing.attempts_interrupted,
    ),
    Column(
        "exposure_s",
        "Sum of the commanded exposures: drive squared times duration.",
        lambda session: to_us(session.standing.exposure_s),
        units="s",
    ),
    Column("pauses", "Pauses, breaks between blocks included.", _count(Pause)),
    Column(
        "crashes",
        "How often the session was taken up again after a crash.",
        lambda session: sum(isinstance(event, Resume) and event.after_crash for event in session.log.events),
    ),
    Column("faults", "Faults that were logged.", _count(Fault)),
    Column("notes", "Notes that were logged.", _count(Note)),
    Column(
        "damaged_lines",
        "Lines of the raw log that cannot be read.",
        lambda session: len(session.log.damaged),
    ),
    Column("seed", "Seed of the plan.", lambda session: session.log.start.plan.seed),
    Column(
        "protocol_sha256",
        "SHA-256 of the resolved protocol.",
        lambda session: session.log.start.protocol_sha256,
    ),
    Column(
        "calibration_sha256",
        "SHA-256 of the array's calibration.",
        lambda session: session.log.start.calibration_sha256,
    ),
)
