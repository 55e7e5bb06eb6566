"""The process that plays the noise: ``python -m autd_trials.masking.player_process SETTINGS``.

It is told ``start`` on its standard input and plays until it is told ``close``, or its input is closed, or
its parent is gone, so that sound never outlives the runner. It answers on its standard output, one JSON
object a line: ``ready`` (with the route), ``flowing``, ``alive``, ``underrun``, ``failed``. Times are
`time.monotonic`, which all processes of a machine share.
"""

import contextlib
import json
import os
import queue
import signal
import sys
import threading
import time
import traceback
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from autd_trials.errors import DeviceError, TrialsError
from autd_trials.masking.devices import OutputDevice, find_device, list_devices
from autd_trials.masking.masker import Route
from autd_trials.masking.noise import RAMP_S, pink_noise
from autd_trials.masking.playback import Playback
from autd_trials.masking.route import RouteWatch, silent

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

START_DEADLINE_S = 5.0

_BLOCK_FRAMES = 2048
_LATENCY_S = 0.2  # rides out a busy machine
_STALL_S = 0.5
_WATCH_S = 0.05
_ALIVE_EVERY_S = 0.2
_RAMP_OUT_DEADLINE_S = 0.7
_LEAD_S = 0.1  # of silence: a device may swallow its first sound (9 ms were seen), and with it the ramp
_MARGIN_S = 0.03


@dataclass(frozen=True)
class PlayerSettings:
    """What to play where; handed over as JSON."""

    device: str | int
    level_dbfs: float
    seed: int
    sample_rate_hz: int
    loop_s: float


