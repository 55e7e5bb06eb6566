"""Short studies, and the programs as a person would start them."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import yaml

from autd_trials.cli import main
from autd_trials.protocol.load import find_protocol
from autd_trials.yamlfile.shipped import find_file
from tests.masking.conftest import sound_server  # noqa: F401 - a fixture of the tests here too

Run = Callable[..., "Result"]
WriteProtocol = Callable[..., Path]
WriteRig = Callable[..., Path]

RUN_PROTOCOL = [
    sys.executable,
    "-c",
    "import sys; from autd_trials.cli import run_protocol as r; sys.exit(r())",
]


@dataclass(frozen=True)
class Result:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Return what runs `autd-trials` in this process."""

    def call(*arguments: object) -> Result:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return Result(code, captured.out, captured.err)

    return call


@pytest.fixture
def write_protocol(tmp_path: Path) -> WriteProtocol:
    """Return what writes a protocol of 2 blocks of 3 short trials, as `change` bends it."""

    def write(change: Callable[[dict[str, Any]], object] = lambda _data: None, **updates: Any) -> Path:
        data = yaml.safe_load(find_protocol("chest").read_text(encoding="utf-8"))
        data["name"] = "short"
        data["stimulus"]["duration_s"] = 0.2
        data["repetitions"] = 1
        data["timing"] = {
            "lead_in_s": 0.3,
            "response_window_s": 0.4,
            "pause_min_s": 0.3,
            "pause_max_s": 0.4,
            "break_s": 0,
        }
        data["safety"] = {"longest_burst_s": 1, "largest_duty": 0.5, "session_exposure_s": 10}
        data |= updates
        change(data)
        path = tmp_path / "short.yaml"
        path.write_text(yaml.safe_dump(data), encoding="utf-8")
        return path

    return write


@pytest.fixture
def write_rig(tmp_path: Path) -> WriteRig:
    """Return what writes the emulated rig with its calibration, as `change` bends them."""

    def write(change: Callable[[dict[str, Any], dict[str, Any]], object] = lambda _rig, _cal: None) -> Path:
        shipped = find_file("emulated", kind="rig", folder="rigs")
        rig = yaml.safe_load(shipped.read_text())
        calibration = yaml.safe_load(shipped.with_name("emulated-calibration.yaml").read_text())
        rig["calibration"]["file"] = "calibration.yaml"
        change(rig, calibration)
        (tmp_path / "calibration.yaml").write_text(yaml.safe_dump(calibration))
        path = tmp_path / "rig.yaml"
        path.write_text(yaml.safe_dump(rig))
        return path

    return write


def make_real(rig: dict[str, Any], calibration: dict[str, Any]) -> None:
    """Make the emulated rig a real one behind an interface that is not there, measured just now."""
    rig["array"]["link"] = {"interface": "nosuchnic0"}
    rig["array"]["limits"]["largest_ear_level_db"] = 100
    calibration |= {"made_up": False, "origin": "measured", "taken": datetime.now(UTC).isoformat()}


def start(*arguments: object) -> "subprocess.Popen[str]":
    """Start `run-protocol` as a process of its own."""
    return subprocess.Popen(
        [*RUN_PROTOCOL, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def events(data: Path) -> list[dict[str, Any]]:
    """The events of the only session in a data folder."""
    (log,) = data.glob("*/sourcedata/sub-*/ses-*/*_log.jsonl")
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]


def of(kind: str, data: Path) -> list[dict[str, Any]]:
    """The events of one kind."""
    return [event for event in events(data) if event["event"] == kind]
