"""What a player of masking noise offers."""

from dataclasses import dataclass
from typing import Literal, Protocol

from autd_trials.model import Model


class Route(Model):
    """Where sound goes: `volume_db` is that of stream and sink together, of the loudest channel."""

    sink: str
    description: str
    port: str | None
    volume_db: float
    muted: bool


class MaskerInfo(Model):
    """What the log keeps of the masker: `level_dba` is None where the headphones' sensitivity is unknown.

    `route` is where the noise goes; None where nothing is played, or neither PulseAudio nor PipeWire tells.
    """

    kind: str
    device: str
    level_dbfs: float
    level_dba: float | None
    sample_rate_hz: int
    route: Route | None = None


@dataclass(frozen=True)
class MaskerEvent:
    """Something that happened to the sound; `time_s` on the host's monotonic clock."""

    time_s: float
    kind: Literal["underrun", "lost"]
    detail: str


class Masker(Protocol):
    """A player of masking noise."""

    def open(self) -> MaskerInfo:
        """Make the device ready, still silent; raises DeviceError. May be called again after `close`."""

    def start(self) -> None:
        """Ramp the noise in and return once sound is really flowing; raises DeviceError."""

    def events(self) -> list[MaskerEvent]:
        """Return what happened since the last call, oldest first; never waits."""

    def close(self) -> None:
        """Ramp the noise out and release the device; never raises."""
