"""A sound card for tests: a private PulseAudio server with a null sink, and a recorder of what it got."""

import os
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import pytest
from numpy.typing import NDArray

from autd_trials.masking.devices import list_devices

RATE_HZ = 48_000


class SoundServer:
    """PulseAudio with one null sink that keeps samples as they are (float, 48 kHz, stereo)."""

    def __init__(self, folder: Path) -> None:
        self.address = f"unix:{folder}/native"
        runtime = folder / "run"
        runtime.mkdir(mode=0o700)
        self._process = subprocess.Popen(
            [
                *("pulseaudio", "-n", "--daemonize=no", "--exit-idle-time=-1", "--disable-shm=yes"),
                *("-L", f"module-native-protocol-unix auth-anonymous=1 socket={folder}/native"),
                *("-L", f"module-null-sink sink_name=bench rate={RATE_HZ} format=float32le norewinds=1"),
            ],
            env={**os.environ, "HOME": str(folder), "XDG_RUNTIME_DIR": str(runtime)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        wait_until(lambda: self._pactl("info") is not None, "PulseAudio answers")

    def _pactl(self, *words: str) -> str | None:
        answer = subprocess.run(
            ["pactl", "--server", self.address, *words], capture_output=True, text=True, check=False
        )
        return answer.stdout if answer.returncode == 0 else None

    def tell(self, *words: str) -> None:
        """Have `pactl` do something."""
        assert self._pactl(*words) is not None, words

    def stream(self) -> str:
        """Return the index of the only stream that plays."""
        (index,) = re.findall(r"Sink Input #(\d+)", self._pactl("list", "sink-inputs") or "")
        return str(index)

    def suspend_sink(self) -> None:
        """Let the sound card take no more sound."""
        assert self._pactl("suspend-sink", "bench", "1") is not None

    def players(self) -> list[int]:
        """Return the ids of the processes that play into the sink."""
        inputs = self._pactl("list", "sink-inputs") or ""
        return [int(process) for process in re.findall(r'application.process.id = "(\d+)"', inputs)]

    def kill(self) -> None:
        """End the server without a word."""
        self._process.kill()
        self._process.wait()


class Recorder:
    """Record what the sink gets, with the time at which each piece came (host's monotonic clock)."""

    def __init__(self, server: SoundServer) -> None:
        self._process = subprocess.Popen(
            [
                *("parec", "--server", server.address, "--device=bench.monitor", "--raw"),
                *("--format=float32le", f"--rate={RATE_HZ}", "--channels=2", "--latency-msec=10"),
            ],
            stdout=subprocess.PIPE,
        )
        self._pieces: list[tuple[float, bytes]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)

    def __enter__(self) -> Self:
        self._reader.start()
        wait_until(lambda: bool(self._pieces), "the recorder records")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait()
        self._reader.join()
        if self._process.stdout:
            self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout
        while piece := os.read(self._process.stdout.fileno(), 1 << 16):
            self._pieces.append((time.monotonic(), piece))

    @property
    def stereo(self) -> NDArray[np.float32]:
        """All that was recorded so far, shape (n, 2)."""
        recorded = b"".join(piece for _, piece in self._pieces)
        return np.frombuffer(recorded[: len(recorded) // 8 * 8], dtype=np.float32).reshape(-1, 2)

    @property
    def sounding(self) -> NDArray[np.float32]:
        """The left channel from the first sample that is not 0 to the last."""
        left = self.stereo[:, 0]
        played = np.flatnonzero(left)
        return left[played[0] : played[-1] + 1] if len(played) else left[:0]

    @property
    def last_sound_s(self) -> float:
        """When the last piece that is not silent came."""
        return max(time_s for time_s, piece in self._pieces if any(piece))


def wait_until(condition: Callable[[], bool], what: str, deadline_s: float = 10.0) -> None:
    end_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < end_s, f"waited in vain until {what}"
        time.sleep(0.02)


def why_no_sound() -> str | None:
    """Return what is missing for playing into a sound server, None if nothing is."""
    missing = [program for program in ("pulseaudio", "pactl", "parec") if shutil.which(program) is None]
    if missing:
        return f"{', '.join(missing)} missing (apt: pulseaudio pulseaudio-utils)"
    return list_devices().problem


@pytest.fixture
def sound_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SoundServer]:
    """A private sound server; whatever plays on the default output plays into it."""
    why = why_no_sound()
    if why:
        pytest.skip(why)
    server = SoundServer(tmp_path)
    monkeypatch.setenv("PULSE_SERVER", server.address)
    monkeypatch.setenv("PULSE_COOKIE", str(tmp_path / "cookie"))
    yield server
    server.kill()


@pytest.fixture
def recorder(sound_server: SoundServer) -> Iterator[Recorder]:
    """What the sound server's sink gets."""
    with Recorder(sound_server) as recording:
        yield recording
