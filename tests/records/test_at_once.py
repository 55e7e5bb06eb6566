"""Several processes on one study, and file systems that cannot lock."""

import errno
import subprocess
import sys
from pathlib import Path

import pytest

from autd_trials.errors import UsageError
from autd_trials.host import FileHeldError, HeldFile, NoLocksError
from autd_trials.records.bids import export_study
from autd_trials.records.disk import replace_text, write_new
from autd_trials.records.log import EventLog
from autd_trials.records.sessions import study_lock
from autd_trials.testing.script import SessionScript

EXPORT = """
import sys
from pathlib import Path
from autd_trials.records.bids import export_study
for _ in range(3):
    export_study(Path(sys.argv[1]))
"""


def test_exports_at_once_wait_for_each_other(study: Path) -> None:
    for place in (1, 2):
        SessionScript(f"0{place}", place=place).all_trials().save(study)
    command = [sys.executable, "-c", EXPORT, str(study)]
    running = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    assert [(process.communicate()[1], process.returncode) for process in running] == [("", 0)] * 3
    before = (study / "README.md").read_bytes()
    assert export_study(study).told == []
    assert (study / "README.md").read_bytes() == before
    assert not list(study.rglob("*.part"))


def test_writers_of_one_file_do_not_get_into_each_others_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "results.txt"
    replace = Path.replace

    def another_first(half: Path, target: Path) -> Path:
        monkeypatch.setattr(Path, "replace", replace)
        replace_text(path, "the other's")
        return half.replace(target)

    monkeypatch.setattr(Path, "replace", another_first)
    replace_text(path, "mine")
    assert path.read_text() == "mine"
    assert [each.name for each in tmp_path.iterdir()] == ["results.txt"]


def test_new_files_never_overwrite(tmp_path: Path) -> None:
    names = [write_new(tmp_path, "a.txt", text).name for text in (b"1", b"2", b"3")]
    assert names == ["a.txt", "a.txt.2", "a.txt.3"]
    assert [(tmp_path / name).read_bytes() for name in names] == [b"1", b"2", b"3"]


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EINVAL])
def test_a_file_system_without_locks_is_told_as_such(
    study: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    SessionScript().save(study)

    def refuse(_descriptor: int) -> None:
        raise OSError(number, "No locks available")

    monkeypatch.setattr("autd_trials.host._lock", refuse)
    with pytest.raises(NoLocksError):
        HeldFile(study / "lock")
    for use in (lambda: EventLog.create(study / "log.jsonl"), lambda: study_lock(study).__enter__()):
        with pytest.raises(UsageError, match="cannot lock files") as refusal:
            use()
        assert "another run" not in str(refusal.value)
        assert "local disk" in str(refusal.value)
    assert export_study(study).files, "an export does without"


def test_who_waits_long_enough_gets_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "lock"
    held = HeldFile(path)
    with pytest.raises(FileHeldError):
        HeldFile(path)
    monkeypatch.setattr("autd_trials.host.time.sleep", lambda _s: held.release())
    HeldFile(path, patience_s=60.0).release()
