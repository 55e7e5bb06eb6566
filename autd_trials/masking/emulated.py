"""A masker that plays nothing, for the emulated rig and for virtual time."""

from typing import Literal

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.masking.masker import MaskerEvent, MaskerInfo
from autd_trials.masking.noise import check_level_dbfs


class EmulatedMasker:
    """Keep to everything that a masker promises, in silence; it says so in its info.

    Parameters
    ----------
    level_dbfs
        The level that would be played, in dBFS rms.
    clock
        Stamps the events.
    level_dba
        The same in dB(A), if known.
    sample_rate_hz
        The sample rate that would be used, in Hz.

    Raises
    ------
    UsageError
        The level would be clipped.
    """

    def __init__(
        self, level_dbfs: float, clock: Clock, *, level_dba: float | None = None, sample_rate_hz: int = 48_000
    ) -> None:
        check_level_dbfs(level_dbfs)
        self._info = MaskerInfo(
            kind="emulated",
            device="none: no sound is played",
            level_dbfs=level_dbfs,
            level_dba=level_dba,
            sample_rate_hz=sample_rate_hz,
        )
        self._clock = clock
        self._open = False
        self._lost = False
        self._events: list[MaskerEvent] = []

    def open(self) -> MaskerInfo:
        """Say what would be played."""
        self._open, self._lost = True, False
        self._events.clear()
        return self._info

    def start(self) -> None:
        """Do as if the noise were flowing; raises DeviceError if not open or lost."""
        if not self._open or self._lost:
            raise DeviceError("the masker is not open", where=self._info.device, do="open it first")

    def events(self) -> list[MaskerEvent]:
        """Return what was injected since the last call."""
        events, self._events = self._events, []
        return events

    def close(self) -> None:
        """Forget everything."""
        self._open = False

    def inject(self, kind: Literal["underrun", "lost"], detail: str = "injected") -> None:
        """Let something happen to the sound now, as a test of what is done about it."""
        self._lost = self._lost or kind == "lost"
        self._events.append(MaskerEvent(self._clock.now_s(), kind, detail))
