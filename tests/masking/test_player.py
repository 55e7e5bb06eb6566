"""What arrives at the sound card is the noise that was asked for, and it never outlives its runner."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError, UnsafeError, UsageError
from autd_trials.masking.masker import MaskerEvent
from autd_trials.masking.noise import pink_noise
from autd_trials.masking.player import SoundMasker
from tests.masking.conftest import RATE_HZ, Recorder, SoundServer, wait_until

LEVEL_DBFS = -25.0
LOOP_S = 2.0
RAMP = round(0.05 * RATE_HZ)


def _masker(
    device: str | int = "default", level_dbfs: float = LEVEL_DBFS, rate_hz: int = RATE_HZ
) -> SoundMasker:
    clock = RealClock()
    return SoundMasker(device, level_dbfs, None, seed=7, clock=clock, sample_rate_hz=rate_hz, loop_s=LOOP_S)


@pytest.fixture
def masker(sound_server: SoundServer) -> Iterator[SoundMasker]:
    masker = _masker()
    yield masker
    masker.close()


def _until(masker: SoundMasker, kind: str, deadline_s: float = 3.0) -> MaskerEvent:
    found: list[MaskerEvent] = []

    def seen() -> bool:
        found.extend(event for event in masker.events() if event.kind == kind)
        return bool(found)

    wait_until(seen, f"an event {kind!r} comes", deadline_s)
    return found[0]


@pytest.mark.audio
@pytest.mark.slow
def test_what_is_recorded_is_the_noise_at_its_level_without_gap_or_seam(
    masker: SoundMasker, recorder: Recorder
) -> None:
    masker.open()
    masker.start()
    time.sleep(2 * LOOP_S + 0.5)  # the seam comes twice
    assert masker.events() == []
    masker.close()

    recorded = recorder.sounding
    loop = pink_noise(np.random.default_rng(7), LEVEL_DBFS, length_s=LOOP_S)
    sent = np.tile(loop, 4)[: len(recorded)]
    rise = (1 - np.cos(np.pi * (np.arange(RAMP) + 0.5) / RAMP)) / 2
    sent[:RAMP] *= rise
    sent[-RAMP:] *= rise[::-1]
    assert len(recorded) > 2 * len(loop)
    assert np.max(np.abs(recorded - sent)) < 1e-6

    steady = recorded[RAMP:-RAMP]
    period = steady[: len(loop)].astype(np.float64)
    level_dbfs = 10 * np.log10(np.mean(period**2))
    power = np.abs(np.fft.rfft(period)) ** 2
    frequency_hz = np.fft.rfftfreq(len(period), 1 / RATE_HZ)
    band = (frequency_hz >= 100) & (frequency_hz <= 10_000)
    slope_db, _ = np.polyfit(np.log10(frequency_hz[band]), 10 * np.log10(power[band]), 1)
    assert level_dbfs == pytest.approx(LEVEL_DBFS, abs=0.1)
    assert slope_db == pytest.approx(-10, abs=0.1)


@pytest.mark.audio
def test_both_ears_get_the_same_and_both_ends_are_ramped(masker: SoundMasker, recorder: Recorder) -> None:
    masker.open()
    time.sleep(0.3)
    assert not recorder.stereo.any(), "silent until started"
    masker.start()
    time.sleep(0.5)
    masker.close()

    left, right = recorder.stereo.T
    assert np.array_equal(left, right)
    sounding = recorder.sounding
    steady_rms = np.sqrt(np.mean(sounding[2 * RAMP : -2 * RAMP] ** 2))
    for end in (sounding[: RAMP // 10], sounding[: -RAMP // 10 : -1]):
        assert np.sqrt(np.mean(end**2)) < 0.1 * steady_rms


@pytest.mark.audio
def test_sound_is_there_when_start_returns(masker: SoundMasker, recorder: Recorder) -> None:
    masker.open()
    masker.start()
    returned_s = time.monotonic()
    wait_until(lambda: len(recorder.sounding) > RAMP, "the sound arrives")
    assert time.monotonic() - returned_s < 0.2


@pytest.mark.audio
def test_a_halted_player_is_an_underrun_with_its_time(masker: SoundMasker, sound_server: SoundServer) -> None:
    masker.open()
    masker.start()
    (player,) = sound_server.players()
    before_s = time.monotonic()
    os.kill(player, signal.SIGSTOP)
    time.sleep(0.4)
    os.kill(player, signal.SIGCONT)
    assert before_s < _until(masker, "underrun").time_s < time.monotonic()


@pytest.mark.audio
def test_a_player_that_hangs_is_lost_and_closed_in_bounded_time(
    masker: SoundMasker, sound_server: SoundServer
) -> None:
    masker.open()
    masker.start()
    (player,) = sound_server.players()
    os.kill(player, signal.SIGSTOP)
    assert "said nothing" in _until(masker, "lost").detail
    closing_s = time.monotonic()
    masker.close()
    assert time.monotonic() - closing_s < 2.5
    assert sound_server.players() == []


@pytest.mark.audio
@pytest.mark.parametrize("how", ["server killed", "sink suspended", "player killed"])
def test_lost_sound_is_noticed_within_a_second(
    masker: SoundMasker, sound_server: SoundServer, how: str
) -> None:
    masker.open()
    masker.start()
    (player,) = sound_server.players()
    lose: dict[str, Callable[[], None]] = {
        "server killed": sound_server.kill,
        "sink suspended": sound_server.suspend_sink,
        "player killed": lambda: os.kill(player, signal.SIGKILL),
    }
    lost_s = time.monotonic()
    lose[how]()
    assert lost_s < _until(masker, "lost").time_s < lost_s + 1


@pytest.mark.audio
def test_it_plays_again_when_the_server_is_back(
    masker: SoundMasker, sound_server: SoundServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    masker.open()
    masker.start()
    sound_server.kill()
    _until(masker, "lost")
    masker.close()
    with pytest.raises(DeviceError, match="none at all"):
        masker.open()

    folder = tmp_path / "again"
    folder.mkdir()
    again = SoundServer(folder)
    monkeypatch.setenv("PULSE_SERVER", again.address)
    try:
        masker.open()
        masker.start()
        assert len(again.players()) == 1
        masker.close()
    finally:
        again.kill()


RUNNER = """
import os, sys, time
from autd_trials.clock import RealClock
from autd_trials.masking.player import SoundMasker
masker = SoundMasker("default", -25.0, None, seed=7, clock=RealClock(), loop_s=2.0)
masker.open()
masker.start()
if "fork" in sys.argv and os.fork() == 0:
    time.sleep(3)  # holds copies of all pipes
    os._exit(0)
