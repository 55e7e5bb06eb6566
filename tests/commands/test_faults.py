"""What goes wrong in a lab, each with its exit code and a message that says what to do."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from autd_trials.array.emulator import Emulator
from tests.commands.conftest import Run, WriteProtocol, WriteRig, events, make_real, of, start
from tests.commands.test_run import of_or_none, wait_for
from tests.conftest import PseudoTerminal
from tests.masking.conftest import SoundServer

Data = dict[str, Any]


def break_rotation(_rig: Data, calibration: Data) -> None:
    calibration["units"][1]["rotation"][0][0] = 0.9


def mirror(_rig: Data, calibration: Data) -> None:
    calibration["units"][1]["rotation"] = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize(
    ("change", "code", "message"),
    [
        (lambda rig, _: rig["calibration"].update(file="none.yaml"), 2, "none.yaml does not exist"),
        (break_rotation, 2, "this is not a rotation matrix"),
        (mirror, 2, "this is not a rotation matrix"),
        (lambda rig, _: rig["calibration"].update(oldest_days=0.001), 2, "calibrate again"),
        (
            lambda rig, _: rig["array"].update(link={"interface": "nosuchnic0"}),
            5,
            "this calibration is made up",
        ),
        (lambda rig, _: rig["array"].update(lnk="emulator"), 2, "did you mean 'link'"),
        (lambda rig, _: rig.pop("sound"), 2, "rig 'emulated' has no sound"),
        (lambda rig, _: rig["array"]["limits"].update(largest_drive=0.5), 5, "the drive would be 1"),
        (
            lambda rig, _: rig["array"]["limits"].update(session_exposure_s=1),
            5,
            "exposure in s at full drive would",
        ),
        (
            lambda rig, _: rig["array"]["limits"].update(longest_burst_s=0.1),
            5,
            "the burst's length in s would be 0.2",
        ),
        (lambda rig, _: rig["array"]["limits"].update(largest_duty=0.001), 5, "share of on-time"),
        (
            lambda rig, _: rig["array"]["limits"].update(largest_ear_level_db=100),
            5,
            "level at the ears (participant) would be",
        ),
    ],
)
def test_a_wrong_rig_is_refused_before_anything_is_emitted(
    run: Run,
    tmp_path: Path,
    write_protocol: WriteProtocol,
    write_rig: WriteRig,
    change: Any,
    code: int,
    message: str,
) -> None:
    done = run(
        "run", write_protocol(), "--rig", write_rig(change), "--simulate", 1, "--data", tmp_path / "data"
    )
    assert done.code == code
    assert message in done.err
    assert "  -> " in done.err or ": " in done.err
    assert not list((tmp_path / "data").rglob("*_events.tsv"))


def test_a_target_out_of_reach_is_refused(run: Run, tmp_path: Path, write_protocol: WriteProtocol) -> None:
    path = write_protocol(targets={"chest": {"x_mm": 302, "y_mm": 225, "z_mm": 4000}}, head=None)
    for command in (["check", path], ["run", path, "--simulate", 1, "--data", tmp_path / "data"]):
        refused = run(*command)
        assert refused.code == 2
        assert "is out of reach of unit 1" in refused.err


def test_masking_can_be_declined_and_the_log_says_so(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig
) -> None:
    silent = write_rig(lambda rig, _cal: rig.pop("sound"))
    arguments = ("run", write_protocol(), "--rig", silent, "--simulate", 1, "--data", tmp_path / "data")
    assert "--audio none" in run(*arguments).err
    assert run(*arguments, "--audio", "none").code == 0
    assert any("declined with --audio none" in note["text"] for note in of("note", tmp_path / "data"))


def test_simulated_participants_and_yes_are_refused_on_a_real_array(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig
) -> None:
    arguments = ("run", write_protocol(), "--rig", write_rig(make_real), "--data", tmp_path / "data")
    simulated = run(*arguments, "--simulate", 1)
    assert simulated.code == 2
    assert "simulated participants only run on an emulated one" in simulated.err
    unattended = run(*arguments, "--yes")
    assert unattended.code == 2
    assert "a person must confirm" in unattended.err


def test_a_log_truncated_in_mid_line_is_gone_on_with(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    arguments = ("run", write_protocol(), "--simulate", 1, "--data", tmp_path)
    run(*arguments)
    (log,) = tmp_path.glob("short/sourcedata/*/*/*_log.jsonl")
    whole = log.read_bytes()
    cut = whole.index(b'"event":"stimulus","trial":4') + 20
    log.write_bytes(whole[:cut])
    assert run(*arguments, "--resume").code == 0
    lines = log.read_bytes().splitlines()
    assert log.read_bytes().startswith(whole[:cut]), "the torn line stays"
    import json

    ends = [json.loads(line) for line in lines if b'"trial-end"' in line]
    assert [end["trial"] for end in ends if end["status"] == "complete"] == [1, 2, 3, 4, 5, 6]
    assert [end["trial"] for end in ends if end["status"] == "interrupted"] == [4]


def test_a_full_disk_ends_the_session_and_what_was_recorded_stays(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    """On a real file system that is too small; needs the right to mount one."""
    small = tmp_path / "small"
    small.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=24k", "tmpfs", str(small)], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("cannot mount a small file system here")
    try:
        done = run("run", write_protocol(repetitions=4), "--simulate", 1, "--data", small)
        assert done.code == 4
        assert "disk" in done.err
        (log,) = small.glob("short/sourcedata/*/*/*_log.jsonl")
        assert log.read_bytes().startswith(b'{"n":1,')
    finally:
        subprocess.run(["umount", str(small)], check=True)


@pytest.mark.emulator
@pytest.mark.slow
def test_an_emulator_killed_in_mid_trial_fails_the_session_and_keeps_its_log(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    protocol = write_protocol(lambda data: data["stimulus"].update(duration_s=0.3))
    process = start(protocol, "--simulate", 1, "--real-time", "--data", tmp_path)
    wait_for(lambda: len(of_or_none("stimulus", tmp_path)) == 2)
    os.kill(_child(process.pid, "autd_trials.array.emulator"), signal.SIGKILL)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 4
    assert "Traceback" not in err
    assert "devices have not answered" in err or "devices answer" in err
    assert "-> " in err
    log = events(tmp_path)
    assert log[-1]["status"] == "failed"
    assert [e["status"] for e in log if e["event"] == "trial-end"] == ["complete", "interrupted"]
    assert any(e["event"] == "fault" for e in log)


@pytest.mark.emulator
@pytest.mark.slow
def test_two_runners_on_one_array_at_once(tmp_path: Path, write_protocol: WriteProtocol) -> None:
    """On a running emulator, as on a network interface, the second is refused by the first one's process."""
    with Emulator(18) as emulator:
        holder = subprocess.Popen(
            [sys.executable, "-c", HOLD_ARRAY, emulator.address], stdout=subprocess.PIPE, text=True
        )
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        second = subprocess.run(
            [sys.executable, "-c", HOLD_ARRAY, emulator.address], capture_output=True, text=True, check=False
        )
        holder.kill()
        holder.communicate()
    assert f"another runner (process {holder.pid}) is using this array" in second.stderr


