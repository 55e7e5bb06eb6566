"""Pink noise, its level, its player."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.masking.devices import find_device, list_devices
    from autd_trials.masking.emulated import EmulatedMasker
    from autd_trials.masking.level import Headphones, MaskingLevel, resolve_level
    from autd_trials.masking.masker import Masker, MaskerEvent, MaskerInfo
    from autd_trials.masking.noise import pink_noise
    from autd_trials.masking.player import SoundMasker

__all__ = [
    "EmulatedMasker",
    "Headphones",
    "Masker",
    "MaskerEvent",
    "MaskerInfo",
    "MaskingLevel",
    "SoundMasker",
    "find_device",
    "list_devices",
    "pink_noise",
    "resolve_level",
]

__getattr__ = lazy(
    __name__,
    {
        "EmulatedMasker": "emulated",
        "Headphones": "level",
        "Masker": "masker",
        "MaskerEvent": "masker",
        "MaskerInfo": "masker",
        "MaskingLevel": "level",
        "SoundMasker": "player",
        "find_device": "devices",
        "list_devices": "devices",
        "pink_noise": "noise",
        "resolve_level": "level",
    },
)
