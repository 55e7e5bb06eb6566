"""Stops sessions on the firmware emulator by signals and measures when the devices are silent.

    python tests/benchmarks/bench_stops.py [STOPS]

A process runs sessions of 8 s bursts in real time. In turn SIGTERM, SIGHUP, SIGQUIT and a second SIGINT are
sent to it at random moments, while nothing else goes on and while its main thread is held up: by presses, by
a flood of presses, by a disk whose fsync takes 2 s, by a device call that takes 2 s, and by a listener that
computes for 2 s. Prints for each the median and the worst time in ms from the signal until the devices report
that they are silent, and how many sessions were then logged as aborted. Exits with 1 if a stop took longer
than 50 ms or a log lacks its end.
"""

import contextlib
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from threading import Event
from typing import Any

from autd_trials.array.autd3_backend import Autd3Backend
from autd_trials.array.link import EmulatorLink
from autd_trials.array.phased_array import PhasedArray
from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError, TrialsError
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import Plan, PlannedBlock, make_plan
from autd_trials.protocol.schema import Protocol
from autd_trials.records.log import EventLog, read_log
from autd_trials.responses.responder import Presentation, Press, ResponderInfo
from autd_trials.rig.load import load_rig
from autd_trials.session import events
from autd_trials.session.devices import Devices
from autd_trials.session.events import ConfirmedBy, SessionEnd, SessionStart
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Decision
from autd_trials.session.recorder import Recorder
from autd_trials.session.runner import SessionRunner
from autd_trials.stimulus import Limits

LONGEST_STOP_S = 0.050
_HELD_UP_S = 2.0
_PRESSES_HZ = {"presses": 45.0, "press flood": 4000.0}
_CASES = ("idle", "presses", "press flood", "slow disk", "slow device call", "slow listener")
_SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGINT)


@dataclass
class Presser:
    """A responder that sends presses all the time."""

    rate_hz: float
    sent: int = 0
    since_s: float = 0.0

    def open(self) -> ResponderInfo:
        self.sent, self.since_s = 0, time.monotonic()
        return ResponderInfo(kind="presser", device="benchmark", time_uncertainty_s=0.0)

    def present(self, presentation: Presentation) -> None:
        """Nothing."""

    def read(self, until_s: float) -> list[Press]:
        if self.rate_hz < 1000:
            time.sleep(max(0.0, until_s - time.monotonic()))
        now_s = time.monotonic()
        due = int(self.rate_hz * (now_s - self.since_s)) - self.sent
        self.sent += due
        return [Press(now_s, "B1")] * due

    def close(self) -> None:
        """Nothing."""


class GoesOn:
    """An operator that goes on after every pause."""

    confirmed_by: ConfirmedBy = "unattended"

    def read_out(self, instructions: str) -> None:
        """Nobody reads."""

    def confirm_block(self, block: PlannedBlock) -> None:
        """Nobody wears anything."""

    def confirm_known(self, summary: str) -> None:
        """Nobody knows."""

    def confirm_resume(self, summary: str) -> None:
        """Go on."""

    def decide_after_pause(self, reason: str) -> Decision:
        return Decision(go_on=True)


class SlowDisk:
    """Makes fsync slow from a trial's start on, until the array was halted."""

    def __init__(self) -> None:
        self.slow = False
        self._fsync = os.fsync
        setattr(os, "fsync", self.fsync)  # noqa: B010 - of a narrower type

    def fsync(self, descriptor: Any) -> None:
        if self.slow:
            time.sleep(_HELD_UP_S)
        self._fsync(descriptor)


@dataclass
class Halted:
    """Halts the array and keeps when its devices had reported that they are silent."""

    array: PhasedArray
    backend: Autd3Backend
    disk: SlowDisk | None
    silent_s: float = 0.0
    known: Event = field(default_factory=Event)

    def __call__(self) -> None:
        self.array.halt()
        with contextlib.suppress(RuntimeError):  # it is just being opened again
            assert self.backend.states().silent
        self.silent_s = time.monotonic()
        self.known.set()
        if self.disk is not None:
            self.disk.slow = False  # the benchmark has seen enough


def serve(case: str, sessions: int, folder: Path) -> None:
    """Run sessions that are stopped; print a line when one emits, and one when it is silent."""
    sys.setswitchinterval(0.0005)  # as a session has it
    disk = SlowDisk() if case == "slow disk" else None
    protocol = load_protocol(_protocol(folder))
    units = load_rig("emulated", datetime.now(UTC)).calibration.unit_poses()
    for number in range(sessions):
        plan = make_plan(protocol, place=1, session=1, seed=number)
        _run(case, protocol, plan, units, folder / str(number), disk)


