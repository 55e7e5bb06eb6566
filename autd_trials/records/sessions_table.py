"""The table of a participant's sessions (``_sessions.tsv``): one row a session."""

from datetime import UTC, datetime

from autd_trials.records.sessions import StudySession
from autd_trials.records.table import SIMULATED, Column, Value, to_us
from autd_trials.session.events import Event, Fault, Note, Pause, Resume

SESSION_COLUMNS = (
    Column("session_id", "The session."),
    Column("acq_time", "When the session began, in UTC."),
    Column(
        "status",
        "How the session ended.",
        levels={
            "success": "All trials are complete.",
            "aborted": "A person ended it.",
            "failed": "A device failed, or a limit was reached.",
            "interrupted": "The log stops without an end: a crash, or the session was still running.",
        },
    ),
    SIMULATED,
    Column(
        "virtual_time",
        "Whether the session ran in virtual time.",
        levels={"yes": "The clock jumped over the waits.", "no": "The session ran in real time."},
    ),
    Column(
        "emulated_array",
        "Whether the array's firmware was emulated.",
        levels={"yes": "No sound was emitted.", "no": "A real array emitted."},
    ),
    Column("trials_planned", "Trials in the session's plan."),
    Column("trials_complete", "Trials that are complete."),
    Column("attempts_interrupted", "Attempts at a trial that do not count."),
    Column("exposure_s", "Sum of the commanded exposures: drive squared times duration.", units="s"),
    Column("pauses", "Pauses, breaks between blocks included."),
    Column("crashes", "How often the session was taken up again after a crash."),
    Column("faults", "Faults that were logged."),
    Column("notes", "Notes that were logged."),
    Column("damaged_lines", "Lines of the raw log that cannot be read."),
    Column("seed", "Seed of the plan."),
    Column("protocol_sha256", "SHA-256 of the resolved protocol."),
    Column("calibration_sha256", "SHA-256 of the array's calibration."),
)


def session_row(session: StudySession) -> dict[str, Value]:
    """Return a session's row."""
    log, standing = session.log, session.standing
    start = log.start
    resumes = [event for event in log.events if isinstance(event, Resume)]
    return {
        "session_id": f"ses-{session.paths.session}",
        "acq_time": bids_time(start.utc),
        "status": standing.status,
        "simulated": start.simulated,
        "virtual_time": start.virtual_time,
        "emulated_array": emulated(session),
        "trials_planned": len(start.plan.trials),
        "trials_complete": len(standing.complete),
        "attempts_interrupted": standing.attempts_interrupted,
        "exposure_s": to_us(standing.exposure_s),
        "pauses": _count(log.events, Pause),
        "crashes": sum(resume.after_crash for resume in resumes),
        "faults": _count(log.events, Fault),
        "notes": _count(log.events, Note),
        "damaged_lines": len(log.damaged),
        "seed": str(start.plan.seed),
        "protocol_sha256": start.protocol_sha256,
        "calibration_sha256": start.calibration_sha256,
    }


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


def _count(events: tuple[Event, ...], kind: type[Event]) -> int:
    return sum(isinstance(event, kind) for event in events)
