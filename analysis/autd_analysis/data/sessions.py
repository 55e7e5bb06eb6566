"""What the raw logs of a study say of its sessions: the protocol, the plan, and how each session ended."""

from dataclasses import dataclass
from pathlib import Path

from autd_trials.records.layout import log_paths
from autd_trials.records.log import LogContents, has_begun, read_log
from autd_trials.session.events import SessionStart
from autd_trials.session.standing import Status, standing

LOG_SUFFIX = "_log.jsonl"


@dataclass(frozen=True)
class LoggedSession:
    """One session as its raw log has it.

    Attributes
    ----------
    name
        What log and trial table have in common, as in ``sub-01_ses-01_task-chest_run-1``.
    log
        The raw log.
    start
        Its first line: protocol, plan, and whether the participant was simulated.
    status
        How the session ended: success, aborted or failed; interrupted if its log just stops.
    damaged_lines
        Numbers of the log's lines that cannot be read.
    """

    name: str
    log: Path
    start: SessionStart
    status: Status
    damaged_lines: tuple[int, ...]


def read_sessions(study: Path) -> tuple[tuple[LoggedSession, ...], tuple[Path, ...]]:
    """Read the raw logs of a study.

    Parameters
    ----------
    study
        The study's folder.

    Returns
    -------
    sessions : tuple of LoggedSession
        In the order of the sessions' names; empty if there are no logs.
    never_begun : tuple of Path
        Logs without a whole first line: the run ended before its session began.

    Raises
    ------
    UsageError
        A log cannot be read, or does not begin with a session's start.
    """
    logs = log_paths(study)
    begun = [log for log in logs if has_begun(log)]
    return tuple(_session(read_log(log)) for log in begun), tuple(log for log in logs if log not in begun)


def _session(contents: LogContents) -> LoggedSession:
    return LoggedSession(
        name=contents.path.name.removesuffix(LOG_SUFFIX),
        log=contents.path,
        start=contents.start,
        status=standing(contents.events).status,
        damaged_lines=tuple(number for number, _ in contents.damaged),
    )
