"""How pink the noise is, how soon it starts and ends, and whether a busy machine makes it stumble.

Plays into a private PulseAudio null sink: run it where the sound tests run.
``python tests/benchmarks/bench_masking.py [seconds per case]``
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[2]))

from autd_trials.clock import RealClock
from autd_trials.masking.noise import pink_noise
from autd_trials.masking.player import SoundMasker
from tests.masking.conftest import RATE_HZ, Recorder, SoundServer, why_no_sound


def measure_noise() -> None:
    """Print slope and largest deviation over third-octave bands, 100 Hz to 10 kHz, by Welch's method."""
    begin_s = time.monotonic()
    loop = pink_noise(np.random.default_rng(1), -30.0)
    took_s = time.monotonic() - begin_s
    frequency_hz, density = signal.welch(loop, RATE_HZ, nperseg=2**15)
    centres_hz = 1000 * 10 ** (np.arange(-10, 11) / 10)
    bands = [(frequency_hz >= c * 10**-0.05) & (frequency_hz < c * 10**0.05) for c in centres_hz]
    levels_db = np.array([10 * np.log10(np.mean(density[band])) for band in bands])
    slope_db = np.polyfit(np.log10(centres_hz), levels_db, 1)[0]
    from_ideal_db = levels_db + 10 * np.log10(centres_hz)
    deviation_db = np.max(np.abs(from_ideal_db - np.mean(from_ideal_db)))
    print(f"noise: {slope_db:.2f} dB a decade, within +-{deviation_db:.2f} dB, 60 s made in {took_s:.2f} s")


def measure_player(server: SoundServer, busy: int, seconds: float) -> bool:
    """Print times, underruns and gaps with so many other processes busy; return whether there were none."""
    clock = RealClock()
    masker = SoundMasker("default", -25.0, None, seed=1, clock=clock)
    with _busy_processes(busy), Recorder(server) as recorder:
        times_s = [clock.now_s()]
        masker.open()
        times_s.append(clock.now_s())
        masker.start()
        times_s.append(clock.now_s())
        (player,) = server.players()
        time.sleep(seconds)
        events = masker.events()
        share = _cpu_s(player) / (clock.now_s() - times_s[0])
        times_s.append(clock.now_s())
        masker.close()
        times_s.append(clock.now_s())
    open_s, start_s, _, close_s = np.diff(times_s)
    whole = _steps_agree(recorder)
    print(
        f"{busy} busy: open {open_s:.2f} s, start {start_s:.2f} s, close {close_s:.2f} s, "
        f"{len(events)} underruns in {seconds:g} s, recorded {'without' if whole else 'WITH'} gaps, "
        f"{100 * share:.1f} % of a core"
    )
    return whole and not events


def _steps_agree(recorder: Recorder) -> bool:
    """Whether what was recorded is the loop from its beginning, sample by sample, up to the ramp out."""
    ramp = round(0.05 * RATE_HZ)
    steady = recorder.sounding[ramp:-ramp]
    loop = pink_noise(np.random.default_rng(1), -25.0)
    return bool(np.array_equal(steady, loop.take(ramp + np.arange(len(steady)), mode="wrap")))


def _cpu_s(process: int) -> float:
    user, system = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


@contextmanager
def _busy_processes(count: int) -> Iterator[None]:
    with ExitStack() as stack:
        for _ in range(count):
            process = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(process.kill)
        yield


if __name__ == "__main__":
    measure_noise()
    why = why_no_sound()
    if why:
        print(f"the player was not measured: {why}")
        sys.exit()
    with tempfile.TemporaryDirectory() as folder:
        server = SoundServer(Path(folder))
        os.environ.update(PULSE_SERVER=server.address, PULSE_COOKIE=f"{folder}/cookie")
        duration_s = float(sys.argv[1]) if len(sys.argv) > 1 else 10
        try:
            quiet = [measure_player(server, busy, duration_s) for busy in (0, 2, 4)]
        finally:
            server.kill()
    sys.exit(not all(quiet))
