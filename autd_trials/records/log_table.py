"""What happened beside the trials (``_acq-log_beh.tsv``): notes, pauses, faults, a row each, in full."""

from autd_trials.records.log import LogContents
from autd_trials.records.sessions_table import bids_time
from autd_trials.records.table import SIMULATED, Column, Value, to_us
from autd_trials.session.events import (
    BlockStart,
    Event,
    Fault,
    Note,
    Pause,
    Resume,
    SessionEnd,
    UnreadableInput,
)

LOG_COLUMNS = (
    Column("time", "When it was logged, from the session's start.", units="s"),
    Column("utc", "When it was logged, in UTC."),
    Column(
        "kind",
        "What happened.",
        levels={
            "block": "A block began; who confirmed its conditions.",
            "pause": "The session paused; why.",
            "resume": "The session went on; who confirmed it, and whether it had crashed.",
            "note": "A note by the experimenter, or by the program about a deviation.",
            "fault": "A device, the disk or a listener failed; which, and what.",
            "input": "Something unreadable came from the response device; what.",
            "end": "The session ended; how, and why.",
        },
    ),
    Column("text", "The note, the reason or the fault in full."),
    SIMULATED,
)


def log_rows(log: LogContents) -> list[dict[str, Value]]:
    """Return a row for everything in a session that is no trial, in order."""
    rows: list[dict[str, Value]] = []
    for event in log.events:
        told = _told(event)
        if told is not None:
            kind, text = told
            rows.append(
                {
                    "time": to_us(event.t_s),
                    "utc": bids_time(event.utc),
                    "kind": kind,
                    "text": text,
                    SIMULATED.name: log.start.simulated,
                }
            )
    return rows


def _told(event: Event) -> tuple[str, str] | None:
    """Return kind and text of an event that is no trial's."""
    match event:
        case BlockStart():
            conditions = ", ".join(f"{name} {level}" for name, level in event.conditions.items())
            return (
                "block",
                f"block {event.block}{f': {conditions}' if conditions else ''} ({event.confirmed_by})",
            )
        case Pause():
            return "pause", event.reason
        case Resume():
            return (
                "resume",
                f"{'after a crash' if event.after_crash else 'after a pause'} ({event.confirmed_by})",
            )
        case Note():
            return "note", event.text
        case Fault():
            return "fault", f"{event.device}: {event.what}"
        case UnreadableInput():
            return "input", event.what
        case SessionEnd():
            return "end", f"{event.status}: {event.why}"
        case _:
            return None