print("playing", flush=True)
time.sleep(60)
"""


@pytest.mark.audio
@pytest.mark.parametrize(
    ("blow", "extra"),
    [(signal.SIGKILL, ""), (signal.SIGKILL, "fork"), (signal.SIGTERM, ""), (signal.SIGINT, "")],
)
def test_sound_ends_within_a_second_of_its_runner(
    sound_server: SoundServer, recorder: Recorder, blow: signal.Signals, extra: str
) -> None:
    runner = subprocess.Popen(
        [sys.executable, "-c", RUNNER, extra], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert runner.stdout
    assert runner.stdout.readline() == "playing\n"
    wait_until(lambda: len(recorder.sounding) > 0, "the sound arrives")
    runner.send_signal(blow)
    blow_s = time.monotonic()
    runner.wait()
    runner.stdout.close()
    time.sleep(1.2)
    assert recorder.last_sound_s < blow_s + 1
    assert sound_server.players() == []
    tail = recorder.sounding[: -RAMP // 10 : -1]
    assert np.max(np.abs(tail)) < 0.1 * np.max(np.abs(recorder.sounding)), "ramped out, not cut off"


@pytest.mark.audio
def test_close_ramps_out_even_if_another_process_holds_the_pipe(
    masker: SoundMasker, sound_server: SoundServer, recorder: Recorder
) -> None:
    masker.open()
    masker.start()
    (player,) = sound_server.players()
    with Path(f"/proc/{player}/fd/0").open("w"):
        masker.close()
    assert sound_server.players() == []
    tail = recorder.sounding[: -RAMP // 10 : -1]
    assert np.max(np.abs(tail)) < 0.1 * np.max(np.abs(recorder.sounding))


@pytest.mark.audio
def test_ctrl_c_in_the_terminal_does_not_reach_the_player(
    masker: SoundMasker, sound_server: SoundServer
) -> None:
    masker.open()
    masker.start()
    (player,) = sound_server.players()
    assert os.getpgid(player) != os.getpgid(0)
    os.kill(player, signal.SIGINT)
    time.sleep(0.3)
    assert masker.events() == []


@pytest.mark.audio
def test_an_unknown_device_is_refused_with_a_list(sound_server: SoundServer) -> None:
    with pytest.raises(DeviceError, match="default") as caught:
        _masker("no such card").open()
    assert "no such card" in str(caught.value)


@pytest.mark.audio
@pytest.mark.slow
def test_a_device_that_takes_no_sound_fails_to_start(sound_server: SoundServer) -> None:
    masker = _masker()
    masker.open()
    sound_server.suspend_sink()
    with pytest.raises(DeviceError, match="took no sound within 5 s"):
        masker.start()
    assert sound_server.players() == []


def test_without_portaudio_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sounddevice.py").write_text("raise OSError('PortAudio library not found')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(DeviceError, match="apt install libportaudio2"):
        _masker().open()


FAKE_SOUNDDEVICE = """
from types import SimpleNamespace
print("a library that chats on standard output")
class PortAudioError(Exception): pass
default = SimpleNamespace(device=(0, 0))
def query_devices(): return [dict(index=0, name="fake card", hostapi=0, max_output_channels=1)]
def query_hostapis(): return [dict(name="ALSA")]
def OutputStream(**settings): raise PortAudioError("Invalid sample rate [PaErrorCode -9997]")
"""


def test_a_device_that_refuses_the_noise_is_named_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sounddevice.py").write_text(FAKE_SOUNDDEVICE)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(DeviceError, match="Invalid sample rate") as caught:
        _masker("fake").open()
    assert "fake card" in str(caught.value)


def test_a_player_that_breaks_tells_its_last_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sounddevice.py").write_text("raise RuntimeError('the roof fell in')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(DeviceError, match=r"exit code 1(.|\n)*the roof fell in"):
        _masker().open()


def test_what_cannot_be_played_is_refused_before_a_process_is_started() -> None:
    with pytest.raises(UnsafeError, match=r"75 dB\(A\)"):
        SoundMasker("default", -30, 75.1, seed=1, clock=RealClock())
    with pytest.raises(UsageError, match="cannot carry"):
        _masker(rate_hz=22_050)
