import errno
import os
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.errors import DeviceError, UsageError
from autd_trials.records.log import EventLog, has_begun, read_log, read_start
from autd_trials.session.events import Event, Fault, Note, Pause, ResponseMade, SessionEnd, StimulusStart
from autd_trials.testing.script import SessionScript, write_log
from tests.records.conftest import largest_file

KILLS = 8
UTC_TEXT = "2026-11-22T10:00:00+00:00"

seconds = st.floats(0, 1e9)
anywhere = st.floats(-1e9, 1e9)
texts = st.text(max_size=40)
times = st.datetimes(datetime(1971, 1, 2), datetime(8999, 1, 1), timezones=st.just(UTC))
stamps = {"t_s": seconds, "utc": times.map(datetime.isoformat)}
trials = st.integers(1, len(SessionScript().plan.trials))
events: st.SearchStrategy[Event] = st.one_of(
    st.builds(Note, **stamps, text=texts, event=st.just("note")),
    st.builds(Pause, **stamps, reason=texts, event=st.just("pause")),
    st.builds(Fault, **stamps, device=texts, what=texts, happened_t_s=seconds, event=st.just("fault")),
    st.builds(
        ResponseMade,
        **stamps,
        event=st.just("response"),
        trial=trials,
        attempt=st.integers(1),
        phase=st.sampled_from(["outside", "before_onset", "window", "late"]),
        press_t_s=anywhere,
        button=texts,
        response_time_s=st.none() | anywhere,
        device_time_s=st.none() | seconds,
    ),
    st.builds(
        StimulusStart,
        **stamps,
        event=st.just("stimulus"),
        trial=trials,
        attempt=st.integers(1),
        onset_t_s=seconds,
        planned_onset_t_s=seconds,
        device_ns=st.integers(0, 2**63),
        margin_s=seconds,
        duration_s=st.floats(0.01, 16),
        drive=st.floats(0, 1),
        exposure_s=seconds,
    ),
)


@given(middle=st.lists(events, max_size=20))
def test_what_is_written_is_read_back(middle: list[Event]) -> None:
    script = SessionScript()
    written = [*script.events, *middle]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "sub", "log.jsonl")
        write_log(path, written)
        assert list(read_log(path).events) == written
        assert len(path.read_bytes().split(b"\n")) == len(written) + 1


@settings(max_examples=200)
@given(data=st.data())
def test_a_log_cut_off_at_any_byte_loses_only_the_torn_line_and_can_be_gone_on_with(
    data: st.DataObject,
) -> None:
    script = SessionScript().note("Zoë \u2028 日本").trial(1)
    after = Note(t_s=99.0, utc=UTC_TEXT, text="gone on")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "log.jsonl")
        write_log(path, script.events)
        whole = path.read_bytes()
        cut = data.draw(st.integers(whole.index(b"\n"), len(whole)))
        path.write_bytes(whole[:cut])
        lines = whole[:cut].count(b"\n") or 1
        with EventLog.reopen(path) as log:
            log.append(after)
        assert path.read_bytes().startswith(whole[:cut])
        contents = read_log(path)
        kept = contents.events[:-1]
        assert contents.events[-1] == after
        assert list(kept) == script.events[: len(kept)]
        # A line that only lost its line break is whole.
        assert len(kept) == lines or (len(kept) == lines + 1 and not contents.damaged)
        assert len(contents.damaged) <= 1


