"""Nodes and master over Lab Streaming Layer, with real processes: found, silent, restarted, far away."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from autd_trials.calibration.network.inlets import Nodes
from autd_trials.calibration.network.outlet import SightingOutlet
from autd_trials.calibration.network.recording import Sample
from autd_trials.calibration.network.stream import NodeHeader
from autd_trials.calibration.sensors.synthetic import KINECT_V2
from autd_trials.errors import DeviceError

AUTD_TRIALS = [sys.executable, "-c", "import sys; from autd_trials.cli import main; sys.exit(main())"]
TIMEOUT_S = 20.0

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start_sensor() -> Iterator[Start]:
    """Return what starts `autd-trials sensor` with the synthetic sensor, perhaps by way of other programs."""
    processes = []

    def start(unit: int, *more: str, by: list[str] | None = None) -> "subprocess.Popen[str]":
        command = [*(by or []), *AUTD_TRIALS, "sensor", "--unit", str(unit), "--sensor", "synthetic", *more]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def take_until(nodes: Nodes, enough: Callable[[], bool], wait_s: float = TIMEOUT_S) -> list[list[Sample]]:
    """Take until something has come about; return each unit's samples."""
    taken: list[list[Sample]] = [[] for _ in nodes.states]
    deadline = time.monotonic() + wait_s
    while not enough():
        assert time.monotonic() < deadline, nodes.states
        for samples, (new, _) in zip(taken, nodes.take(), strict=True):
            samples += new
        time.sleep(0.02)
    return taken


def test_both_units_are_found_and_what_they_see_comes_in_order(start_sensor: Start) -> None:
    for unit in (1, 2):
        start_sensor(unit)
    with Nodes(2, TIMEOUT_S) as nodes:
        taken = take_until(nodes, lambda: min(state.samples for state in nodes.states) > 30)
        for unit, (state, samples) in enumerate(zip(nodes.states, taken, strict=True), start=1):
            assert state.header.unit == unit
            assert state.header.serial == "synthetic"
            assert state.header.intrinsics == KINECT_V2
            assert state.lost == 0
            assert state.sightings > 0.8 * state.samples
            assert [s.sequence for s in samples] == list(range(samples[0].sequence, samples[-1].sequence + 1))
            assert {s.run for s in samples} == {state.header.run}
            assert abs(samples[-1].arrival_s - samples[-1].t_raw_s) < 1.0


def test_a_node_that_is_killed_is_silent_and_comes_back_as_another_run(start_sensor: Start) -> None:
    first = start_sensor(1)
    with Nodes(1, TIMEOUT_S) as nodes:
        (state,) = nodes.states
        take_until(nodes, lambda: state.samples > 10)
        first.send_signal(signal.SIGKILL)
        take_until(nodes, lambda: state.silent_since_s is not None)
        assert state.silences == 1
        start_sensor(1)
        take_until(nodes, lambda: state.restarts == 1)
        take_until(nodes, lambda: state.silent_since_s is None)


def test_a_node_ends_when_told_to(start_sensor: Start) -> None:
    process = start_sensor(1, "--json")
    assert process.stderr is not None
    while "sends as run" not in process.stderr.readline():
        pass
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0
    assert '"unit": 1' in out
    assert "Traceback" not in err


def test_a_missing_unit_is_named(start_sensor: Start) -> None:
    start_sensor(2)
    with pytest.raises(DeviceError, match=r"no sensor node of unit 1, 3 was found within 3 s; found: \[2\]"):
        Nodes(3, 3.0)


def test_two_nodes_of_one_unit_are_refused() -> None:
    headers = [NodeHeader(1, run, f"camera {run}", KINECT_V2) for run in (1, 2)]
    refused = pytest.raises(DeviceError, match="two nodes say that they watch unit 1")
    with SightingOutlet(headers[0], 30), SightingOutlet(headers[1], 30), refused:
        Nodes(1, 5.0)


def run_as_root(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"{' '.join(command)}: {done.stderr.strip()}")


@pytest.fixture
def two_networks() -> Iterator[tuple[str, str]]:
    """Two network namespaces with a cable between them."""
    if os.geteuid() != 0 or shutil.which("ip") is None or shutil.which("unshare") is None:
        pytest.skip("network namespaces need root, ip (Debian's iproute2) and unshare")
    names = (f"autd-a{os.getpid()}", f"autd-b{os.getpid()}")
    cable = (f"va{os.getpid()}", f"vb{os.getpid()}")
    run_as_root("unshare", "--time", "--monotonic", "1000", "true")
    try:
        for name in names:
            run_as_root("ip", "netns", "add", name)
        peer = ("type", "veth", "peer", "name", cable[1], "netns", names[1])
        run_as_root("ip", "link", "add", cable[0], "netns", names[0], *peer)
        for number, (name, end) in enumerate(zip(names, cable, strict=True), start=1):
            run_as_root("ip", "-n", name, "addr", "add", f"10.77.0.{number}/24", "dev", end)
            run_as_root("ip", "-n", name, "link", "set", end, "up")
            run_as_root("ip", "-n", name, "link", "set", "lo", "up")
            run_as_root("ip", "-n", name, "route", "add", "224.0.0.0/4", "dev", end)
        yield names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)


MASTER = """
import time
from autd_trials.calibration.network.inlets import Nodes
with Nodes(1, 20.0) as nodes:
    offsets = []
    while len(offsets) < 2:
        ((samples, new),) = nodes.take()
        offsets += [offset for _, offset in new]
        time.sleep(0.05)
    print(*offsets)
"""


@pytest.mark.slow
def test_a_clock_1000_s_ahead_in_another_network_is_found(
    start_sensor: Start, two_networks: tuple[str, str]
) -> None:
    clock_ahead = ["unshare", "--time", "--monotonic", "1000"]
    start_sensor(1, by=["ip", "netns", "exec", two_networks[0], *clock_ahead])
    master = subprocess.run(
        ["ip", "netns", "exec", two_networks[1], sys.executable, "-c", MASTER],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert master.returncode == 0, master.stderr
    assert [float(offset) for offset in master.stdout.split()] == pytest.approx([-1000.0] * 2, abs=2e-3)
