"""The masker that plays: it keeps a process of its own, which a busy runner cannot make stumble."""

import contextlib
import json
import queue
import subprocess
import sys
import tempfile
import threading
from dataclasses import asdict
from typing import IO, Any

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError, UnsafeError
from autd_trials.masking.level import LARGEST_DBA
from autd_trials.masking.masker import MaskerEvent, MaskerInfo, Route
from autd_trials.masking.noise import check_level_dbfs, check_loop
from autd_trials.masking.player_process import START_DEADLINE_S, PlayerSettings

_OPEN_DEADLINE_S = 15.0  # Python starts, PortAudio looks for devices, a minute of noise is made
_SILENCE_S = 1.0  # the process says five times a second that it is alive
_CLOSE_DEADLINE_S = 1.5
_KILL_DEADLINE_S = 1.0
_LAST_WORDS = 500  # characters

_Message = dict[str, Any]


class SoundMasker:
    """Play pink noise through a sound device, by way of a process of its own.

    Parameters
    ----------
    device
        ``"default"``, an index, a name or a part of one; see `autd_trials.masking.devices.list_devices`.
    level_dbfs
        RMS level in dB re digital full scale, as `autd_trials.masking.level.resolve_level` gave it.
    level_dba
        The same at the ear in dB(A), None where the headphones are unknown; for the record.
    seed
        Seed of the noise: the same seed plays the same noise.
    sample_rate_hz
        Sample rate in Hz.
    clock
        The machine's monotonic clock; stamps what happens to the process itself.
    loop_s
        Length of the noise loop in s.

    Raises
    ------
    UsageError
        The level would be clipped, or rate and length cannot carry the noise.
    UnsafeError
        The level is over 75 dB(A).
    """

    def __init__(
        self,
        device: str | int,
        level_dbfs: float,
        level_dba: float | None,
        *,
        seed: int,
        clock: Clock,
        sample_rate_hz: int = 48_000,
        loop_s: float = 60.0,
    ) -> None:
        check_level_dbfs(level_dbfs)
        check_loop(loop_s, sample_rate_hz)
        if level_dba is not None and not level_dba <= LARGEST_DBA:
            raise UnsafeError(f"{level_dba:g} dB(A) of masking noise is over {LARGEST_DBA:g} dB(A)")
        self._settings = PlayerSettings(device, level_dbfs, seed, sample_rate_hz, loop_s)
        self._level_dba = level_dba
        self._clock = clock
        self._player: _Player | None = None
        self._lost = False

    def open(self) -> MaskerInfo:
        """Start the process and let it open the device and play silence.

        Raises
        ------
        DeviceError
            No such device, one that refuses the noise, one that is muted; no PortAudio.
        """
        self.close()
        self._player = _Player(self._settings, self._clock)
        try:
            ready = self._player.wait_for("ready", _OPEN_DEADLINE_S)
        except BaseException:
            self.close()
            raise
        return MaskerInfo(
            kind="sound",
            device=ready["device"],
            level_dbfs=self._settings.level_dbfs,
            level_dba=self._level_dba,
            sample_rate_hz=self._settings.sample_rate_hz,
            route=ready["route"] and Route(**ready["route"]),
        )

    def start(self) -> None:
        """Ramp the noise in; return when the device has taken more than it can buffer, so that sound flows.

        Raises
        ------
        DeviceError
            Not open, or no sound flows within 5 s.
        """
        if self._player is None or self._lost:
            raise DeviceError("the masker is not open", where=_where(self._settings), do="open it first")
        if self._player.flowing:
            return
        try:
            self._player.say("start")
            self._player.wait_for("flowing", START_DEADLINE_S + _SILENCE_S)
        except BaseException:
            self.close()
            raise

    def events(self) -> list[MaskerEvent]:
        """Return what happened to the sound since the last call; after ``lost`` nothing more comes."""
        if self._player is None or self._lost:
            return []
        events = self._player.events()
        self._lost = any(event.kind == "lost" for event in events)
        return events

    def close(self) -> None:
        """Ramp the noise out and end the process; takes 0.3 s, and at most 2.5 s if it hangs."""
        if self._player is not None:
            self._player.close()
        self._player, self._lost = None, False


