"""Nodes and master over Lab Streaming Layer: found, silent, restarted, doubled, far away."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from autd_trials.calibration.network.inlets import Nodes
from autd_trials.calibration.network.recording import Sample
from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.sensors.synthetic import KINECT_V2, SyntheticSensor
from autd_trials.errors import DeviceError
from tests.calibration.network.node import Node

AUTD_TRIALS = [sys.executable, "-c", "import sys; from autd_trials.cli import main; sys.exit(main())"]
NODE = [sys.executable, str(Path(__file__).with_name("node.py"))]
TIMEOUT_S = 60.0  # for a machine that is busy with other work

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start() -> Iterator[Start]:
    """Return what starts a program."""
    processes = []

    def call(*command: object) -> "subprocess.Popen[str]":
        process = subprocess.Popen(
            [str(part) for part in command], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        processes.append(process)
        return process

    yield call
    for process in processes:
        process.kill()
        process.communicate()


def take_until(
    nodes: Nodes, enough: Callable[[], bool], meanwhile: Callable[[], object] = list
) -> list[list[Sample]]:
    """Take until something has come about; return each unit's samples."""
    taken: list[list[Sample]] = [[] for _ in nodes.states]
    deadline = time.monotonic() + TIMEOUT_S
    while not enough():
        assert time.monotonic() < deadline, nodes.states
        meanwhile()
        for samples, (new, _) in zip(taken, nodes.take(), strict=True):
            samples += new
        time.sleep(0.02)
    return taken


def test_both_units_are_found_and_what_they_see_comes_whole_and_in_order() -> None:
    with Node(1, run=7) as first, Node(2, run=8) as second, Nodes(2, TIMEOUT_S) as nodes:
        times_s = [1 + number / 30 for number in range(200)]  # 0 would mean now
        for node in (first, second):
            node.wait_for_listener()
            node.send(times_s)
        taken = take_until(nodes, lambda: min(state.samples for state in nodes.states) == 200)
        for unit, (state, samples) in enumerate(zip(nodes.states, taken, strict=True), start=1):
            assert state.header.unit == unit
            assert state.header.capture == SyntheticSensor.capture
            assert state.header.intrinsics == KINECT_V2
            assert (state.lost, state.sightings, state.restarts) == (0, 0, 0)
            assert [sample.sequence for sample in samples] == list(range(200))
            assert [sample.t_raw_s for sample in samples] == pytest.approx(times_s)
            assert {sample.run for sample in samples} == {unit + 6}


def test_what_a_recording_was_taken_with_and_when_goes_with_the_stream() -> None:
    capture = Capture.model_validate_json(
        '{"origin": "measured", "sensor": "realsense", "serial": "73 <&> é", "taken": "2026-11-20T08:00:00Z"}'
    )
    with Node(1, capture=capture), Nodes(1, TIMEOUT_S) as nodes:
        assert nodes.states[0].header.capture == capture


@pytest.mark.slow
def test_a_node_that_is_killed_is_silent_and_comes_back_as_another_run(start: Start) -> None:
    first = start(*NODE, 1, 1)
    with Nodes(1, TIMEOUT_S) as nodes:
        (state,) = nodes.states
        take_until(nodes, lambda: state.samples > 10)
        first.send_signal(signal.SIGKILL)
        take_until(nodes, lambda: state.silent_since_s is not None)
        silences = state.silences
        assert silences > 0
        start(*NODE, 1, 2)
        samples = take_until(nodes, lambda: state.restarts == 1 and state.silent_since_s is None)[0]
        assert samples[-1].run == 2


@pytest.mark.parametrize("serial", ["synthetic", "another"])
def test_a_second_node_of_a_unit_in_mid_recording_is_refused(serial: str) -> None:
    with Node(1, run=1) as first, Nodes(1, TIMEOUT_S) as nodes, ExitStack() as stack:
        (state,) = nodes.states
        taken = take_until(nodes, lambda: state.samples > 10, first.send_now)[0]
        stack.enter_context(Node(1, run=2, capture=Capture(origin="simulated", sensor="x", serial=serial)))
        with pytest.raises(DeviceError, match=r"two nodes say that they watch unit 1; the second one is on"):
            taken += take_until(nodes, lambda: False, first.send_now)[0]
        assert {sample.run for sample in taken} == {1}


def test_a_node_ends_when_told_to(start: Start) -> None:
    process = start(*AUTD_TRIALS, "sensor", "--unit", "1", "--sensor", "synthetic", "--json")
    assert process.stderr is not None
    while "sends as run" not in process.stderr.readline():
        pass
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0
    assert '"unit": 1' in out
    assert "Traceback" not in err


def test_a_missing_unit_is_named() -> None:
    refused = pytest.raises(
        DeviceError, match=r"no sensor node of unit 1, 3 was found within 1 s; found: \[2\]"
    )
    with Node(2), refused:
        Nodes(3, 1.0)


def test_two_nodes_of_one_unit_are_refused() -> None:
    refused = pytest.raises(DeviceError, match="two nodes say that they watch unit 1")
    with Node(1, run=1), Node(1, run=2), refused:
        Nodes(1, TIMEOUT_S)


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
with Nodes(1, 60.0) as nodes:
    offsets = []
    while len(offsets) < 2:
        ((samples, new),) = nodes.take()
        offsets += [offset for _, offset in new]
        time.sleep(0.05)
    print(*offsets)
"""


@pytest.mark.slow
def test_a_clock_1000_s_ahead_in_another_network_is_found(
    start: Start, two_networks: tuple[str, str]
) -> None:
    clock_ahead = ["unshare", "--time", "--monotonic", "1000"]
    start("ip", "netns", "exec", two_networks[0], *clock_ahead, *NODE, 1, 1)
    master = subprocess.run(
        ["ip", "netns", "exec", two_networks[1], sys.executable, "-c", MASTER],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert master.returncode == 0, master.stderr
    assert [float(offset) for offset in master.stdout.split()] == pytest.approx([-1000.0] * 2, abs=2e-3)