def test_a_torn_line_is_reported_with_its_number(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    write_log(path, SessionScript().note("one").note("two").events)
    path.write_bytes(path.read_bytes()[:-10])
    contents = read_log(path)
    assert [number for number, _ in contents.damaged] == [3]
    assert contents.damaged[0][1].startswith('{"n":3,"t_s":')
    assert len(contents.events) == 2


@pytest.mark.parametrize(
    "line", [b"", b"\x00\x00\x00", b"\xff\xfe", b"[]", b"null", b'{"event":"note"}', b"{"]
)
def test_damage_in_the_middle_is_reported_and_the_rest_is_read(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "log.jsonl"
    script = SessionScript().note("one").note("two")
    write_log(path, script.events)
    first, one, two, _ = path.read_bytes().split(b"\n")
    path.write_bytes(b"\n".join([first, one, line, two, b""]))
    contents = read_log(path)
    assert list(contents.events) == script.events
    assert [number for number, _ in contents.damaged] == [3]


@pytest.mark.parametrize(
    "line", [b"", b"\n", b"{}\n", b'{"t_s":0,"utc":"","event":"note","text":""}\n', b"\xff\n"]
)
def test_a_log_that_does_not_start_with_the_sessions_start_is_refused(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "log.jsonl"
    path.write_bytes(line)
    for read in (read_log, read_start):
        with pytest.raises(UsageError, match="not the start of a session") as refusal:
            read(path)
        assert f"{path}:1" in str(refusal.value)


def test_a_log_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read"):
        read_log(tmp_path / "none.jsonl")
    with pytest.raises(UsageError, match="no such session"):
        EventLog.reopen(tmp_path / "none.jsonl")
    assert not (tmp_path / "none.jsonl").exists()


def test_a_log_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    write_log(path, SessionScript().events)
    before = path.read_bytes()
    with pytest.raises(UsageError, match="recorded already"):
        EventLog.create(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("durable", [True, False])
def test_an_event_is_in_the_file_when_append_returns(tmp_path: Path, *, durable: bool) -> None:
    path = tmp_path / "log.jsonl"
    script = SessionScript().trial(1)
    with EventLog.create(path, durable=durable) as log:
        for number, event in enumerate(script.events, start=1):
            log.append(event)
            assert list(read_log(path).events) == script.events[:number]


def test_a_log_without_events_is_removed_again(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    log = EventLog.create(path)
    assert not has_begun(path)
    log.close()
    log.close()
    assert not path.exists()


def test_a_second_writer_is_refused_while_the_first_is_there(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    script = SessionScript().note("one")
    with EventLog.create(path) as log:
        log.append(script.events[0])
        with pytest.raises(UsageError, match="another run is writing this log"):
            EventLog.reopen(path)
        code = (
            "import sys; from pathlib import Path; from autd_trials.records.log import EventLog\n"
            "EventLog.reopen(Path(sys.argv[1]))"
        )
        command = [sys.executable, "-c", code, str(path)]
        other = subprocess.run(command, capture_output=True, text=True, check=False)
        assert "another run is writing this log" in other.stderr
        log.append(script.events[1])
    assert list(read_log(path).events) == script.events


def test_what_is_not_a_number_is_never_written(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    start = SessionScript().events[0]
    with EventLog.create(path) as log:
        log.append(start)
        with pytest.raises(ValueError, match="JSON compliant"):
            log.append(Pause(t_s=0.0, utc=UTC_TEXT, reason="").model_copy(update={"t_s": float("nan")}))
    assert list(read_log(path).events) == [start]


def test_a_stray_byte_in_a_note_does_not_cost_the_event(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    write_log(path, [*SessionScript().events, Note(t_s=1.0, utc=UTC_TEXT, text="caf\udce9")])
    event = read_log(path).events[-1]
    assert isinstance(event, Note)
    assert event.text == "caf?"


def test_an_event_that_a_full_disk_refuses_leaves_the_log_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    script = SessionScript().note("x" * 1000).note("after")
    with EventLog.create(path) as log:
        log.append(script.events[0])
        before = path.read_bytes()
        with largest_file(len(before) + 500), pytest.raises(DeviceError, match="disk: ") as refusal:
            log.append(script.events[1])
        assert str(path) in str(refusal.value)
        assert path.read_bytes() == before
        log.append(script.events[2])
    assert list(read_log(path).events) == [script.events[0], script.events[2]]


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_disk_that_is_really_full(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("mounting is not allowed here")
    try:
        path = disk / "log.jsonl"
        acknowledged = SessionScript().events
        with EventLog.create(path) as log:
            log.append(acknowledged[0])
            with pytest.raises(DeviceError, match=os.strerror(errno.ENOSPC)):
                _append_until_refused(log, acknowledged)
        contents = read_log(path)
        assert list(contents.events) == acknowledged
        assert not contents.damaged
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def _append_until_refused(log: EventLog, acknowledged: list[Event]) -> None:
    for number in range(1000):
        event = Note(t_s=float(number), utc=UTC_TEXT, text="x" * 777)
        log.append(event)
        acknowledged.append(event)


_WRITER = """
import sys
from pathlib import Path
from autd_trials.records.log import EventLog
from autd_trials.session.events import Note
log = EventLog.reopen(Path(sys.argv[1]))
first = int(sys.argv[2])
for number in range(first, first + 1_000_000):
    log.append(Note(t_s=float(number), utc="2026-11-22T10:00:00+00:00", text="x" * (number % 300)))
    print(number, flush=True)
"""


@pytest.mark.slow
def test_a_writer_that_is_killed_loses_no_acknowledged_line(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    write_log(path, SessionScript().events)
    acknowledged = 0
    for kill in range(KILLS):
        acknowledged = _write_and_kill(path, first=1000 * kill, acknowledge=5 + 7 * kill % 40)
        contents = read_log(path)
        numbers = {event.t_s for event in contents.events if isinstance(event, Note)}
        assert acknowledged >= 1000 * kill
        assert numbers >= set(map(float, range(1000 * kill, acknowledged + 1)))
    assert len(read_log(path).damaged) <= KILLS
    with EventLog.reopen(path) as log:
        log.append(SessionEnd(t_s=1e6, utc=UTC_TEXT, status="aborted", why="killed"))
    assert isinstance(read_log(path).events[-1], SessionEnd)


def _write_and_kill(path: Path, first: int, acknowledge: int) -> int:
    with subprocess.Popen(
        [sys.executable, "-c", _WRITER, str(path), str(first)], stdout=subprocess.PIPE, text=True
    ) as writer:
        assert writer.stdout is not None
        for _ in range(acknowledge):
            writer.stdout.readline()
        writer.kill()
        last_words = writer.stdout.read().split()
    return int(last_words[-1]) if last_words else first + acknowledge - 1
