"""What happened beside the trials (``_acq-log_beh.tsv``): notes, pauses, faults, a row each, in full."""

from dataclasses import dataclass

from autd_trials.records.columns import simulated_column, to_us
from autd_trials.records.log import LogContents
from autd_trials.records.sessions_table import bids_time
from autd_trials.session.events import BlockStart, Event, Fault, Note, Pause, Resume, SessionEnd
from autd_trials.tables import Column, level_text


@dataclass(frozen=True)
class Happening:
    """Something that happened beside the trials."""

    event: Event
    kind: str
    text: str
    simulated: bool


def log_rows(log: LogContents) -> list[Happening]:
    """Return everything in a session that is no trial, in order."""
    found = ((event, _told(event)) for event in log.events)
    return [Happening(event, *told, log.start.simulated) for event, told in found if told is not None]


def _told(event: Event) -> tuple[str, str] | None:
    """Return kind and text of an event that is no trial's."""
    match event:
        case BlockStart():
            levels = ", ".join(f"{name} {level_text(level)}" for name, level in event.conditions.items())
            return "block", f"block {event.block}{': ' if levels else ''}{levels} ({event.confirmed_by})"
        case Pause():
            return "pause", event.reason
        case Resume():
            after = "after a crash" if event.after_crash else "after a pause"
            return "resume", f"{after} ({event.confirmed_by})"
        case Note():
            return "note", event.text
        case Fault():
            return "fault", f"{event.device}: {event.what}"
        case SessionEnd():
            return "end", f"{event.status}: {event.why}"
        case _:
            return None


LOG_COLUMNS: tuple[Column[Happening], ...] = (
    Column(
        "time",
        "When it was logged, from the session's start.",
        lambda row: to_us(row.event.t_s),
        units="s",
    ),
    Column("utc", "When it was logged, in UTC.", lambda row: bids_time(row.event.utc)),
    Column(
        "kind",
        "What happened.",
        lambda row: row.kind,
        levels={
            "block": "A block began; who confirmed its conditions.",
            "pause": "The session paused; why.",
            "resume": "The session went on; who confirmed it, and whether it had crashed.",
            "note": "A note by the experimenter, or by the program about a deviation.",
            "fault": "A device, the disk or a listener failed; which, and what.",
            "end": "The session ended; how, and why.",
        },
    ),
    Column("text", "The note, the reason or the fault in full.", lambda row: row.text),
    simulated_column(lambda row: row.simulated),
)
