import os
import subprocess
import sys
from pathlib import Path

import pytest

from autd_trials.host import FileHeldError, HeldFile, sync_folder

HOLDER = """
import sys
from pathlib import Path
from autd_trials.host import HeldFile
held = HeldFile(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


def test_a_held_file_names_its_holder_and_can_be_held_again_after_release(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    held = HeldFile(path)
    with pytest.raises(FileHeldError) as caught:
        HeldFile(path)
    assert caught.value.pid == os.getpid()
    held.release()
    HeldFile(path).release()
    assert path.exists(), "it stays: to remove it would be a race"


def test_a_killed_holder_does_not_block(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    other = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout is not None
    assert other.stdout.readline() == "held\n"
    with pytest.raises(FileHeldError) as caught:
        HeldFile(path)
    assert caught.value.pid == other.pid
    other.kill()
    other.communicate()
    HeldFile(path).release()


def test_a_lock_is_not_followed_through_a_link(tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("keep me")
    (tmp_path / "lock").symlink_to(victim)
    with pytest.raises(OSError, match=r"symbolic|Too many levels"):
        HeldFile(tmp_path / "lock")
    assert victim.read_text() == "keep me"


def test_a_folder_can_be_synced_and_a_missing_one_cannot(tmp_path: Path) -> None:
    sync_folder(tmp_path)
    with pytest.raises(FileNotFoundError):
        sync_folder(tmp_path / "none")
