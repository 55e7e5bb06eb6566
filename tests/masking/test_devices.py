"""Which sound output is meant, and what is said when there is none."""

import sys
from importlib.abc import MetaPathFinder
from types import ModuleType

import pytest

from autd_trials.errors import DeviceError
from autd_trials.masking.devices import OutputDevice, OutputDevices, find_device, list_devices

USB = OutputDevice(4, "USB Audio: DAC (hw:1,0)", "ALSA", 2, False)
HDMI = OutputDevice(5, "HDA: HDMI 0 (hw:0,3)", "ALSA", 8, False)
DEFAULT = OutputDevice(7, "default", "ALSA", 32, True)
OUTPUTS = OutputDevices((USB, HDMI, OutputDevice(6, "default surround", "ALSA", 6, False), DEFAULT))


@pytest.mark.parametrize(
    ("wanted", "found"),
    [
        ("default", DEFAULT),
        (4, USB),
        ("4", USB),
        ("usb", USB),
        ("HDMI 0", HDMI),
        ("HDA: HDMI 0 (hw:0,3)", HDMI),
    ],
)
def test_a_device_is_found_by_index_name_or_part_of_a_name(wanted: str | int, found: OutputDevice) -> None:
    assert find_device(wanted, OUTPUTS) == found


@pytest.mark.parametrize(
    ("wanted", "what"), [("hw:", "several"), ("Bose", "no sound output"), (99, "no sound"), ("", "several")]
)
def test_anything_else_is_refused_with_a_list_of_what_there_is(wanted: str | int, what: str) -> None:
    with pytest.raises(DeviceError, match=what) as caught:
        find_device(wanted, OUTPUTS)
    assert all(device.name in str(caught.value) for device in OUTPUTS.devices)


def test_a_machine_without_sound_is_said_to_have_none() -> None:
    with pytest.raises(DeviceError, match="none at all"):
        find_device("default", OutputDevices(()))


class _NoPortAudio(MetaPathFinder):
    """Importing sounddevice fails as it does where the library is missing."""

    def find_spec(self, fullname: str, path: object = None, target: ModuleType | None = None) -> None:
        if fullname == "sounddevice":
            raise OSError("PortAudio library not found")


def test_without_portaudio_the_list_is_empty_and_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "sounddevice", raising=False)
    monkeypatch.setattr(sys, "meta_path", [_NoPortAudio(), *sys.meta_path])
    outputs = list_devices()
    assert outputs.devices == ()
    assert "apt install libportaudio2" in str(outputs.problem)
    with pytest.raises(DeviceError, match="libportaudio2"):
        find_device("default", outputs)