class _Player:
    """The process, and what it says."""

    def __init__(self, settings: PlayerSettings, clock: Clock) -> None:
        self._clock = clock
        self._where = _where(settings)
        self._messages: queue.SimpleQueue[_Message | None] = queue.SimpleQueue()
        self._heard_s = clock.now_s()
        self.flowing = False
        self._stderr: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  lives as long as the process
        self._process = subprocess.Popen(
            [sys.executable, "-m", PlayerSettings.__module__, json.dumps(asdict(settings))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            text=True,
            start_new_session=True,  # Ctrl-C in the terminal is for the runner alone
        )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self._heard_s = self._clock.now_s()
            self._messages.put(json.loads(line))
        self._messages.put(None)

    def say(self, word: str) -> None:
        assert self._process.stdin
        # A process that has ended cannot listen; wait_for tells why it has.
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(word + "\n")
            self._process.stdin.flush()

    def wait_for(self, awaited: str, deadline_s: float) -> _Message:
        """Return the next message, which must be the awaited one; raises DeviceError otherwise."""
        try:
            message = self._messages.get(timeout=deadline_s)
        except queue.Empty:
            raise DeviceError(
                f"the sound process did not answer within {deadline_s:g} s",
                where=self._where,
                do="see whether the sound server hangs (restart it), then try again",
            ) from None
        if message is None:
            raise DeviceError(self._epitaph(), where=self._where)
        if message["message"] == "failed":
            raise DeviceError(message["what"], where=message["where"] or self._where, do=message["do"])
        assert message["message"] == awaited, message
        self.flowing = awaited == "flowing"
        return message

    def events(self) -> list[MaskerEvent]:
        """Return what happened since the last call, at most one ``lost``, which is the last."""
        events: list[MaskerEvent] = []
        while not self._messages.empty():
            event = self._event(self._messages.get())
            if event:
                events.append(event)
            if event and event.kind == "lost":
                return events
        silence_s = self._clock.now_s() - self._heard_s
        if self.flowing and silence_s > _SILENCE_S:
            events.append(self._lost(f"the sound process has said nothing for {silence_s:.1f} s"))
        return events

    def _event(self, message: _Message | None) -> MaskerEvent | None:
        match message:
            case None:
                return self._lost(self._epitaph())
            case {"message": "failed", "what": what, "time_s": time_s}:
                return MaskerEvent(time_s, "lost", what)
            case {"message": "underrun", "time_s": time_s}:
                return MaskerEvent(time_s, "underrun", "the sound device ran out of noise for a moment")
            case _:
                return None

    def _lost(self, detail: str) -> MaskerEvent:
        return MaskerEvent(self._clock.now_s(), "lost", detail)

    def _epitaph(self) -> str:
        """Say how the process ended, with the end of what it left on its standard error."""
        try:
            code = self._process.wait(timeout=_KILL_DEADLINE_S)
        except subprocess.TimeoutExpired:
            return "the sound process fell silent"
        self._stderr.seek(0)
        last_words = self._stderr.read().decode(errors="replace").strip()[-_LAST_WORDS:]
        return f"the sound process ended by itself with exit code {code}" + (
            f":\n{last_words}" if last_words else ""
        )

    def close(self) -> None:
        """Let it ramp out and end; kill it if it does not."""
        assert self._process.stdin
        self.say("close")
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        if not self._ends_within(_CLOSE_DEADLINE_S):
            self._process.kill()
            self._ends_within(_KILL_DEADLINE_S)
        self._listener.join(timeout=_KILL_DEADLINE_S)
        self._stderr.close()
        if self._process.stdout and not self._listener.is_alive():
            self._process.stdout.close()

    def _ends_within(self, deadline_s: float) -> bool:
        try:
            self._process.wait(timeout=deadline_s)
        except subprocess.TimeoutExpired:
            return False
        return True


def _where(settings: PlayerSettings) -> str:
    return f"sound output {settings.device!r}"
