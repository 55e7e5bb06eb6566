"""Measures the array's timing in real time on the firmware emulator: idle, one core busy, two cores busy.

Run ``python tests/benchmarks/bench_array_timing.py [TRIALS]``; about 40 s for 50 trials of each. The busy
processes end by themselves. Exit code 1 if a limit is not kept.
"""

import statistics
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime

from autd_trials.array.autd3_backend import Autd3Backend
from autd_trials.array.driver import Stimulus
from autd_trials.array.geometry import UnitPose
from autd_trials.array.link import EmulatorLink
from autd_trials.array.phased_array import PhasedArray
from autd_trials.clock import RealClock
from autd_trials.rig.load import load_rig
from autd_trials.stimulus import Limits

SMALLEST_MARGIN_S = 0.010
LARGEST_LATENESS_S = 0.030
BURST = Stimulus(target_mm=(302.0, 225.0, 1000.0), duration_s=0.1, modulation_hz=50.0)
ROW = "{:<8}{:>9}{:>9}{:>16}{:>6}{:>10}{:>6}{:>6}{:>16}{:>16}"
LOOP = "import time\nend = time.monotonic() + {seconds}\nwhile time.monotonic() < end: sum(range(1000))"


@dataclass
class Trial:
    arm_s: float
    start_s: float
    lead_s: float
    lateness_s: float
    margin_s: float
    bracketed: bool


def main() -> None:
    """Print a row for each load."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    print(f"{trials} trials each of a burst of {BURST.duration_s:g} s on 18 emulated devices; times in ms.")
    print(f"margin: from acceptance to onset, at least {1000 * SMALLEST_MARGIN_S:g}; x: times the limit.")
    print(f"late: onset after the planned one, at most {1000 * LARGEST_LATENESS_S:g}; x: share of the limit.")
    print(
        ROW.format(
            "busy", "accepted", "bracket", "margin min/med", "x", "late max", "x", "lead", "arm", "start"
        )
    )
    kept = [report(busy, measure(trials, busy), trials) for busy in (0, 1, 2)]
    sys.exit(0 if all(kept) else 1)


def emulated_units() -> list[UnitPose]:
    """Return the poses of the shipped emulated rig's units."""
    return load_rig("emulated", datetime.now(UTC)).calibration.unit_poses()


def measure(trials: int, busy: int) -> list[Trial]:
    """Run the trials while so many cores are kept busy."""
    units = emulated_units()
    clock = RealClock()
    limits = Limits(largest_drive=1.0, longest_burst_s=2.0, largest_duty=1.0, session_exposure_s=1000.0)
    array = PhasedArray(units, Autd3Backend(EmulatorLink(), clock), limits, clock, speed_of_sound_m_s=343.2)
    array.open()
    try:
        with busy_cores(busy, seconds=5 + trials):
            return [run_trial(array, clock) for _ in range(trials)]
    finally:
        array.close()


def run_trial(array: PhasedArray, clock: RealClock) -> Trial:
    """Run a trial as a session does: arm, and start with the lead that the driver asks for."""
    before_s = clock.now_s()
    array.arm(BURST)
    armed_s = clock.now_s()
    lead_s = array.lead_s
    planned_s = armed_s + lead_s + 0.05
    clock.sleep_until(planned_s - lead_s)
    sent_s = clock.now_s()
    onset = array.start(planned_s)
    started_s = clock.now_s()
    completion = array.finish()
    return Trial(
        armed_s - before_s,
        started_s - sent_s,
        lead_s,
        onset.onset_s - planned_s,
        onset.margin_s,
        completion.silent_s < onset.onset_s < completion.emitting_s < onset.onset_s + BURST.duration_s,
    )


def report(busy: int, done: list[Trial], asked: int) -> bool:
    """Print a row; return whether all limits were kept."""
    margins_s = [trial.margin_s for trial in done]
    lateness_s = max(trial.lateness_s for trial in done)
    accepted = sum(margin_s >= SMALLEST_MARGIN_S for margin_s in margins_s)
    bracketed = sum(trial.bracketed for trial in done)
    row = (
        f"{busy} cores",
        f"{accepted}/{asked}",
        f"{bracketed}/{asked}",
        f"{1000 * min(margins_s):.1f} / {1000 * statistics.median(margins_s):.1f}",
        f"{min(margins_s) / SMALLEST_MARGIN_S:.1f}",
        f"{1000 * lateness_s:.2f}",
        f"{lateness_s / LARGEST_LATENESS_S:.2f}",
        f"{1000 * max(trial.lead_s for trial in done):.0f}",
        spread([trial.arm_s for trial in done]),
        spread([trial.start_s for trial in done]),
    )
    print(ROW.format(*row))
    return accepted == bracketed == asked and lateness_s <= LARGEST_LATENESS_S


def spread(times_s: list[float]) -> str:
    """Return median / largest in ms."""
    return f"{1000 * statistics.median(times_s):.1f} / {1000 * max(times_s):.1f}"


@contextmanager
def busy_cores(count: int, seconds: float) -> Iterator[None]:
    """Keep so many processes computing, for so long at most."""
    command = [sys.executable, "-c", LOOP.format(seconds=seconds)]
    processes = [subprocess.Popen(command) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


if __name__ == "__main__":
    main()
