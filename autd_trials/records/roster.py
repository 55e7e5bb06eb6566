"""Who has which place, and which numbers are free: all from the logs.

Only a session that came to its first trial counts for places and orders: one that ended before (refused, or
its first question answered with no) must not turn round the next one's order. A session that is running
counts too. Simulated sessions and those with people have rosters of their own.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from autd_trials.errors import UsageError
from autd_trials.records.layout import log_paths
from autd_trials.records.log import has_begun, is_being_written, read_log, read_start
from autd_trials.session.events import SessionStart
from autd_trials.session.standing import standing

_TRIAL = re.compile(rb'"event"\s*:\s*"trial-start"')


@dataclass(frozen=True)
class _Counting:
    """A session that counts for places and orders."""

    path: Path
    start: SessionStart


def place_of(study: Path, participant: str, *, simulated: bool) -> int:
    """Return a participant's place in the roster, from 1: the one they have, else the next that is free.

    Raises
    ------
    UsageError
        A log cannot be read; its participant's place might be given a second time.
    """
    counting = _counting(study, simulated=simulated)
    places = {each.start.participant: each.start.plan.place for each in counting}
    return places.get(participant, max(places.values(), default=0) + 1)


def check_place(study: Path, participant: str, place: int, *, simulated: bool) -> int:
    """Return a place that was asked for: their own, a free one, or that of somebody who dropped out.

    Raises
    ------
    UsageError
        The participant has another place, or the place is taken: its participant has a complete session, or
        one that is running.
    """
    if place < 1:
        raise UsageError(f"place {place} is none", do="places count from 1")
    for each in _counting(study, simulated=simulated):
        start = each.start
        if start.participant == participant and start.plan.place != place:
            raise UsageError(
                f"participant {participant} has place {start.plan.place}, not {place}",
                where=str(each.path),
                do="leave --place out: places are kept over all sessions",
            )
        if start.participant != participant and start.plan.place == place and _stays(each.path):
            raise UsageError(
                f"place {place} is that of participant {start.participant}, who has a complete session or a "
                "running one",
                where=str(each.path),
                do="give the place of somebody who dropped out, or leave --place out for the next free one",
            )
    return place


def holder_of(study: Path, place: int, *, simulated: bool) -> str | None:
    """Return the participant who has a place; None if it is free."""
    holders = [
        each.start.participant
        for each in _counting(study, simulated=simulated)
        if each.start.plan.place == place
    ]
    return holders[-1] if holders else None


def number_of(study: Path, participant: str, session: str, *, simulated: bool) -> int:
    """Return a session's number in its participant's order: the one in its id, less those that do not count.

    An id that is no number comes behind all sessions that count.
    """
    paths = _paths_of(study, participant)
    counting = [path for path in paths if _counts(path)]
    if not session.isdecimal():
        starts = [read_start(path) for path in counting]
        return sum(start.simulated == simulated for start in starts) + 1
    void = [path for path in paths if path not in counting and _label(path).isdecimal()]
    return max(1, int(session) - sum(int(_label(path)) < int(session) for path in void))


def next_participant(study: Path) -> str:
    """Return the first free participant number of a study, as in ``01``; numbers are not used twice."""
    return _next_number(path.parent.parent.name for path in log_paths(study))


def next_session(study: Path, participant: str) -> str:
    """Return the first free session number of a participant, as in ``01``; numbers are not used twice."""
    return _next_number(path.parent.name for path in _paths_of(study, participant))


def known_participant(study: Path, participant: str) -> str | None:
    """Return what is recorded under an id, to ask whether it is the same person; None if nothing is.

    Raises
    ------
    UsageError
        A log cannot be read.
    """
    sessions = [read_log(path) for path in _paths_of(study, participant) if has_begun(path)]
    if not sessions:
        return None
    lines = [f"participant {participant} has {len(sessions)} session(s) in this study already:"]
    for log in sessions:
        where = standing(log.events)
        by = "simulated, " if log.start.simulated else ""
        begun = log.start.utc[:16].replace("T", " ")
        lines.append(
            f"  session {log.start.session}, begun {begun}: {by}{where.status}, "
            f"{len(where.complete)} of {len(log.start.plan.trials)} trials"
        )
    return "\n".join(lines)


def _counting(study: Path, *, simulated: bool) -> list[_Counting]:
    found = [_Counting(path, read_start(path)) for path in log_paths(study) if has_begun(path)]
    return [each for each in found if each.start.simulated == simulated and _counts(each.path)]


def _counts(path: Path) -> bool:
    return bool(_TRIAL.search(path.read_bytes())) or (has_begun(path) and is_being_written(path))


def _stays(path: Path) -> bool:
    """Return whether a session's place cannot be given to another."""
    return is_being_written(path) or standing(read_log(path).events).status == "success"


def _paths_of(study: Path, participant: str) -> list[Path]:
    return [path for path in log_paths(study) if path.parent.parent.name == f"sub-{participant}"]


def _label(path: Path) -> str:
    return path.parent.name.removeprefix("ses-")


def _next_number(folders: Iterable[str]) -> str:
    labels = [folder.partition("-")[2] for folder in folders]
    return f"{max((int(label) for label in labels if label.isdecimal()), default=0) + 1:02d}"
