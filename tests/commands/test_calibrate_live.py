"""The whole way: sensor processes, recording, calibration, a session; Ctrl-C and kill on the way."""

import json
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from autd_trials.acoustics.air import Air
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.pose_error import energy_left
from autd_trials.yamlfile.shipped import find_file
from tests.calibration.network.test_nodes import AUTD_TRIALS
from tests.commands.conftest import Run
from tests.lsl import keep_to_ourselves

keep_to_ourselves()

TRUTH = find_file("emulated-calibration", kind="calibration", folder="rigs")
B_MM = (302.0, 225.0, 1000.0)

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start() -> Iterator[Start]:
    """Return what starts a command in a process of its own."""
    processes = []

    def call(*arguments: object) -> "subprocess.Popen[str]":
        command = [*AUTD_TRIALS, *map(str, arguments)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield call
    for process in processes:
        process.kill()
        process.communicate()


def start_sensors(start: Start, speed: float) -> None:
    for unit in (1, 2):
        start("sensor", "--unit", unit, "--sensor", "synthetic", "--speed", speed)


def wait_for_lines(path: Path, lines: int) -> None:
    deadline = time.monotonic() + 30
    while not path.exists() or path.read_bytes().count(b"\n") < lines:
        assert time.monotonic() < deadline, f"{path} did not fill"
        time.sleep(0.05)


@pytest.mark.slow
def test_a_study_runs_with_what_two_sensor_nodes_calibrated(start: Start, run: Run, tmp_path: Path) -> None:
    start_sensors(start, speed=6)
    out = tmp_path / "calibration.yaml"
    aim = ("--mounts", "emulated-mounts", "--target=302,225,1000")
    # 30 s at six times real time are three minutes of waving at 0.5 m/s
    live = start("calibrate", "--live", tmp_path / "live", "--seconds", 30, *aim, "--out", out, "--json")
    stdout, stderr = live.communicate(timeout=100)
    assert live.returncode == 0, stderr
    report = json.loads(stdout)
    assert report["points"] > 2500  # of 5400; a busy machine sees fewer frames
    energy = report["predicted_energy"]
    found, truth = (load_calibration(path)[0].unit_poses() for path in (out, TRUTH))
    left = energy_left(truth, found, B_MM, Air())
    # the sensors are timed by this machine, so that the figures vary from run to run and with its load
    assert 0.95 < left <= 1
    assert abs(left - energy["mean"]) < 0.03
    assert energy["low"] < energy["mean"]
    assert (tmp_path / "calibration.png").exists()

    rig = yaml.safe_load(TRUTH.with_name("emulated.yaml").read_text())
    rig["calibration"] = {
        "file": str(out),
        "true_file": str(TRUTH),
        "least_energy_left": 0.9,
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
    start: Start, run: Run, tmp_path: Path
) -> None:
    start_sensors(start, speed=3)
    first = tmp_path / "first"
    live = start("calibrate", "--live", first, "--out", tmp_path / "first.yaml")
    wait_for_lines(first / "unit2-raw.csv", 900)
    live.send_signal(signal.SIGINT)
    _, stderr = live.communicate(timeout=60)
    assert live.returncode == 0, stderr
    assert (tmp_path / "first.yaml").exists()

    second = tmp_path / "second"
    live = start("calibrate", "--live", second, "--out", tmp_path / "second.yaml")
    wait_for_lines(second / "unit2-raw.csv", 900)
    live.kill()
    live.communicate()
    assert not (tmp_path / "second.yaml").exists()
    again = run("calibrate", "--recorded", second, "--out", tmp_path / "second.yaml", "--json")
    assert again.code == 0
    assert again.json["points"] > 700
    refused = run("calibrate", "--live", second, "--out", tmp_path / "third.yaml", "--seconds", 1)
    assert refused.code == 2
    assert "exists already" in refused.err


@pytest.mark.slow
def test_recording_too_little_keeps_it_and_says_what_is_missing(start: Start, tmp_path: Path) -> None:
    start_sensors(start, speed=1)
    live = start("calibrate", "--live", tmp_path / "r", "--seconds", 0.2, "--out", tmp_path / "c.yaml")
    _, stderr = live.communicate(timeout=60)
    assert live.returncode == 2
    assert "Traceback" not in stderr
    assert "saw the target" in stderr
    assert (tmp_path / "r" / "unit1-raw.csv").exists()


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
    sensor = ("sensor", "--unit", 1, "--sensor")
    made = run(*sensor, "synthetic", "--speed", 10, "--seconds", 0.5, "--record", tmp_path / "r", "--json")
    assert made.json["frames"] == 15
    played = run(*sensor, f"replay:{tmp_path / 'r'}", "--json")
    # the frame that ended it is in the recording too
    assert played.json["frames"] == made.json["frames"] + 1
    assert played.json["sightings"] > 10
