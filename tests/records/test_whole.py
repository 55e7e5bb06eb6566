"""Nothing is appended, and so nothing emitted, when the log is not whole."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.errors import DeviceError
from autd_trials.records.chain import Head, Line, split_lines
from autd_trials.records.log import EventLog, is_being_written, read_log
from autd_trials.testing.script import SessionScript


def remove(path: Path) -> None:
    path.unlink()


def rename(path: Path) -> None:
    path.rename(path.with_name("other"))


def remove_folder(path: Path) -> None:
    shutil.rmtree(path.parent)


def rename_folder(path: Path) -> None:
    path.parent.rename(path.parent.with_name("gone"))


def truncate(path: Path) -> None:
    os.truncate(path, 10)


def empty(path: Path) -> None:
    os.truncate(path, 0)


def grow(path: Path) -> None:
    with path.open("ab") as file:
        file.write(b"\n")


def replace_with_a_copy(path: Path) -> None:
    copy = path.with_name("copy")
    shutil.copy(path, copy)
    copy.replace(path)


def overwrite_the_end(path: Path) -> None:
    with path.open("r+b") as file:
        file.seek(-9, os.SEEK_END)
        was = file.read(1)
        file.seek(-9, os.SEEK_END)
        file.write(b"1" if was == b"0" else b"0")


HARM = [
    remove,
    rename,
    remove_folder,
    rename_folder,
    truncate,
    empty,
    grow,
    replace_with_a_copy,
    overwrite_the_end,
]


@pytest.mark.parametrize("harm", HARM)
def test_a_log_that_is_not_whole_takes_no_event(tmp_path: Path, harm: Callable[[Path], None]) -> None:
    path = tmp_path / "folder" / "log.jsonl"
    script = SessionScript().trial(1)
    log = EventLog.create(path)
    log.append(script.events[0])
    log.refuse_if_not_whole()
    harm(path)
    with pytest.raises(DeviceError, match="disk: ") as refusal:
        log.append(script.events[1])
    assert str(path) in str(refusal.value)
    assert refusal.value.exit_code == 4
    with pytest.raises(DeviceError):
        log.refuse_if_not_whole()
    if harm in (remove, remove_folder, replace_with_a_copy):
        with pytest.raises(DeviceError, match="what it held is in") as told:
            log.close()
        copy = Path(told.value.what.split("what it held is in ")[1])
        assert list(read_log(copy).events) == script.events[:1]
    else:
        log.close()


def test_a_removed_log_is_rescued_beside_what_was_rescued_before(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    for number in ("", ".2"):
        log = EventLog.create(path)
        log.append(SessionScript().events[0])
        path.unlink()
        with pytest.raises(DeviceError):
            log.close()
        assert (tmp_path / f"log.jsonl.rescued{number}").is_file()
    assert not path.exists()


def test_a_log_that_somebody_made_anew_is_not_removed(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    log = EventLog.create(path)
    path.unlink()
    path.write_text("somebody's")
    log.close()
    assert path.read_text() == "somebody's"


def test_who_is_writing_is_seen_and_not_disturbed(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    script = SessionScript().trial(1)
    with EventLog.create(path) as log:
        for event in script.events:
            assert is_being_written(path)
            log.append(event)
    assert not is_being_written(path)
    assert not is_being_written(tmp_path / "none")


def test_several_events_are_appended_together(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    script = SessionScript().trial(1).trial(2)
    with EventLog.create(path) as log:
        log.append(script.events[0])
        log.append_all(script.events[1:])
        log.append_all([])
    assert list(read_log(path).events) == script.events
    _assert_chained(path)


raw_lines = st.lists(st.binary(max_size=30).filter(lambda line: b"\n" not in line) | st.just(b"{}"))


@given(events=st.lists(st.text(max_size=10)), torn=st.dictionaries(st.integers(0, 8), st.binary(max_size=9)))
def test_a_chain_holds_what_was_written_and_nothing_else(events: list[str], torn: dict[int, bytes]) -> None:
    lines, head = [], Head()
    for number, text in enumerate(events):
        if number in torn:
            lines.append(torn[number].replace(b"\n", b""))
            head = head.after(Line.parse(lines[-1]))
        lines.append(head.seal(b'{"text":"%b"}' % text.encode("unicode-escape").replace(b'"', b"'")))
        head = head.after(Line.parse(lines[-1]))
    assert _broken(lines) == []
    for number, line in enumerate(lines):
        if number < len(lines) - 1:
            assert _broken([*lines[:number], *lines[number + 1 :]]) != []
            assert _broken([*lines[:number], line + b" ", *lines[number + 1 :]]) != []
            assert _broken([*lines[:number], line, *lines[number:]]) != []


def _broken(lines: list[bytes]) -> list[int]:
    head, broken = Head(), []
    for number, raw in enumerate(lines, start=1):
        line = Line.parse(raw)
        if line.chain is not None and (line.chain, line.number) != (head.expected(line.text), number):
            broken.append(number)
        head = head.after(line)
    return broken


def _assert_chained(path: Path) -> None:
    assert _broken(split_lines(path.read_bytes())) == []
