"""Opens every device that a rig names, each by itself, and says what was found."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from autd_trials.errors import TrialsError
from autd_trials.rig.build import Builder
from autd_trials.rig.schema import EmulatedSoundSpec, SerialSpec

_PROBE_DBFS = -60.0  # the masker is opened, which plays silence, and never started


@dataclass(frozen=True)
class Finding:
    """What became of one device: `found` describes it; `failure` is None if it could be opened."""

    device: str
    found: str
    failure: TrialsError | None = None


class _Device(Protocol):
    def close(self) -> None: ...


def probe(builder: Builder) -> list[Finding]:
    """Open and close the rig's array, sound and response device; a real array is silent throughout.

    Parameters
    ----------
    builder
        Knows rig and protocol; its clock is the machine's.

    Returns
    -------
    list of Finding
        One for each device, whether or not the others could be opened.
    """
    return [
        _finding("array", lambda: _array(builder)),
        _finding("sound", lambda: _sound(builder)),
        _finding("responses", lambda: _responses(builder)),
    ]


def _finding(device: str, open_it: Callable[[], str]) -> Finding:
    try:
        return Finding(device, open_it())
    except TrialsError as failure:
        return Finding(device, f"{failure.where}: {failure.what}" if failure.where else failure.what, failure)


def _array(builder: Builder) -> str:
    array = builder.array()
    with _closed(array):
        info = array.open()
        health = array.health()
        firmware = ", ".join(sorted(set(info.firmware)))
        emulated = "emulated " if info.emulated else ""
        return f"{health.devices_ready} {emulated}devices ready on {info.link}; firmware {firmware}"


def _sound(builder: Builder) -> str:
    from autd_trials.masking.player import SoundMasker

    sound = builder.rig.sound
    if sound is None:
        return "none in the rig file"
    if isinstance(sound, EmulatedSoundSpec):
        return "emulated: no sound is played"
    masker = SoundMasker(
        sound.device, _PROBE_DBFS, None, seed=0, clock=builder.clock, sample_rate_hz=sound.sample_rate_hz
    )
    with _closed(masker):
        info = masker.open()
        route = info.route
        if route is None:
            return f"{info.device}; where its sound goes is not known"
        return f"{info.device}; goes to {route.description} ({route.sink}) at {route.volume_db:.1f} dB"


def _responses(builder: Builder) -> str:
    from autd_trials.responses.serial_box import SerialBox

    spec = builder.rig.responses
    if not isinstance(spec, SerialSpec):
        return f"keyboard; keys {', '.join(spec.keys)}"
    box = SerialBox(spec.port, spec.protocol, builder.clock)
    with _closed(box):
        info = box.open()
        return f"{info.device}; presses are stamped within {1000 * info.time_uncertainty_s:.1f} ms"


@contextlib.contextmanager
def _closed(device: _Device) -> Iterator[None]:
    try:
        yield
    finally:
        device.close()
