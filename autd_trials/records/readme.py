"""The README of a data set: what it is, in plain words, so that nobody takes it for something else."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from autd_trials.neutral import markdown
from autd_trials.protocol.schema import Protocol
from autd_trials.records.dataset import by_time, simulated
from autd_trials.records.problem import Problem, in_short, unexplained
from autd_trials.records.protocol_hash import protocol_sha256
from autd_trials.records.sessions import StudySession
from autd_trials.records.sessions_table import SESSION_COLUMNS, emulated
from autd_trials.records.trials_table import trial_columns
from autd_trials.session.events import Fault, Resume
from autd_trials.tables import Column

_FIRST_LINE = {
    "yes": "**Simulated data: no person took part; a program gave the answers.**",
    "partly": "**Partly simulated data: in some sessions a program gave the answers.**",
    "no": "Recorded with people.",
}

_FILES = """\
- `sub-*/ses-*/beh/*_events.tsv`: a row for every attempt at a trial. Only `complete` ones count.
- `sub-*/ses-*/beh/*_acq-log_beh.tsv`: notes, pauses and faults in full.
- `sub-*/sub-*_sessions.tsv`: how each session went; `participants.tsv`: who took part, under pseudonyms.
- `sourcedata/`: the raw logs, one JSON object a line, with the whole protocol, plan, rig and calibration in
  the first line. They are the record: all else here is made from them by `autd-trials export`, and can be
  made again. `chains.tsv` says where each log's chain stood when the data set was made last; `made/` is what
  was made last, so that what people add to a file is told from it and kept; `edited/` is what they edited and
  what could not be kept in its place.
