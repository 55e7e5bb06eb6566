"""What a reader should know about a study's data before believing a number: findings, each a sentence."""

import hashlib
import itertools
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from autd_analysis.data.design import Design, conditions, describe_condition
from autd_analysis.data.sessions import LoggedSession
from autd_analysis.data.trial_table import TABLE_SUFFIX, TrialRow
from autd_trials.protocol.schema import Level
from autd_trials.records.problem import Problem, in_short, unexplained
from autd_trials.records.protocol_hash import protocol_sha256

Rows = Mapping[Path, Sequence[TrialRow]]

_MOST_NAMED = 5


def record_warnings(problems: Sequence[Problem]) -> tuple[str, ...]:
    """Return what is wrong with a study's records, loudly: results from them cannot be trusted."""
    found = in_short(problems)
    if not found:
        return ()
    count = len(unexplained(problems))
    return (
        f"THE RECORDS ARE NOT AS THEY WERE WRITTEN ({count} finding(s)): do not trust these results before "
        "that is explained (autd-trials study verify)",
        *found,
    )


def session_warnings(
    sessions: Sequence[LoggedSession], never_begun: Sequence[Path], tables: Sequence[Path]
) -> tuple[str, ...]:
    """Return what is odd about a study's sessions as such.

    Parameters
    ----------
    sessions
        The sessions that have a raw log.
    never_begun
        Logs of sessions that ended before they began.
    tables
        The trial tables.
    """
    return (
        *_mixed_origins(sessions),
        *_versions(sessions),
        *_unpaired_files(sessions, tables),
        *copies(tables),
        *(f"{log.name}: the session never began (its first line is not whole)" for log in never_begun),
        *_bad_ends(sessions),
    )


def trial_warnings(sessions: Sequence[LoggedSession], rows: Rows, design: Design) -> tuple[str, ...]:
    """Return what is odd about a study's trials.

    Parameters
    ----------
    sessions
        The sessions that have a raw log, for what was planned.
    rows
        The rows of every trial table.
    design
        The study's factors.
    """
    return (
        *_adaptive(design),
        *_uncounted(rows),
        *_unfinished(sessions, rows),
        *_pooled_sessions(rows),
        *_similar_participants(rows),
        *_missing_cells(rows, design),
    )


def copies(tables: Sequence[Path]) -> Iterator[str]:
    """Yield which tables are the same."""
    by_content = defaultdict(list)
    for table in tables:
        by_content[hashlib.sha256(table.read_bytes()).hexdigest()].append(table.name)
    for names in by_content.values():
        if len(names) > 1:
            yield f"these trial tables are the same byte for byte, so one may be a copy: {', '.join(names)}"


def alike_words(words: Iterable[str]) -> tuple[str, ...]:
    """Return words that differ only in case, spaces or leading zeros, those that do in one text."""
    alike: dict[str, set[str]] = defaultdict(set)
    for word in words:
        bare = re.sub(r"[\s_]+", "", unicodedata.normalize("NFKC", word).casefold())
        alike[re.sub(r"(?<![\d.,])0+(?=\d)", "", bare)].add(word)
    return tuple(", ".join(sorted(group)) for _, group in sorted(alike.items()) if len(group) > 1)


def uneven_cells(rows: Sequence[TrialRow]) -> Iterator[str]:
    """Return whether numbers of trials differ, for a table whose plan is not known."""
    counts = Counter(
        (row.participant, tuple(row.levels.items()))
        for row in rows
        if row.used and row.trial_type == "stimulus"
    )
    if len(set(counts.values())) > 1:
        (participant, levels), fewest = min(counts.items(), key=lambda item: item[1])
        cell = describe_condition(tuple((name, level) for name, level in levels if level is not None))
        yield (
            f"numbers of counted stimuli per participant and condition differ: from {fewest} "
            f"(sub-{participant}, {cell}) to {max(counts.values())}"
        )


def _mixed_origins(sessions: Sequence[LoggedSession]) -> Iterator[str]:
    simulated = sum(session.start.simulated for session in sessions)
    if 0 < simulated < len(sessions):
        yield (
            f"{simulated} of {len(sessions)} sessions are simulated and the others are not: "
            "results of a mixture are neither; keep them in different folders"
        )