HOLD_ARRAY = """
import sys, time
from autd_trials.array.link import EmulatorLink, HeldLink
held = HeldLink(EmulatorLink(sys.argv[1]), 18)
print("held", flush=True)
time.sleep(60)
"""


def test_two_sessions_at_once_in_one_study_get_different_places(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    path = write_protocol()
    processes = [
        start(path, "--simulate", 1, "--participant", name, "--data", tmp_path) for name in ("a", "b")
    ]
    codes = [process.communicate() and process.returncode for process in processes]
    for name, code in zip("ab", codes, strict=True):
        if code == 2:  # told that another was just beginning
            assert run("run", path, "--simulate", 1, "--participant", name, "--data", tmp_path).code == 0
    table = (tmp_path / "short" / "participants.tsv").read_text().splitlines()[1:]
    assert sorted(line.split("\t")[1] for line in table) == ["1", "2"]


@pytest.mark.slow
@pytest.mark.emulator
def test_a_serial_box_unplugged_in_a_session_pauses_and_an_unattended_one_ends(
    tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig, line: PseudoTerminal
) -> None:
    serial = {"device": "serial", "port": line.name, "protocol": {"kind": "line", "baud": 115200}}
    rig = write_rig(lambda rig, _cal: rig.update(responses=serial))
    done = _attended(tmp_path, write_protocol(), rig, lambda: line.unplug())
    assert done.returncode == 4
    assert "unplugged" in done.stderr or "serial" in done.stderr
    assert events(tmp_path / "data")[-1]["status"] == "failed"


@pytest.mark.slow
@pytest.mark.emulator
@pytest.mark.audio
def test_a_sound_device_that_goes_in_a_session_pauses_and_an_unattended_one_ends(
    tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig, sound_server: SoundServer
) -> None:
    sound = {"player": "portaudio", "device": "default"}
    rig = write_rig(lambda rig, _cal: rig.update(sound=sound))
    done = _attended(tmp_path, write_protocol(repetitions=4), rig, sound_server.kill)
    assert done.returncode == 4
    assert "sound device" in done.stderr
    assert "Traceback" not in done.stderr
    assert events(tmp_path / "data")[-1]["status"] == "failed"


def _attended(tmp_path: Path, protocol: Path, rig: Path, happen: Any) -> "subprocess.CompletedProcess[str]":
    """Run a live session whose confirmations are all given; let something happen in its second trial."""
    import pexpect

    from tests.commands.conftest import RUN_PROTOCOL

    data = tmp_path / "data"
    arguments = [*RUN_PROTOCOL[1:], str(protocol), "--rig", str(rig), "--data", str(data), "--yes"]
    child = pexpect.spawn(RUN_PROTOCOL[0], arguments, encoding="utf-8", timeout=60, dimensions=(40, 120))
    try:
        deadline_s = time.monotonic() + 30
        while len(of_or_none("stimulus", data)) < 2 and time.monotonic() < deadline_s:
            child.expect([pexpect.TIMEOUT, r".+"], timeout=0.02)
        happen()
        child.expect(pexpect.EOF)
        text = child.before
    finally:
        child.close()
    return subprocess.CompletedProcess(arguments, child.exitstatus or 0, "", text)


def _child(parent: int, module: str) -> int:
    for path in Path("/proc").glob("[0-9]*"):
        try:
            status = (path / "stat").read_text().rpartition(")")[2].split()
            command = (path / "cmdline").read_bytes().decode()
        except (OSError, UnicodeDecodeError):
            continue
        if int(status[1]) == parent and module in command:
            return int(path.name)
    raise AssertionError(f"{module} does not run")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("command", [["plan", "chest"], ["schema", "protocol"], ["devices", "--json"]])
def test_a_full_disk_behind_the_output_is_told(command: list[str]) -> None:
    code = "import sys; from autd_trials.cli import main; sys.exit(main())"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code, *command],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert "standard output: the result cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
