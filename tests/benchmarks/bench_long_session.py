"""Runs a session of 10,000 trials in virtual time and sees whether a trial gets slower as the session grows.

    python tests/benchmarks/bench_long_session.py [TRIALS]

Prints the processor's time per trial over each tenth of the session, with the log, the fold and the screen
behind it, and the time that the whole log takes to be read and folded. Exits with 1 if the last tenth took
more than 1.3 times as long per trial as the median of the tenths before it.
"""

import io
import statistics
import sys
import tempfile
import time
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

from rich.console import Console

from autd_trials.array.geometry import UnitPose
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.console.screen import Screen
from autd_trials.participants.simulated import SimulatedParticipant
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Factor, Factors, Protocol
from autd_trials.records.log import EventLog, read_log
from autd_trials.rig.load import load_rig
from autd_trials.session.devices import Devices
from autd_trials.session.events import Event, SessionStart, TrialEnd
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Unattended
from autd_trials.session.recorder import Recorder
from autd_trials.session.runner import SessionRunner
from autd_trials.session.standing import standing
from autd_trials.stimulus import Limits

MOST_GROWTH = 1.3
_BLOCKS = 20


def main(trials: int) -> bool:
    """Run, print, and return whether the time per trial stays."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "log.jsonl")
        ended_s = run(protocol_of(trials), path)
        begun_s = time.process_time()
        found = standing(read_log(path).events)
        read_s = time.process_time() - begun_s
        size_mb = path.stat().st_size / 1e6
    assert found.status == "success"
    tenths = [ended_s[i * (len(ended_s) - 1) // 10] for i in range(11)]
    per_trial_ms = [1e4 * (after - before) / len(ended_s) for before, after in pairwise(tenths)]
    print(f"{len(ended_s)} trials in {ended_s[-1] - ended_s[0]:.1f} s; the log has {size_mb:.1f} MB")
    print("ms per trial, by tenths: " + " ".join(f"{ms:.2f}" for ms in per_trial_ms))
    growth = per_trial_ms[-1] / statistics.median(per_trial_ms[:-1])
    print(f"the last tenth takes {growth:.2f} times the median of those before (limit {MOST_GROWTH})")
    print(
        f"reading and folding the whole log: {read_s:.1f} s, {1e3 * read_s / len(ended_s):.2f} ms per trial"
    )
    return growth <= MOST_GROWTH


def protocol_of(trials: int) -> Protocol:
    """Return a protocol of so many short trials in 20 blocks."""
    protocol = load_protocol(find_protocol("chest"))
    blocks = Factors(between_blocks={"round": Factor(levels=tuple(map(float, range(1, _BLOCKS + 1))))})
    safety = protocol.safety.model_copy(update={"session_exposure_s": 36_000.0, "daily_exposure_s": 36_000.0})
    changes = {"factors": blocks, "repetitions": trials // _BLOCKS, "comparisons": (), "masking": None}
    return protocol.model_copy(update={**changes, "safety": safety})


def run(protocol: Protocol, path: Path) -> list[float]:
    """Run a session with its log at a path; return when each trial ended, in s of the processor's time."""
    clock = VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))
    plan = make_plan(protocol, place=1, session=1, seed=1)
    limits = Limits(
        largest_drive=1.0,
        longest_burst_s=2.0,
        largest_duty=1.0,
        session_exposure_s=36_000.0,
        daily_exposure_s=36_000.0,
    )
    units: list[UnitPose] = load_rig("emulated", datetime.now(UTC)).calibration.unit_poses()
    array = PhasedArray(units, VirtualBackend(clock), limits, clock, speed_of_sound_m_s=343.2)
    participant = SimulatedParticipant(clock, seed=1, place=1, session=1)
    devices = Devices(array, None, participant)
    screen = Screen(Console(file=io.StringIO()), clock, unblind=False, footer="")
    ended_s: list[float] = []

    def look_at_the_time(event: Event) -> None:
        if isinstance(event, TrialEnd):
            ended_s.append(time.process_time())

    with EventLog.create(path, durable=False) as log:
        described = devices.open()
        recorder = Recorder(log, clock, listeners=[screen, look_at_the_time])
        recorder.record(
            SessionStart,
            participant="01",
            session="01",
            simulated=True,
            virtual_time=True,
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
        runner = SessionRunner(
            protocol,
            plan,
            devices=devices,
            operator=Unattended(),
            clock=clock,
            interrupts=Interrupts(),
            recorder=recorder,
        )
        runner.run()
        devices.close()
    return ended_s


if __name__ == "__main__":
    sys.exit(not main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000))