- `derivatives/analysis/`: results, if the study was analysed."""


def readme_text(
    sessions: Sequence[StudySession], never_begun: Sequence[Path], problems: Sequence[Problem] = ()
) -> str:
    """Return ``README.md``.

    Parameters
    ----------
    sessions
        The study's sessions, at least one.
    never_begun
        Logs of sessions that were cut short before their first event was on the disk.
    problems
        What is wrong with the study's records.
    """
    ordered = by_time(sessions)
    newest = ordered[-1].log.start.protocol
    parts = [
        _first_line(ordered),
        *_warning(problems),
        f"# {newest.study.title}",
        newest.description.strip(),
        _section("Protocol", _protocol_lines(newest, ordered)),
        _section("Array", _by_value(ordered, _array)),
        _section("Calibration of the array", _by_value(ordered, _calibration)),
        _section("Masking noise", _by_value(ordered, _masker)),
        _section("Response device", _by_value(ordered, _responder)),
        _section("Integrity of the records", _integrity(problems)),
        _section("Irregularities", _irregularities(ordered, never_begun)),
        _section("Files", _FILES),
        _section("Columns of the trial tables", _column_lines(trial_columns(_protocols(ordered)))),
        _section("Columns of the session tables", _column_lines(SESSION_COLUMNS)),
        _section("Versions", _by_value(ordered, _versions)),
        _section(
            "Approval and licence",
            f"Ethics: {newest.study.ethics_approval}\n\nLicence: {newest.study.license}",
        ),
    ]
    return markdown("\n\n".join(parts) + "\n")


def _first_line(sessions: Sequence[StudySession]) -> str:
    silent = [session for session in sessions if emulated(session)]
    if not silent:
        return _FIRST_LINE[simulated(sessions)]
    where = "The" if len(silent) == len(sessions) else "In some sessions the"
    return f"{_FIRST_LINE[simulated(sessions)]} **{where} array was emulated: nothing was emitted.**"


def _warning(problems: Iterable[Problem]) -> list[str]:
    count = len(unexplained(problems))
    if not count:
        return []
    return [
        f"**WARNING: the records are not as they were written ({count} finding(s), see Integrity of the "
        "records below). Do not trust these data before that is explained.**"
    ]


def _integrity(problems: Sequence[Problem]) -> str:
    """Return what the check of the logs found; plain words also if it found nothing."""
    lines = [f"- {line}" for line in in_short(problems)]
    lines += [f"- {problem} (explained by the log itself)" for problem in problems if problem.explained]
    checked = (
        "Checked when this data set was made: the numbers and the chain of SHA-256 through each log, each "
        "log for being consistent in itself, and all of them with each other (`autd-trials study verify`)."
    )
    return f"{checked}\n\n" + ("\n".join(lines) or "Nothing was found.")


def _section(title: str, text: str) -> str:
    return f"## {title}\n\n{text}"


def _protocols(sessions: Iterable[StudySession]) -> list[Protocol]:
    return [session.log.start.protocol for session in sessions]


def _protocol_lines(newest: Protocol, sessions: Sequence[StudySession]) -> str:
    hashes = {protocol_sha256(session.log.start.protocol.model_dump(mode="json")) for session in sessions}
    changed = (
        f"\n\nThe protocol was changed during the study: its sessions used {len(hashes)} versions. What is "
        "said here and in the sidecars is from the newest; each log has its own."
        if len(hashes) > 1
        else ""
    )
    versions = _by_value(sessions, lambda session: f"SHA-256 {session.log.start.protocol_sha256}")
    return f"Name: {newest.name}. Question: {newest.response.question}{changed}\n\n{versions}"


def _array(session: StudySession) -> str:
    array = _device(session, "array")
    what = {
        True: "Emulated: no real array was used and nothing was emitted",
        False: "A real array",
        None: "The log does not say whether the array was real",
    }[emulated(session)]
    return f"{what}. {_facts(array)}"


def _calibration(session: StudySession) -> str:
    start = session.log.start
    warning = "Made up: nobody measured where the units stood. " if start.calibration.get("made_up") else ""
    method = start.calibration.get("method", "not logged")
    time = start.calibration.get("time", "not logged")
    return f"{warning}Method: {method}. Time: {time}. SHA-256 {start.calibration_sha256}."


def _masker(session: StudySession) -> str:
    masker = _device(session, "masker")
    if masker:
        return _facts(masker)
    asked = session.log.start.protocol.masking is not None
    return "None, although the protocol asks for it." if asked else "None."


def _responder(session: StudySession) -> str:
    return _facts(_device(session, "responder"))


def _versions(session: StudySession) -> str:
    commit = session.log.start.git_commit
    return _facts(session.log.start.versions | {"git commit": commit or "unknown"})


def _irregularities(sessions: Iterable[StudySession], never_begun: Iterable[Path]) -> str:
    lines = [
        f"- sub-{session.paths.participant} ses-{session.paths.session}: {'; '.join(found)}"
        for session in sessions
        if (found := _irregular(session))
    ]
    lines += [f"- {path.name}: the session was cut short before it began" for path in never_begun]
    return "\n".join(lines) or "None was logged."


def _irregular(session: StudySession) -> list[str]:
    standing = session.standing
    found = []
    if standing.status != "success":
        planned = len(session.log.start.plan.trials)
        found.append(
            f"{standing.status} ({standing.why}), {len(standing.complete)} of {planned} trials complete"
        )
    events = session.log.events
    crashes = sum(isinstance(event, Resume) and event.after_crash for event in events)
    faults = [event.what for event in events if isinstance(event, Fault)]
    if crashes:
        found.append(f"taken up again after {crashes} crash(es)")
    if faults:
        found.append(f"{len(faults)} fault(s): {', '.join(dict.fromkeys(faults))}")
    if standing.attempts_interrupted:
        found.append(f"{standing.attempts_interrupted} interrupted attempts")
    if session.log.damaged:
        found.append(
            f"unreadable lines in the log: {', '.join(str(line) for line, _ in session.log.damaged)}"
        )
    return [" ".join(text.split()) for text in found]


def _column_lines(columns: Iterable[Column[Any]]) -> str:
    return "\n".join(
        f"- `{column.name}`{f' ({column.units})' if column.units else ''}: {column.description}"
        for column in columns
    )


def _by_value(sessions: Iterable[StudySession], describe: Callable[[StudySession], str]) -> str:
    """Return what holds of the sessions; where they differ, which sessions each text is about."""
    groups: dict[str, list[str]] = {}
    for session in sessions:
        groups.setdefault(describe(session), []).append(
            f"sub-{session.paths.participant} ses-{session.paths.session}"
        )
    if len(groups) == 1:
        return next(iter(groups))
    return "\n".join(f"- {text} ({', '.join(names)})" for text, names in groups.items())


def _device(session: StudySession, name: str) -> dict[str, Any]:
    device = getattr(session.log.start.devices, name)
    return device.model_dump() if device is not None else {}


def _facts(facts: dict[str, Any]) -> str:
    return (
        "; ".join(f"{name.replace('_', ' ')}: {_fact(value)}" for name, value in facts.items())
        or "Not logged."
    )


def _fact(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(dict.fromkeys(map(str, value)))
    return "not known" if value is None else str(value)
