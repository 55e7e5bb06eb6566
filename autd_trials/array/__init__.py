"""The phased array: units and their poses, envelopes, the driver interface and its drivers."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.array.autd3_backend import Autd3Backend
    from autd_trials.array.backend import Backend
    from autd_trials.array.driver import ArrayDriver, ArrayInfo, Completion, Exposure, Health, Onset, Stimulus
    from autd_trials.array.geometry import UnitPose
    from autd_trials.array.link import EmulatorLink, NetworkLink
    from autd_trials.array.phased_array import PhasedArray
    from autd_trials.array.virtual_backend import VirtualBackend

__all__ = [
    "ArrayDriver",
    "ArrayInfo",
    "Autd3Backend",
    "Backend",
    "Completion",
    "EmulatorLink",
    "Exposure",
    "Health",
    "NetworkLink",
    "Onset",
    "PhasedArray",
    "Stimulus",
    "UnitPose",
    "VirtualBackend",
]

__getattr__ = lazy(
    __name__,
    {
        "ArrayDriver": "driver",
        "ArrayInfo": "driver",
        "Autd3Backend": "autd3_backend",
        "Backend": "backend",
        "Completion": "driver",
        "EmulatorLink": "link",
        "Exposure": "driver",
        "Health": "driver",
        "NetworkLink": "link",
        "Onset": "driver",
        "PhasedArray": "phased_array",
        "Stimulus": "driver",
        "UnitPose": "geometry",
        "VirtualBackend": "virtual_backend",
    },
)
