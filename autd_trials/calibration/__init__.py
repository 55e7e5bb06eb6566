"""Where the units are."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.calibration.file import Calibration, load_calibration, write_calibration
    from autd_trials.calibration.settings import Settings
    from autd_trials.calibration.solve import Solution, calibrate
    from autd_trials.calibration.track import Track, read_track

__all__ = [
    "Calibration",
    "Settings",
    "Solution",
    "Track",
    "calibrate",
    "load_calibration",
    "read_track",
    "write_calibration",
]

__getattr__ = lazy(
    __name__,
    {
        "Calibration": "file",
        "Settings": "settings",
        "Solution": "solve",
        "Track": "track",
        "calibrate": "solve",
        "load_calibration": "file",
        "read_track": "track",
        "write_calibration": "file",
    },
)
