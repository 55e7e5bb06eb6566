"""The rig file's schema.

Nothing real is started by default or by guess: a real array needs a rig file that names its network
interface, real sound one that names its device.
"""

from datetime import date
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from autd_trials.acoustics.air import Air
from autd_trials.model import Model
from autd_trials.responses.box_protocols import BoxProtocol
from autd_trials.responses.keyboard import key_text
from autd_trials.stimulus import PUBLIC_LEVEL_DB, Limits
from autd_trials.terminal.keys import plain_key


class LimitsSpec(Limits):
    """The rig's own limits; a protocol can only be stricter."""

    largest_ear_level_db: float = Field(
        PUBLIC_LEVEL_DB,
        gt=0,
        le=180,
        description="Largest predicted sound pressure level at anybody's ears in dB; over 100 only with a "
        "reason, and on a real array never over 110.",
    )
    ear_level_reason: str | None = Field(
        None,
        min_length=1,
        max_length=1000,
        description="Why more than 100 dB, the public's limit, may reach the ears, and who approved it.",
    )


class NetworkLinkSpec(Model):
    """Real devices behind a network interface."""

    interface: str = Field(min_length=1, description="Name of the network interface, such as enp3s0.")


class ArraySpec(Model):
    """The phased array and how it is reached."""

    link: Literal["emulator"] | NetworkLinkSpec = Field(
        description="'emulator' (the SDK's firmware emulator), or the network interface of real devices."
    )
    air_temperature_c: float = Field(
        20.0, ge=0, le=45, description="Air temperature, for the speed of sound and absorption."
    )
    air_relative_humidity_percent: float = Field(
        50.0, ge=0, le=100, description="Relative humidity, for the absorption."
    )
    air_pressure_kpa: float = Field(
        101.3, ge=50, le=120, description="Air pressure, for density and absorption."
    )
    limits: LimitsSpec


class CalibrationSpec(Model):
    """Where the units' poses come from."""

    file: str = Field(min_length=1, description="Path of the calibration file, relative to the rig file.")
    true_file: str | None = Field(
        None,
        min_length=1,
        description="Emulated rigs only: where the units really stand, so that simulated participants feel "
        "what a wrong calibration does.",
    )
    oldest_days: float | None = Field(
        None, gt=0, description="Refuse a calibration older than this, in days."
    )
    least_energy_left: float | None = Field(
        None,
        gt=0,
        le=1,
        description="Refuse a calibration that predicts less energy at the target (5 % quantile).",
    )


class HeadSpec(Model):
    """The head of somebody else in the room."""

    who: str = Field(min_length=1, max_length=100, description="Whose head, such as experimenter.")
    x_mm: float = Field(ge=-1e5, le=1e5, description="Middle between the ears, in the calibrated frame.")
    y_mm: float = Field(ge=-1e5, le=1e5, description="See x_mm.")
    z_mm: float = Field(ge=-1e5, le=1e5, description="See x_mm.")
    hearing_protection_db: float = Field(
        0.0, ge=0, le=60, description="Attenuation at 40 kHz of what they wear, as measured; 0 if unknown."
    )


class HeadphonesSpec(Model):
    """The sound chain behind the digital output, as measured with a coupler."""

    sensitivity_db_per_v: float = Field(description="Level at the ear in dB SPL for 1 V rms at 1 kHz.")
    full_scale_v_rms: float = Field(
        gt=0, description="Voltage in V rms at the headphones of a full-scale sine."
    )
    checked: date = Field(description="Day of the check.")
    note: str = Field(description="Headphones, amplifier, volume setting.")


class EmulatedSoundSpec(Model):
    """No sound is played; the masker only pretends."""

    player: Literal["emulated"]


class RealSoundSpec(Model):
    """A sound device."""

    player: Literal["portaudio"]
    device: str | int = Field(
        "default", description="Name (or a unique part of it) or number of the sound device."
    )
    sample_rate_hz: int = Field(48000, ge=8000, le=192000, description="Sample rate in Hz.")
    headphones: HeadphonesSpec | None = Field(None, description="Needed for levels in dB(A).")


def _tell_apart(keys: tuple[str, ...]) -> tuple[str, ...]:
    """Refuse what is no key, steers the session, or would be taken for another of the keys."""
    plain = [plain_key(key_text(name)) for name in keys]
    for index, text in enumerate(plain):
        if text in plain[:index]:
            raise ValueError(f"the key {keys[index]!r} is {keys[plain.index(text)]!r} on another layout")
    return keys


class KeyboardSpec(Model):
    """The experimenter presses a key when the participant raises a hand."""

    device: Literal["keyboard"]
    keys: Annotated[tuple[str, ...], AfterValidator(_tell_apart)] = Field(
        ("space",), min_length=1, max_length=20, description="Keys that mean felt."
    )


class SerialSpec(Model):
    """A button box on a serial port."""

    device: Literal["serial"]
    port: str = Field(min_length=1, description="Name of the port, such as /dev/ttyACM0 or COM3.")
    protocol: BoxProtocol = Field(description="What the box sends.")


class Rig(Model):
    """A whole rig."""

    name: str = Field(min_length=1, description="Name of the rig, for the record.")
    description: str = Field(min_length=1, description="What it is, in a sentence or two.")
    array: ArraySpec
    calibration: CalibrationSpec
    sound: Annotated[EmulatedSoundSpec | RealSoundSpec, Field(discriminator="player")] | None = Field(
        None, description="Left out: this rig has no sound, and protocols with masking are refused."
    )
    hearing_protection_db: float = Field(
        0.0,
        ge=0,
        le=60,
        description="Attenuation at 40 kHz of what the participant wears over the ears, as measured; 0 if "
        "unknown.",
    )
    other_heads: tuple[HeadSpec, ...] = Field(
        (),
        max_length=20,
        description="Whoever else is in the room, such as the experimenter; the participant's head is in the "
        "protocol.",
    )
    responses: Annotated[KeyboardSpec | SerialSpec, Field(discriminator="device")]

    @property
    def emulated(self) -> bool:
        """Whether the array is the firmware emulator."""
        return self.array.link == "emulator"

    @property
    def air(self) -> Air:
        """The air in the room."""
        array = self.array
        return Air(array.air_temperature_c, array.air_relative_humidity_percent, array.air_pressure_kpa)