def main() -> None:
    """Play until told to end; never returns, since PortAudio can hang on a dead device."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the runner's to handle
    runner = _Runner()
    try:
        _play(PlayerSettings(**json.loads(sys.argv[1])), runner)
    except TrialsError as error:
        runner.tell("failed", what=error.what, where=error.where, do=error.do, time_s=time.monotonic())
    except Exception:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)


def _play(settings: PlayerSettings, runner: "_Runner") -> None:
    output = _Output(settings)
    output.start()
    watch = RouteWatch()
    _refuse_silent(watch.route, output.device)
    runner.tell("ready", device=str(output.device), route=watch.route and watch.route.model_dump())
    if not runner.wait_for_start():
        return
    output.play()
    _wait_for_flow(output, runner)
    _watch(output, watch, runner)
    output.ramp_out()


def _refuse_silent(route: Route | None, device: OutputDevice) -> None:
    if route is not None and silent(route):
        raise DeviceError(
            f"nothing would be heard: {route.description} ({route.sink}) or the program's sound is muted",
            where=str(device),
            do="turn it on in the system's sound settings, at the volume at which the level was measured",
        )


def _wait_for_flow(output: "_Output", runner: "_Runner") -> None:
    deadline_s = time.monotonic() + START_DEADLINE_S
    while not output.flowing and not runner.gone:
        if output.ended or time.monotonic() > deadline_s:
            raise DeviceError(
                f"the sound device took no sound within {START_DEADLINE_S:g} s",
                where=str(output.device),
                do="see whether another program holds it, and whether it plays anything else",
            )
        time.sleep(_WATCH_S)
    runner.tell("flowing")


def _watch(output: "_Output", watch: RouteWatch, runner: "_Runner") -> None:
    """Report underruns until the runner ends it, the device takes no sound, or the sound goes elsewhere."""
    alive_s = time.monotonic()
    while not runner.gone:
        for time_s in output.new_underruns():
            runner.tell("underrun", time_s=time_s)
        if output.ended or output.idle_s > _STALL_S:
            raise DeviceError("the sound device takes no more sound", where=str(output.device))
        if watch.problem is not None:
            raise DeviceError(watch.problem, where=str(output.device))
        if time.monotonic() - alive_s > _ALIVE_EVERY_S:
            alive_s = time.monotonic()
            runner.tell("alive")
        time.sleep(_WATCH_S)


class _Runner:
    """The parent: what it says, what it is told, and whether it is still there."""

    def __init__(self) -> None:
        self._parent = os.getppid()
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._closed = False
        self._answers = os.dup(1)
        os.dup2(2, 1)  # sound libraries may chat on standard output
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for line in sys.stdin:
            if line == "close\n":
                break
            self._lines.put(line)
        self._closed = True

    @property
    def gone(self) -> bool:
        """Whether it said so, closed the pipe or died; a pipe can stay open in a process it left behind."""
        return self._closed or os.getppid() != self._parent

    def wait_for_start(self) -> bool:
        """Return True when told to start, False when the runner is gone."""
        while not self.gone:
            try:
                return self._lines.get(timeout=_WATCH_S) == "start\n"
            except queue.Empty:
                continue
        return False

    def tell(self, message: str, **content: object) -> None:
        line = json.dumps({"message": message, **content}) + "\n"
        # Nobody left to tell? Then `gone` becomes true, and the noise fades.
        with contextlib.suppress(BrokenPipeError):
            os.write(self._answers, line.encode())


class _Output:
    """A stream of the noise into a sound device."""

    def __init__(self, settings: PlayerSettings) -> None:
        self.device: OutputDevice = find_device(settings.device, list_devices())
        rate_hz = settings.sample_rate_hz
        self._playback = Playback(
            _loop(settings), lead_samples=round(_LEAD_S * rate_hz), ramp_samples=round(RAMP_S * rate_hz)
        )
        self._playing = False
        self._underruns: deque[float] = deque()
        self._called_s = time.monotonic()
        self._played_out_s = self._called_s
        self._stream = self._open(settings)
        self._buffered_frames = (_LEAD_S + self._stream.latency) * rate_hz + 2 * _BLOCK_FRAMES

    def _open(self, settings: PlayerSettings) -> Any:  # sounddevice has no types
        import sounddevice

        try:
            return sounddevice.OutputStream(
                device=self.device.index,
                samplerate=settings.sample_rate_hz,
                channels=min(2, self.device.channels),
                dtype="float32",
                blocksize=_BLOCK_FRAMES,
                latency=_LATENCY_S,
                callback=self._fill,
            )
        except sounddevice.PortAudioError as error:
            raise _refused(self.device, error) from error

    def start(self) -> None:
        """Play silence: the stream exists from now on, so that the system tells where it goes."""
        import sounddevice

        self._called_s = time.monotonic()
        try:
            self._stream.start()
        except sounddevice.PortAudioError as error:
            raise _refused(self.device, error) from error

    def play(self) -> None:
        """Play the noise from the next block on."""
        self._playing = True

    def _fill(self, block: "NDArray[np.float32]", frames: int, at: Any, status: Any) -> None:
        waited_s = time.monotonic() - self._called_s
        self._called_s += waited_s
        if not self._playing:
            block[:] = 0
            return
        # Some hosts do not say that they ran dry; one that asks later than what it held could last, did.
        held_s = self._stream.latency + frames / self._stream.samplerate
        if status.output_underflow or (waited_s > held_s and self._playback.frames > 0):
            self._underruns.append(self._called_s)
        if not self._playback.ended:
            delay_s = max(self._stream.latency, at.outputBufferDacTime - at.currentTime)
            self._played_out_s = self._called_s + delay_s + frames / self._stream.samplerate
        self._playback.fill(block)

    @property
    def flowing(self) -> bool:
        """Whether the device took more than it can hold, so that the noise is sounding."""
        return bool(self._playback.frames > self._buffered_frames)

    @property
    def ended(self) -> bool:
        """Whether the stream ended by itself."""
        return not self._stream.active

    @property
    def idle_s(self) -> float:
        """Seconds since the device last asked for sound."""
        return time.monotonic() - self._called_s

    def new_underruns(self) -> list[float]:
        """Return the times of the underruns since the last call."""
        return [self._underruns.popleft() for _ in range(len(self._underruns))]

    def ramp_out(self) -> None:
        """Fade, and wait until the device has played what it took; but not for ever."""
        self._playback.stop()
        deadline_s = time.monotonic() + _RAMP_OUT_DEADLINE_S
        # What PulseAudio has not played yet is dropped when the stream ends: so silence follows until it has.
        while not (self._playback.ended and time.monotonic() > self._played_out_s + _MARGIN_S):
            if time.monotonic() > deadline_s:
                return
            time.sleep(0.01)


def _loop(settings: PlayerSettings) -> "NDArray[np.float32]":
    import numpy as np

    return pink_noise(
        np.random.default_rng(settings.seed),
        settings.level_dbfs,
        length_s=settings.loop_s,
        sample_rate_hz=settings.sample_rate_hz,
    )


def _refused(device: OutputDevice, error: Exception) -> DeviceError:
    return DeviceError(
        f"the sound device refuses the noise: {error}",
        where=str(device),
        do="choose a sample rate that it plays, and see whether another program holds it",
    )


if __name__ == "__main__":
    main()
