"""The whole way: sensor nodes, recording, calibration, a session; Ctrl-C, kill and a full disk on the way."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
import yaml

from autd_trials.acoustics.air import Air
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.mounts import load_mounts
from autd_trials.calibration.network.recording import RAW_COLUMNS
from autd_trials.calibration.pose_error import energy_left
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensors.hand import hand_path
from autd_trials.yamlfile.shipped import find_file
from tests.calibration.network.node import RATE_HZ, Node
from tests.calibration.network.test_nodes import AUTD_TRIALS
from tests.calibration.scenes import Scene
from tests.commands.conftest import Run
from tests.lsl import keep_to_ourselves

keep_to_ourselves()

TRUTH = find_file("emulated-calibration", kind="calibration", folder="rigs")
MOUNTS = find_file("emulated-mounts", kind="mounts file", folder="scenes")
B_MM = (302.0, 225.0, 1000.0)
TIMEOUT_S = 100.0  # for a machine that is busy with other work

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start() -> Iterator[Start]:
    """Return what starts a command in a process of its own."""
    processes = []

    def call(*arguments: object, by: tuple[str, ...] = ()) -> "subprocess.Popen[str]":
        command = [*by, *AUTD_TRIALS, *map(str, arguments)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield call
    for process in processes:
        process.kill()
        process.communicate()


class Sensors:
    """Both units' nodes in the emulated scene, where the target is waved at 0.5 m/s; nothing is rendered."""

    def __init__(self, stack: ExitStack, run: int = 1) -> None:
        self._nodes = [stack.enter_context(Node(unit, run)) for unit in (1, 2)]
        units = load_calibration(TRUTH)[0].unit_poses()
        mounts = load_mounts(MOUNTS)[0].mounts
        self._scene = Scene(
            tuple(
                RigidMotion(unit.rotation, unit.translation_mm).after(mount.motion)
                for unit, mount in zip(units, mounts, strict=True)
            )
        )
        self._path = hand_path(np.array(B_MM), 400.0, 500.0, np.random.default_rng(1))
        self._generator = np.random.default_rng(2)
        self._sent_s = 1.0

    def see(self, seconds: float) -> None:
        """Send at once what is seen in some seconds of waving."""
        times_s = self._sent_s + np.arange(seconds * RATE_HZ) / RATE_HZ
        self._sent_s += seconds
        for unit, node in enumerate(self._nodes):
            own_s = times_s + 0.01 * unit
            node.send(own_s.tolist(), self._scene.seen(self._path(own_s), unit, self._generator))

    def wait_for_listener(self) -> None:
        """Wait until the master listens to both."""
        for node in self._nodes:
            node.wait_for_listener()

    def see_nothing(self, frames: int) -> None:
        """Send frames without the target."""
        for node in self._nodes:
            node.send([self._sent_s + number / RATE_HZ for number in range(frames)])


@pytest.fixture
def sensors() -> Iterator[Sensors]:
    """Both units' nodes."""
    with ExitStack() as stack:
        yield Sensors(stack)


def wait_for_lines(live: "subprocess.Popen[str]", folder: Path, lines: int) -> None:
    """Wait until the slower unit's samples are on disk."""
    paths = [folder / f"unit{unit}-raw.csv" for unit in (1, 2)]
    deadline = time.monotonic() + TIMEOUT_S
    while not all(path.exists() and path.read_bytes().count(b"\n") > lines for path in paths):
        assert live.poll() is None, live.communicate()
        assert time.monotonic() < deadline, f"{folder} did not fill"
        time.sleep(0.05)


def record(live: "subprocess.Popen[str]", sensors: Sensors, folder: Path, seconds: float) -> None:
    """Wave the target for some seconds, and wait until all of it is on disk."""
    sensors.wait_for_listener()
    sensors.see(seconds)
    wait_for_lines(live, folder, int(seconds * RATE_HZ))


@pytest.mark.slow
def test_a_study_runs_with_what_two_sensor_nodes_calibrated(
    start: Start, run: Run, sensors: Sensors, tmp_path: Path
) -> None:
    out = tmp_path / "calibration.yaml"
    aim = ("--mounts", "emulated-mounts", "--target=302,225,1000")
    live = start("calibrate", "--live", tmp_path / "live", *aim, "--out", out, "--json")
    record(live, sensors, tmp_path / "live", 40)
    live.send_signal(signal.SIGINT)
    stdout, stderr = live.communicate(timeout=TIMEOUT_S)
    assert live.returncode == 0, stderr
    report = json.loads(stdout)
    assert report["points"] > 1000
    energy = report["predicted_energy"]
    found, truth = (load_calibration(path)[0].unit_poses() for path in (out, TRUTH))
    left = energy_left(truth, found, B_MM, Air())
    assert 0.95 < left <= 1
    assert 0 < energy["low"] < energy["mean"] <= 1
    assert (tmp_path / "calibration.png").exists()

    rig = yaml.safe_load(TRUTH.with_name("emulated.yaml").read_text())
    rig["calibration"] = {
        "file": str(out),
        "true_file": str(TRUTH),
        "least_energy_left": 0.9 * energy["low"],
        "oldest_days": 1,
    }
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    study = run("run", "chest", "--rig", tmp_path / "rig.yaml", "--simulate", 1, "--data", tmp_path / "data")
    assert study.code == 0
    (log,) = (tmp_path / "data").rglob("*_log.jsonl")
    start_event = json.loads(log.read_text().splitlines()[0])
    assert start_event["calibration_sha256"] == load_calibration(out)[1]


