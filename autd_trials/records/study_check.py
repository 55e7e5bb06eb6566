"""Whether the sessions of a study agree with each other: places, copies, sessions at one time."""

import json
from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from datetime import datetime
from itertools import pairwise

from autd_trials.records.ids import look_alike
from autd_trials.records.log import LogContents
from autd_trials.records.problem import Problem
from autd_trials.session.events import ResponseMade, StimulusStart, TrialStart

_SAME_PRESSES = 3
"""So many presses in a row with the same response times, to the microsecond, are no coincidence."""


def across_sessions(logs: Sequence[LogContents]) -> list[Problem]:
    """Return what cannot be, given the other sessions."""
    return [
        *_copies(logs),
        *_places(logs),
        *_numbers(logs),
        *_overlaps(logs),
        *_ids(logs),
        *_hashes(logs),
    ]


def _copies(logs: Iterable[LogContents]) -> Iterator[Problem]:
    """Yield logs whose events, or answers, are those of another."""
    seen: dict[Hashable, LogContents] = {}
    for log in logs:
        answers = tuple(_answers(log))
        traits = [*_moments(log), *([answers] if len(answers) >= _SAME_PRESSES else [])]
        first = next((seen[trait] for trait in traits if trait in seen), None)
        if first is not None:
            yield Problem(log.path, None, f"has what {first.path.name} has: one is a copy of the other")
        for trait in traits:
            seen.setdefault(trait, log)


def _moments(log: LogContents) -> Iterator[Hashable]:
    yield log.start.utc
    for event in log.events:
        if isinstance(event, StimulusStart):
            yield event.utc, event.onset_t_s, event.device_ns


def _answers(log: LogContents) -> Iterator[Hashable]:
    for event in log.events:
        if isinstance(event, ResponseMade) and event.response_time_s is not None:
            yield event.trial, event.response_time_s


def _places(logs: Iterable[LogContents]) -> Iterator[Problem]:
    """Yield a participant with two places, and a place of two participants who both came to an end."""
    places: dict[tuple[str, bool], LogContents] = {}
    holders: dict[tuple[int, bool], LogContents] = {}
    for log in filter(has_trial, logs):
        start = log.start
        first = places.setdefault((start.participant, start.simulated), log)
        if first.start.plan.place != start.plan.place:
            yield Problem(
                log.path,
                1,
                f"participant {start.participant} has place {start.plan.place} here and "
                f"{first.start.plan.place} in {first.path.name}",
            )
        if not is_complete(log):
            continue
        holder = holders.setdefault((start.plan.place, start.simulated), log)
        if holder.start.participant != start.participant and holder.start.plan.session == start.plan.session:
            yield Problem(
                log.path,
                1,
                f"place {start.plan.place} was given to participant {start.participant} and, in "
                f"{holder.path.name}, to {holder.start.participant}",
            )


def _numbers(logs: Iterable[LogContents]) -> Iterator[Problem]:
    """Yield a session whose number another of the same participant has: both had the same plan."""
    seen: dict[tuple[str, bool, int], LogContents] = {}
    for log in filter(has_trial, logs):
        start = log.start
        first = seen.setdefault((start.participant, start.simulated, start.plan.session), log)
        if first is not log:
            yield Problem(
                log.path, 1, f"was planned as session {start.plan.session}, as {first.path.name} was"
            )


def _overlaps(logs: Iterable[LogContents]) -> Iterator[Problem]:
    """Yield sessions of one person that ran at the same time."""
    by_person: dict[str, list[LogContents]] = defaultdict(list)
    for log in logs:
        if not log.start.virtual_time:
            by_person[log.start.participant].append(log)
    for theirs in by_person.values():
        spans = sorted(((*_span(log), log) for log in theirs), key=lambda span: span[:2])
        for (_, end, before), (begin, _, log) in pairwise(spans):
            if begin < end and not _resumed(before):
                yield Problem(
                    log.path,
                    1,
                    f"participant {log.start.participant} was in {before.path.name} at the same time",
                )


def _span(log: LogContents) -> tuple[datetime, datetime]:
    times = [datetime.fromisoformat(event.utc) for event in log.events]
    return times[0], max(times)


def _resumed(log: LogContents) -> bool:
    # Another session may lie between the interruption and the resume.
    return any(event.event == "resume" for event in log.events)


def _ids(logs: Iterable[LogContents]) -> Iterator[Problem]:
    seen: dict[str, LogContents] = {}
    for log in logs:
        first = seen.setdefault(look_alike(log.start.participant), log)
        if first.start.participant != log.start.participant:
            yield Problem(
                log.path,
                1,
                f"participant {log.start.participant} looks like {first.start.participant}: are they one?",
                explained=True,
            )


def _hashes(logs: Iterable[LogContents]) -> Iterator[Problem]:
    """Yield a hash under which two logs have different things."""
    seen: dict[tuple[str, str], tuple[str, LogContents]] = {}
    for log in logs:
        start = log.start
        for kind, sha256, content in (
            ("protocol", start.protocol_sha256, start.protocol.model_dump(mode="json")),
            ("calibration", start.calibration_sha256, start.calibration),
        ):
            text = json.dumps(content, sort_keys=True, default=str)
            known, first = seen.setdefault((kind, sha256), (text, log))
            if known != text:
                yield Problem(log.path, 1, f"its {kind} has the SHA-256 of another one in {first.path.name}")


def has_trial(log: LogContents) -> bool:
    """Return whether a session came to its first trial; only then it counts for places and orders."""
    return any(isinstance(event, TrialStart) for event in log.events)


def is_complete(log: LogContents) -> bool:
    """Return whether all trials of a session are complete."""
    complete = {e.trial for e in log.events if e.event == "trial-end" and e.status == "complete"}
    return complete >= {trial.trial for trial in log.start.plan.trials}
