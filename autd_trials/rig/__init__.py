"""What a study runs on: the rig file, and the devices built from it."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.rig.build import Builder
    from autd_trials.rig.load import LoadedRig, load_rig
    from autd_trials.rig.schema import Rig

__all__ = ["Builder", "LoadedRig", "Rig", "load_rig"]

__getattr__ = lazy(
    __name__,
    {
        "Builder": "build",
        "LoadedRig": "load",
        "Rig": "schema",
        "load_rig": "load",
    },
)
