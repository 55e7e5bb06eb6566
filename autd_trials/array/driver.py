"""What an array driver offers, and the words in which it is asked."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from pydantic import Field

from autd_trials.model import Model
from autd_trials.stimulus import StimulusFields


class Stimulus(StimulusFields):
    """One finite burst at one focus.

    A drive of 0 is a catch trial: the driver does everything as ever, and nothing is emitted.
    """

    target_mm: tuple[float, float, float] = Field(description="The focus in mm in the calibrated frame.")


class ArrayInfo(Model):
    """What the log keeps of an array; `emulated` is what the firmware says, not what the rig file hopes."""

    driver: str
    link: str
    emulated: bool
    devices: int = Field(ge=0)
    transducers: int = Field(ge=0)
    firmware: tuple[str, ...]


@dataclass(frozen=True)
class Health:
    """State of the devices at `time_s` on the host's monotonic clock."""

    time_s: float
    devices: int
    devices_ready: int
    failsafe: bool
    thermal: bool

    @property
    def ok(self) -> bool:
        """All devices ready, none too hot, and no failsafe latched."""
        return self.devices_ready == self.devices and not (self.failsafe or self.thermal)


@dataclass(frozen=True)
class Exposure:
    """What an armed stimulus would do: exposure in s at full drive, and the level at the ears in dB SPL.

    `ear_level_db` is predicted; None where nothing is emitted or it is not known where the ears are.
    """

    exposure_s: float
    ear_level_db: float | None


@dataclass(frozen=True)
class Onset:
    """An accepted start command.

    `onset_s` is the hardware onset on the host's monotonic clock, `device_ns` the same on the devices' clock,
    `requested_s` what was asked for, `margin_s` what was left between acceptance and onset.
    """

    onset_s: float
    device_ns: int
    requested_s: float
    margin_s: float


@dataclass(frozen=True)
class Completion:
    """The state read back around the onset: still silent at `silent_s`, emitting at `emitting_s`.

    All on the host's clock; `ended_s` is when all devices were seen to have stopped by themselves.
    """

    silent_s: float
    emitting_s: float
    ended_s: float
    health: Health


class ArrayDriver(Protocol):
    """An array that emits finite bursts at a time of its own clock."""

    def open(self) -> ArrayInfo:
        """Take the devices, check that they are all there, leave them silent; raises DeviceError."""

    def check(self, stimuli: Sequence[Stimulus]) -> None:
        """Refuse (UnsafeError, UsageError) what could not be emitted one after the other under the limits."""

    def earliest_s(self, stimulus: Stimulus, onset_s: float) -> float:
        """Return the earliest host time from `onset_s` on at which the limits let a stimulus begin."""

    def arm(self, stimulus: Stimulus) -> Exposure:
        """Preload a stimulus in silence; return what it would do. Refuses as `check` does."""

    @property
    def lead_s(self) -> float:
        """How long before the onset `start` must be called; adapts to the send times seen."""

    def start(self, onset_s: float) -> Onset:
        """Start the armed stimulus at host time `onset_s`, or as soon after it as the lead allows."""

    def watch(self) -> None:
        """Look at the devices while a started stimulus runs; cheap enough to be called all the time.

        Silences the array and raises DeviceError if a device is lost, too hot or muted by its failsafe.
        """

    def finish(self) -> Completion:
        """Wait until the started stimulus has ended by itself; raises DeviceError if it did not."""

    def abort(self) -> None:
        """Silence the array now, whatever it does; safe at any time, also twice.

        Raises DeviceError if the devices do not confirm it (lost, say); their bursts end by themselves.
        """

    def halt(self) -> None:
        """Silence the array now and refuse every further `arm` and `start` until `open` is called again.

        May be called from any thread at any moment, also while another call of the driver blocks or sends;
        whatever that call does, nothing is emitted any more once `halt` has returned. Calls that it
        overtakes, and later ones that would emit, raise StoppedByPerson. Never raises.
        """

    def health(self) -> Health:
        """Read the devices' state now."""

    def close(self) -> None:
        """Silence and release the array; never raises."""
