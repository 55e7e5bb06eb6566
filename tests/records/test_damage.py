"""Damaged lines are damaged lines everywhere: counted, told, never a traceback."""

import contextlib
import json
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.errors import UsageError
from autd_trials.records.bids import export_study
from autd_trials.records.chain import Head, Line, split_lines
from autd_trials.records.history import unfinished_sessions, used_before
from autd_trials.records.log import read_log
from autd_trials.records.roster import known_participant, place_of
from autd_trials.records.sessions import study_sessions, take_up
from autd_trials.records.verify import verify_study
from autd_trials.session.events import Note
from autd_trials.testing.script import SessionScript

UTC_TEXT = "2026-11-22T09:30:00+00:00"
BAD_TIMES = [
    "",
    "yesterday",
    "2026-11-22",
    "2026-11-22T09:00:00",
    "0001-01-01T00:00:00+14:00",
    "9999-12-31T23:59:59-14:00",
    "2026-13-01T00:00:00+00:00",
    "1969-12-31T23:59:59+00:00",
]
BAD_VALUES: list[dict[str, Any]] = [
    *({"utc": time} for time in BAD_TIMES),
    {"utc": 5},
    {"t_s": None},
    {"t_s": "1"},
    {"t_s": 1e300},
    {"t_s": float("nan")},
    {"t_s": float("inf")},
    {"t_s": 10**400},
    {"trial": 99},
    {"trial": 0},
    {"trial": -1},
    {"trial": 10**30},
    {"attempt": 0},
    {"event": "session-start"},
    {"event": "unheard-of"},
    {"more": 1},
]


def write_again(path: Path, number: int, line: bytes, *, chained: bool) -> None:
    """Put another line into a log; with the chain computed again, nothing but the line itself is wrong."""
    lines = split_lines(path.read_bytes())
    lines[number] = line
    if chained:
        head, done = Head(), []
        for each in lines:
            event = Line.parse(each).event
            done.append(head.seal(event) if event.startswith(b"{") else event)
            head = head.after(Line.parse(done[-1]))
        lines = done
    path.write_bytes(b"".join(each + b"\n" for each in lines))


def use_everything(study: Path) -> int:
    """Do all that can be done with a study's records; return how many damaged lines were counted."""
    (found,) = study_sessions(study)
    now = datetime(2026, 11, 22, 10, 0, tzinfo=UTC)
    assert used_before(study, "01", now, "01").today_s >= 0
    assert place_of(study, "01", simulated=True) == 1
    assert known_participant(study, "01") is not None
    assert [each.paths for each in unfinished_sessions(study)] == [found.paths]
    verify_study(study)
    export_study(study)
    with take_up(found) as log:
        log.append(Note(t_s=found.standing.last_t_s, utc=UTC_TEXT, text="gone on"))
    return len(read_log(found.paths.log).damaged)


@pytest.mark.parametrize("change", BAD_VALUES, ids=str)
@pytest.mark.parametrize("chained", [True, False])
def test_a_line_with_an_invalid_value_is_a_damaged_line(
    study: Path, change: dict[str, Any], chained: bool
) -> None:
    path = SessionScript().block(1).trial(1).begin(2).save(study)
    line = split_lines(path.read_bytes())[-1]
    event = json.loads(line) | change
    write_again(path, 6, json.dumps(event).encode(), chained=chained)
    assert [number for number, _ in read_log(path).damaged] == [7]
    assert any(problem.line == 7 for problem in verify_study(study))
    assert use_everything(study) == 1


@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_whatever_happens_to_bytes_the_rest_is_read(data: st.DataObject) -> None:
    script = SessionScript().block(1).trial(1).pause().note("Zoë").fault().resume(after_crash=False).trial(2)
    with tempfile.TemporaryDirectory() as folder:
        study = Path(folder)
        path = script.save(study)
        content = bytearray(path.read_bytes())
        first = content.index(b"\n") + 1
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(first, len(content) - 1))
            length = data.draw(st.integers(0, 40))
            content[at : at + length] = data.draw(st.binary(max_size=40))
        path.write_bytes(bytes(content))
        use_everything(study)
        assert read_log(path).events[0] == script.events[0], "the untouched line is read"


@settings(max_examples=60, deadline=None)
@given(content=st.binary(max_size=200) | st.sampled_from([b"[" * 100_000, b'{"a":' * 100_000, b"\n" * 50]))
def test_what_is_no_log_at_all_is_refused_in_words(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        study = Path(folder)
        path = SessionScript().save(study)
        path.write_bytes(content)
        verify_study(study)
        for use in (study_sessions, export_study, lambda study: place_of(study, "02", simulated=False)):
            with contextlib.suppress(UsageError):
                use(study)
