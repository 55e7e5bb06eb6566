"""What a study runs on: the rig file's schema, and the devices built from it.

Nothing real is started by default or by guess: a real array needs a rig file that names its network
interface, real sound one that names its device.
"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from autd_trials.array.driver import ArrayDriver
from autd_trials.calibration.file import Calibration
from autd_trials.clock import Clock
from autd_trials.errors import UsageError
from autd_trials.masking.masker import Masker
from autd_trials.protocol.schema import Protocol
from autd_trials.responses.responder import Responder


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class LimitsSpec(_Model):
    """The rig's own limits; a protocol can only be stricter."""

    largest_drive: float = Field(ge=0, le=1, description="Largest drive, 0 to 1.")
    longest_burst_s: float = Field(gt=0, le=16.0, description="Longest stimulus in s.")
    largest_duty: float = Field(gt=0, le=1, description="Largest share of on-time in any 60 s.")
    session_exposure_s: float = Field(gt=0, description="Largest sum of drive^2 x duration of a session, in s.")


class NetworkLinkSpec(_Model):
    """Real devices behind a network interface."""

    interface: str = Field(min_length=1, description="Name of the network interface, such as enp3s0.")


class ArraySpec(_Model):
    """The phased array and how it is reached."""

    link: Literal["emulator"] | NetworkLinkSpec = Field(
        description="'emulator' (the SDK's firmware emulator), or the network interface of real devices."
    )
    air_temperature_c: float = Field(20.0, ge=0, le=45, description="For the speed of sound.")
    limits: LimitsSpec


class CalibrationSpec(_Model):
    """Where the units' poses come from."""

    file: str = Field(min_length=1, description="Path of the calibration file, relative to the rig file.")
    oldest_days: float | None = Field(None, gt=0, description="Refuse a calibration older than this, in days.")


class HeadphonesSpec(_Model):
    """The headphones as measured with a coupler."""

    sensitivity_db_per_v: float = Field(description="Level at the ear in dB SPL for 1 V rms at 1 kHz.")
    full_scale_v_rms: float = Field(gt=0, description="Voltage in V rms of a full-scale sine at the headphones.")
    checked: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")] = Field(description="Day of the check.")
    note: str = Field(description="Headphones, amplifier, volume setting.")


class EmulatedSoundSpec(_Model):
    """No sound is played; the masker only pretends."""

    player: Literal["emulated"]


class RealSoundSpec(_Model):
    """A sound device."""

    player: Literal["portaudio"]
    device: str | int = Field("default", description="Name (or a unique part of it) or number of the sound device.")
    sample_rate_hz: int = Field(48000, ge=8000, le=192000)
    headphones: HeadphonesSpec | None = None


class KeyboardSpec(_Model):
    """The experimenter presses a key when the participant raises a hand."""

    device: Literal["keyboard"]


class LineProtocolSpec(_Model):
    """A box that sends a line a press."""

    kind: Literal["line"]
    press: str = Field(description="Regular expression of a press; group 'button', and 'ms' or 'us' for its own time.")


class SingleByteProtocolSpec(_Model):
    """A box that sends a byte a press."""

    kind: Literal["single_byte"]
    buttons: dict[str, str] = Field(min_length=1, description="Byte (one character, or 0x41) to button name.")


class SerialSpec(_Model):
    """A button box on a serial port."""

    device: Literal["serial"]
    port: str = Field(min_length=1)
    baud_rate: int = Field(115200, ge=300, le=4_000_000)
    protocol: Annotated[LineProtocolSpec | SingleByteProtocolSpec, Field(discriminator="kind")]


class Rig(_Model):
    """A whole rig."""

    name: str = Field(min_length=1)
    description: str = Field(min_length=1)
    array: ArraySpec
    calibration: CalibrationSpec
    sound: Annotated[EmulatedSoundSpec | RealSoundSpec, Field(discriminator="player")] | None = Field(
        None, description="Left out: this rig has no sound, and protocols with masking are refused."
    )
    responses: Annotated[KeyboardSpec | SerialSpec, Field(discriminator="device")]

    @property
    def emulated(self) -> bool:
        """Whether the array is the firmware emulator."""
        return self.array.link == "emulator"