def _versions(sessions: Sequence[LoggedSession]) -> Iterator[str]:
    versions = len({protocol_sha256(session.start.protocol.model_dump(mode="json")) for session in sessions})
    if versions > 1:
        yield (
            f"the sessions were recorded with {versions} versions of the protocol; their trials are pooled, "
            "comparisons and the order of levels come from the newest"
        )


def _unpaired_files(sessions: Sequence[LoggedSession], tables: Sequence[Path]) -> Iterator[str]:
    in_tables = {table.name.removesuffix(TABLE_SUFFIX) for table in tables}
    in_logs = {session.name for session in sessions}
    for name in sorted(in_logs - in_tables):
        yield f"{name} has a raw log but no trial table, so it is not counted (make it: autd-trials export)"
    for name in sorted(in_tables - in_logs):
        yield f"{name} has a trial table but no raw log: plan and origin (simulated?) are not known"


def _bad_ends(sessions: Sequence[LoggedSession]) -> Iterator[str]:
    for session in sessions:
        if session.status == "interrupted":
            yield f"{session.name} did not come to an end (its log just stops)"
        elif session.status != "success":
            yield f"{session.name} ended as {session.status}"
        if session.damaged_lines:
            lines = ", ".join(map(str, session.damaged_lines))
            yield f"{session.name}: the log is damaged in line(s) {lines}"


def _adaptive(design: Design) -> Iterator[str]:
    if design.method is not None:
        yield (
            f"{design.method.varies} was chosen by an adaptive method, which steers towards the same rate in "
            "all conditions: compare thresholds, not rates"
        )


def _uncounted(rows: Rows) -> Iterator[str]:
    for table, its_rows in rows.items():
        name = table.name.removesuffix(TABLE_SUFFIX)
        interrupted = sum(row.trial_status == "interrupted" for row in its_rows)
        practice = sum(row.trial_type == "practice" for row in its_rows)
        unanswered = sum(row.trial_status == "complete" and row.felt is None for row in its_rows)
        if interrupted:
            yield f"{name}: {interrupted} interrupted attempt(s) at a trial not counted"
        if practice:
            yield f"{name}: {practice} practice trial(s) not counted"
        if unanswered:
            yield f"{name}: {unanswered} complete trial(s) without an answer not counted"


def _unfinished(sessions: Sequence[LoggedSession], rows: Rows) -> Iterator[str]:
    planned = {session.name: {trial.trial for trial in session.start.plan.trials} for session in sessions}
    for table, its_rows in rows.items():
        name = table.name.removesuffix(TABLE_SUFFIX)
        if name not in planned:
            continue
        plan, complete = planned[name], {row.trial for row in its_rows if row.trial_status == "complete"}
        if not plan <= complete:
            yield f"{name}: {len(plan & complete)} of {len(plan)} planned trials are complete"
        if not complete <= plan:
            yield f"{name}: {len(complete - plan)} trial(s) that its plan does not have are counted"


def _pooled_sessions(rows: Rows) -> Iterator[str]:
    sessions = {(table, row.participant, row.session) for table, its_rows in rows.items() for row in its_rows}
    for participant, count in sorted(Counter(participant for _, participant, _ in sessions).items()):
        if count > 1:
            yield f"sub-{participant} has {count} sessions; their trials are pooled"


def _similar_participants(rows: Rows) -> Iterator[str]:
    labels = {row.participant for row in itertools.chain.from_iterable(rows.values())}
    for words in alike_words(labels):
        yield f"participants that look alike: {words}; are they one?"


def _missing_cells(rows: Rows, design: Design) -> Iterator[str]:
    filled: dict[str, set[frozenset[tuple[str, Level | None]]]] = defaultdict(set)
    for row in itertools.chain.from_iterable(rows.values()):
        cells = filled[row.participant]
        if row.used and row.trial_type == "stimulus":
            cells.add(frozenset((factor.name, row.levels[factor.name]) for factor in design.factors))
    for participant, cells in sorted(filled.items()):
        missing = [cell for cell in conditions(design.factors) if frozenset(cell) not in cells]
        if missing:
            cells_in_words = "; ".join(describe_condition(cell) for cell in missing[:_MOST_NAMED])
            more = f"; and {len(missing) - _MOST_NAMED} more" if len(missing) > _MOST_NAMED else ""
            yield f"sub-{participant} has no counted stimulus in: {cells_in_words}{more}"
