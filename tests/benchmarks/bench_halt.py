"""Measures stops on the firmware emulator, idle and with all cores busy: `halt`, and lost devices.

Run ``python tests/benchmarks/bench_halt.py [HALTS]``; about 2 minutes for 50 halts of each. One thread runs
bursts one after the other (half of the time it is sending, half of the time it waits for a burst to end),
another halts the array at a random moment. The time runs from the call of `halt` until the devices have
reported that they are silent, and contains that reading. For a loss, the emulator is killed while a burst of
8 s runs. Exit code 1 if a halt takes longer than 50 ms, or a loss on an idle computer goes unnoticed for
0.3 s.
"""

import os
import random
import statistics
import sys
import threading
import time
from contextlib import suppress

from autd_trials.array.autd3_backend import Autd3Backend
from autd_trials.array.emulator import Emulator
from autd_trials.array.link import EmulatorLink
from autd_trials.array.phased_array import PhasedArray
from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError, StoppedByPerson
from autd_trials.stimulus import Limits
from tests.benchmarks.bench_array_timing import BURST, busy_cores, emulated_units

LONGEST_S, LONGEST_UNNOTICED_S = 0.05, 0.3
LOSSES = 10


def main() -> None:
    """Print two rows for each load."""
    halts = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    print(f"18 emulated devices; times in ms of {halts} halts and {LOSSES} losses each")
    print(f"{'':<34}{'busy':>5}{'median':>8}{'worst':>8}{'limit':>7}")
    kept = []
    for busy in (0, os.cpu_count() or 1):
        kept.append(report("halt: until silence was read back", busy, measure_halts(halts, busy), LONGEST_S))
        kept.append(report("loss: until it was noticed", busy, measure_losses(busy), LONGEST_UNNOTICED_S))
    sys.exit(0 if all(kept) else 1)


def report(what: str, busy: int, times_s: list[float], limit_s: float) -> bool:
    """Print a row; return whether the limit was kept, which is asked of an idle computer only for losses."""
    median_s, worst_s = statistics.median(times_s), max(times_s)
    print(f"{what:<34}{busy:>5}{1000 * median_s:>8.1f}{1000 * worst_s:>8.1f}{1000 * limit_s:>7.0f}")
    return worst_s <= limit_s or (limit_s == LONGEST_UNNOTICED_S and busy > 0)


def new_array(link: EmulatorLink) -> tuple[PhasedArray, Autd3Backend]:
    """Return an open array of 18 emulated devices."""
    backend = Autd3Backend(link, RealClock())
    limits = Limits(
        largest_drive=1.0,
        longest_burst_s=16.0,
        largest_duty=1.0,
        session_exposure_s=36_000.0,
        daily_exposure_s=36_000.0,
    )
    array = PhasedArray(emulated_units(), backend, limits, RealClock(), speed_of_sound_m_s=343.2)
    array.open()
    return array, backend


def measure_halts(halts: int, busy: int) -> list[float]:
    """Halt so often while so many cores are kept busy; return the times in s."""
    moments = random.Random(1)
    array, backend = new_array(EmulatorLink())
    try:
        with busy_cores(busy, seconds=10 + 2 * halts):
            return [halt_once(array, backend, moments.uniform(0.0, 0.4)) for _ in range(halts)]
    finally:
        array.close()


def measure_losses(busy: int) -> list[float]:
    """Kill the emulator in mid-burst, again and again; return how long it went unnoticed in s."""
    with busy_cores(busy, seconds=10 * LOSSES):
        return [lose_once(0.3 + 0.01 * number) for number in range(LOSSES)]


def lose_once(moment_s: float) -> float:
    """Lose all devices so long after an onset; return after how long that was noticed, in s."""
    clock = RealClock()
    with Emulator(18) as emulator:
        array, _ = new_array(EmulatorLink(emulator.address))
        try:
            array.arm(BURST.model_copy(update={"duration_s": 8.0}))
            killed_s = array.start(clock.now_s()).onset_s + moment_s
            watch_until(array, killed_s)
            emulator.kill()
            watch_until(array, killed_s + 5.0)
        except DeviceError:
            return clock.now_s() - killed_s
        finally:
            array.close()
    raise SystemExit("a loss was not noticed")


def watch_until(array: PhasedArray, time_s: float) -> None:
    """Watch the devices as a session does."""
    while time.monotonic() < time_s:
        array.watch()
        time.sleep(0.01)


def halt_once(array: PhasedArray, backend: Autd3Backend, moment_s: float) -> float:
    """Halt a thread that runs bursts at a moment after its start; return how long it took in s."""
    backend.halted.clear()
    user = threading.Thread(target=run_bursts, args=(array,))
    user.start()
    time.sleep(moment_s)
    before_s = time.monotonic()
    array.halt()
    taken_s = time.monotonic() - before_s
    user.join()
    array.abort()
    if not backend.states().silent:
        raise SystemExit("the array was not silent after a halt")
    return taken_s


def run_bursts(array: PhasedArray) -> None:
    """Run bursts until the array is halted."""
    with suppress(StoppedByPerson):
        while True:
            array.arm(BURST)
            array.start(time.monotonic())
            array.finish()


if __name__ == "__main__":
    main()