def _run(
    case: str, protocol: Protocol, plan: Plan, units: list[Any], path: Path, disk: SlowDisk | None
) -> None:
    clock, interrupts = RealClock(), Interrupts()
    backend = Autd3Backend(EmulatorLink(), clock)
    limits = Limits(largest_drive=1, longest_burst_s=16, largest_duty=1, session_exposure_s=36_000)
    array = PhasedArray(units, backend, limits, clock, speed_of_sound_m_s=343.2)
    devices = Devices(array, None, Presser(_PRESSES_HZ.get(case, 0.0)))
    halted = Halted(array, backend, disk)
    interrupts.on_abort = halted
    with interrupts.on_signals(in_a_thread=True), EventLog.create(path) as log:
        described = _open(devices)
        if case == "slow device call":
            _slow_down(array)
        recorder = Recorder(log, clock, listeners=[_listener(case, disk)])
        _record_start(recorder, protocol, plan, described)
        try:
            runner = SessionRunner(
                protocol,
                plan,
                devices=devices,
                operator=GoesOn(),
                clock=clock,
                interrupts=interrupts,
                recorder=recorder,
            )
            runner.run()
        except TrialsError as error:
            halted.known.wait()
            print(f"ended {halted.silent_s} {error.exit_code}", flush=True)
        finally:
            devices.close()


def _open(devices: Devices) -> events.DeviceDescriptions:
    """Open the devices; on a busy computer the emulator may take longer than it is waited for."""
    while True:
        with contextlib.suppress(DeviceError):
            return devices.open()


def _listener(case: str, disk: SlowDisk | None) -> Callable[[events.Event], None]:
    def listen(event: events.Event) -> None:
        if event.event == "trial-start" and disk is not None:
            disk.slow = True  # the line that follows the start command waits for it, in mid-burst
            print("emits", flush=True)
            return
        if (event.event == "stimulus" and disk is None) or (case == "press flood" and event.event == "pause"):
            print("emits", flush=True)
            end_s = time.monotonic() + _HELD_UP_S
            while case == "slow listener" and time.monotonic() < end_s:
                pass

    return listen


def _slow_down(array: PhasedArray) -> None:
    look = array.watch

    def slow_look() -> None:
        look()
        time.sleep(_HELD_UP_S)

    array.watch = slow_look  # type: ignore[method-assign]


def _record_start(recorder: Recorder, protocol: Protocol, plan: Plan, described: Any) -> None:
    recorder.record(
        SessionStart,
        participant="01",
        session="01",
        simulated=False,
        virtual_time=False,
        protocol=protocol,
        protocol_sha256="0" * 64,
        plan=plan,
        rig={},
        calibration={},
        calibration_sha256="0" * 64,
        devices=described,
        versions={},
        git_commit=None,
    )


def _protocol(folder: Path) -> Path:
    import yaml

    data = yaml.safe_load(find_protocol("chest").read_text(encoding="utf-8"))
    data |= {"name": "stops", "comparisons": [], "masking": None, "repetitions": 3}
    data["factors"] = {"within_block": {}, "between_blocks": {}}
    data["stimulus"]["duration_s"] = 8.0
    data["timing"] = {"lead_in_s": 0.1, "response_window_s": 8.0, "pause_min_s": 0.1, "pause_max_s": 0.1}
    data["safety"] = {"longest_burst_s": 8, "largest_duty": 1.0, "session_exposure_s": 1000}
    path = folder / "stops.yaml"
    path.write_text(yaml.safe_dump({k: v for k, v in data.items() if v is not None}), encoding="utf-8")
    return path


def measure(case: str, stops: int, folder: Path, chance: random.Random) -> list[float]:
    """Return the times in s from a signal until the devices were silent."""
    arguments = [sys.executable, __file__, "--serve", case, str(stops), str(folder)]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    times_s = []
    for number in range(stops):
        while process.stdout.readline() != "emits\n":
            assert process.poll() is None
        time.sleep(chance.uniform(0.3, 1.3))
        stop = _SIGNALS[number % len(_SIGNALS)]
        if stop == signal.SIGINT:
            process.send_signal(stop)
            time.sleep(0.05)
        sent_s = time.monotonic()
        process.send_signal(stop)
        while not (line := process.stdout.readline()).startswith("ended"):
            assert line
        times_s.append(float(line.split()[1]) - sent_s)
    process.wait()
    return times_s


def logged(folder: Path, stops: int) -> int:
    """Return how many sessions have an end that says that they were aborted."""
    ends = [read_log(folder / str(number)).events[-1] for number in range(stops)]
    return sum(isinstance(end, SessionEnd) and end.status == "aborted" for end in ends)


def main(stops: int) -> bool:
    """Measure all cases; return whether all were in time and logged."""
    chance, good, results = random.Random(1), True, {}
    print(f"{'case':<18}{'stops':>6}{'median ms':>11}{'worst ms':>10}{'aborted in the log':>20}")
    for case in _CASES:
        with tempfile.TemporaryDirectory() as folder:
            times_s = measure(case, stops, Path(folder), chance)
            aborted = logged(Path(folder), stops)
        median_ms, worst_ms = 1e3 * statistics.median(times_s), 1e3 * max(times_s)
        results[case] = {"median_ms": round(median_ms, 2), "worst_ms": round(worst_ms, 2)}
        print(f"{case:<18}{stops:>6}{median_ms:>11.1f}{worst_ms:>10.1f}{aborted:>20}", flush=True)
        good &= max(times_s) <= LONGEST_STOP_S and aborted == stops
    print(json.dumps(results))
    return good


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]))
    else:
        sys.exit(not main(int(sys.argv[1]) if len(sys.argv) > 1 else 50))