@pytest.mark.slow
def test_ctrl_c_ends_the_recording_and_calibrates_and_a_kill_loses_nothing(
    start: Start, run: Run, sensors: Sensors, tmp_path: Path
) -> None:
    first = tmp_path / "first"
    live = start("calibrate", "--live", first, "--out", tmp_path / "first.yaml")
    record(live, sensors, first, 30)
    live.send_signal(signal.SIGINT)
    _, stderr = live.communicate(timeout=TIMEOUT_S)
    assert live.returncode == 0, stderr
    written = load_calibration(tmp_path / "first.yaml")[0]
    assert (written.made_up, written.origin) == (True, "simulated")
    assert [(each.sensor, each.serial) for each in written.sources] == [("synthetic", "synthetic")] * 2
    assert written.taken is not None
    assert 0 <= (written.time - written.taken).total_seconds() < TIMEOUT_S

    second = tmp_path / "second"
    live = start("calibrate", "--live", second, "--out", tmp_path / "second.yaml")
    record(live, sensors, second, 30)
    live.kill()
    live.communicate()
    assert not (tmp_path / "second.yaml").exists()
    again = run("calibrate", "--recorded", second, "--out", tmp_path / "second.yaml", "--json")
    assert again.code == 0
    assert again.json["points"] > 700
    assert load_calibration(tmp_path / "second.yaml")[0].origin == "simulated"
    refused = run("calibrate", "--live", second, "--out", tmp_path / "third.yaml", "--seconds", 1)
    assert refused.code == 2
    assert "exists already" in refused.err


@pytest.mark.slow
def test_a_full_disk_ends_the_recording_with_what_is_safe(
    start: Start, run: Run, sensors: Sensors, tmp_path: Path
) -> None:
    folder = tmp_path / "r"
    small_files = (sys.executable, "-c", LIMITED)
    live = start("calibrate", "--live", folder, "--out", tmp_path / "c.yaml", by=small_files)
    record(live, sensors, folder, 20)
    sensors.see(60)
    _, stderr = live.communicate(timeout=TIMEOUT_S)
    assert live.returncode == 4
    assert "Traceback" not in stderr
    assert "the disk does not take this" in stderr
    assert f"calibrate --recorded {folder}" in stderr
    again = run("calibrate", "--recorded", folder, "--out", tmp_path / "c.yaml", "--json")
    assert again.code == 0
    assert again.json["points"] > 500


LIMITED = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (80_000, 80_000))
os.execv(sys.argv[1], sys.argv[1:])
"""


@pytest.mark.slow
def test_sensors_that_see_nothing_leave_a_recording_and_a_word(
    start: Start, sensors: Sensors, tmp_path: Path
) -> None:
    folder = tmp_path / "r"
    live = start("calibrate", "--live", folder, "--out", tmp_path / "c.yaml")
    sensors.wait_for_listener()
    sensors.see_nothing(60)
    wait_for_lines(live, folder, 60)
    live.send_signal(signal.SIGTERM)
    _, stderr = live.communicate(timeout=TIMEOUT_S)
    assert live.returncode == 2
    assert "Traceback" not in stderr
    assert "unit 1 saw the target 0 times" in stderr
    assert (folder / "unit1-raw.csv").read_text().startswith(",".join(RAW_COLUMNS))


@pytest.mark.slow
def test_a_second_node_ends_a_recording_and_what_came_before_is_kept(
    start: Start, sensors: Sensors, tmp_path: Path
) -> None:
    folder = tmp_path / "r"
    live = start("calibrate", "--live", folder, "--out", tmp_path / "c.yaml")
    record(live, sensors, folder, 1)
    deadline = time.monotonic() + TIMEOUT_S
    with Node(2, run=9):
        while live.poll() is None:
            assert time.monotonic() < deadline, "the second node was not noticed"
            sensors.see(0.1)
            time.sleep(0.1)
    _, stderr = live.communicate()
    assert live.returncode == 4
    assert "two nodes say that they watch unit 2" in stderr
    assert f"what was recorded so far is in {folder}" in stderr
    runs = {line.split(",")[2] for line in (folder / "unit2-raw.csv").read_text().splitlines()[1:]}
    assert runs == {"1"}


def test_without_nodes_nothing_is_recorded(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autd_trials.commands.calibrate_live._FIND_TIMEOUT_S", 0.5)
    result = run("calibrate", "--live", tmp_path / "r", "--out", tmp_path / "c.yaml")
    assert result.code == 4
    assert "no sensor node of unit 1, 2 was found" in result.err
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--unit", "0", "--sensor", "synthetic"], "units are numbered from 1"),
        (["--unit", "3", "--sensor", "synthetic"], "the scene has no unit 3"),
        (["--unit", "1", "--sensor", "kinect"], "there is no sensor 'kinect'"),
        (["--unit", "1", "--sensor", "replay:/nowhere"], "this is no recording"),
        (["--unit", "1", "--sensor", "replay:/nowhere", "--speed", "2"], "--speed is for synthetic"),
        (["--unit", "1", "--sensor", "synthetic:emulatd"], "did you mean"),
    ],
)
def test_a_wrong_sensor_is_told(run: Run, arguments: list[str], message: str) -> None:
    result = run("sensor", *arguments)
    assert result.code == 2
    assert message in result.err


def test_a_sensor_records_what_it_sees_and_a_recording_can_be_sent_again(run: Run, tmp_path: Path) -> None:
    """The one test here whose frames are rendered, and searched for the target."""
    sensor = ("sensor", "--unit", 1, "--sensor")
    made = run(*sensor, "synthetic", "--speed", 10, "--seconds", 0.5, "--record", tmp_path / "r", "--json")
    assert made.json["frames"] == 15
    played = run(*sensor, f"replay:{tmp_path / 'r'}", "--json")
    # the frame that ended it is in the recording too
    assert played.json["frames"] == made.json["frames"] + 1
    assert played.json["sightings"] > 10
    assert "(simulated, recorded at 20" in played.err
