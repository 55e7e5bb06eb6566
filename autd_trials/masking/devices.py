"""The sound outputs of this machine."""

from dataclasses import dataclass

from autd_trials.errors import DeviceError

NO_PORTAUDIO = "the PortAudio library is missing, so no sound can be played"
INSTALL_PORTAUDIO = "install it: apt install libportaudio2 (Debian, Ubuntu); elsewhere: reinstall sounddevice"


@dataclass(frozen=True)
class OutputDevice:
    """A sound output; `default` marks the one that the system prefers."""

    index: int
    name: str
    host_api: str
    channels: int
    default: bool

    def __str__(self) -> str:
        default = ", default" if self.default else ""
        return f"{self.index}: {self.name} ({self.host_api}, {self.channels} channels{default})"


@dataclass(frozen=True)
class OutputDevices:
    """The outputs there are; `problem` says why none could be looked for."""

    devices: tuple[OutputDevice, ...]
    problem: str | None = None


def list_devices() -> OutputDevices:
    """Return the sound outputs; never raises, also without PortAudio.

    PortAudio looks for devices once in a process: what is plugged in later is seen by the next one.
    """
    try:
        import sounddevice
    except (OSError, ImportError):  # the library, or its Python side
        return OutputDevices((), f"{NO_PORTAUDIO}; {INSTALL_PORTAUDIO}")
    try:
        found = sounddevice.query_devices()
        host_apis = sounddevice.query_hostapis()
        default = sounddevice.default.device[1]
    except sounddevice.PortAudioError as error:
        return OutputDevices((), f"PortAudio cannot look for devices: {error}")
    return OutputDevices(
        tuple(
            OutputDevice(
                index=int(device["index"]),
                name=str(device["name"]),
                host_api=str(host_apis[device["hostapi"]]["name"]),
                channels=int(device["max_output_channels"]),
                default=device["index"] == default,
            )
            for device in found
            if device["max_output_channels"] > 0
        )
    )


def find_device(wanted: str | int, outputs: OutputDevices) -> OutputDevice:
    """Return the one output that is meant.

    Parameters
    ----------
    wanted
        ``"default"`` for the system's own choice, an index, a name or a part of one name.
    outputs
        What there is.

    Raises
    ------
    DeviceError
        None or several fit; the message lists what there is.
    """
    if outputs.problem:
        raise DeviceError(outputs.problem, where=_where(wanted))
    fitting = _fitting(wanted, outputs.devices)
    if len(fitting) == 1:
        return fitting[0]
    there_are = "\n".join(f"    {device}" for device in outputs.devices) or "    none at all"
    raise DeviceError(
        f"{'several sound outputs fit' if fitting else 'no sound output fits'}; there are\n{there_are}",
        where=_where(wanted),
        do="name one of them by its index or by a part of its name that no other has, or plug the device in",
    )


def _fitting(wanted: str | int, devices: tuple[OutputDevice, ...]) -> list[OutputDevice]:
    if isinstance(wanted, int) or wanted.isdecimal():
        return [device for device in devices if device.index == int(wanted)]
    if wanted == "default":
        return [device for device in devices if device.default]
    exact = [device for device in devices if device.name == wanted]
    return exact or [device for device in devices if wanted.casefold() in device.name.casefold()]


def _where(wanted: str | int) -> str:
    return f"sound output {wanted!r}"
