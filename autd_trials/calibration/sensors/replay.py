"""Recorded frames on disk: writing them while a sensor runs, and playing them as a sensor.

A recording is a folder with ``recording.json`` and one compressed numpy file a frame. Frames are added, never
rewritten, so what was recorded before a crash is there.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Self
from zipfile import BadZipFile

import numpy as np

from autd_trials.calibration.sensors.frame import Frame, Intrinsics, Sensor
from autd_trials.errors import UsageError

_HEADER = "recording.json"


class RecordingSensor:
    """Gives another sensor's frames and writes them down on the way.

    Parameters
    ----------
    sensor
        Whose frames.
    folder
        Where to; it must not hold a recording yet.

    Raises
    ------
    UsageError
        There is a recording already.
    """

    def __init__(self, sensor: Sensor, folder: Path) -> None:
        if (folder / _HEADER).exists():
            raise UsageError(
                "this folder holds a recording already", where=str(folder), do="name another one"
            )
        self._sensor = sensor
        self._folder = folder

    @property
    def serial(self) -> str:
        """The recorded sensor's serial number."""
        return self._sensor.serial

    @property
    def intrinsics(self) -> Intrinsics:
        """The recorded sensor's camera."""
        return self._sensor.intrinsics

    def __enter__(self) -> Self:
        self._sensor.__enter__()
        self._folder.mkdir(parents=True, exist_ok=True)
        header = {"serial": self.serial, "intrinsics": asdict(self.intrinsics)}
        with (self._folder / _HEADER).open("x", encoding="utf-8") as file:
            json.dump(header, file)
        return self

    def __exit__(self, *error: object) -> None:
        self._sensor.__exit__(*error)

    def __iter__(self) -> Iterator[Frame]:
        for number, frame in enumerate(self._sensor):
            with (self._folder / f"{number:06d}.npz").open("xb") as file:
                np.savez_compressed(
                    file,
                    infrared=frame.infrared,
                    depth_m=frame.depth_m,
                    time_s=frame.time_s,
                    clock=frame.clock,
                    sequence=frame.sequence,
                )
            yield frame


class ReplaySensor:
    """Plays a recording, as fast as its frames are taken.

    Parameters
    ----------
    folder
        The recording.

    Raises
    ------
    UsageError
        The folder holds no recording.
    """

    def __init__(self, folder: Path) -> None:
        try:
            header = json.loads((folder / _HEADER).read_text(encoding="utf-8"))
            self.serial = str(header["serial"])
            self.intrinsics = Intrinsics(**header["intrinsics"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise UsageError(f"this is no recording: {error}", where=str(folder / _HEADER)) from error
        self._folder = folder

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        return None

    def __iter__(self) -> Iterator[Frame]:
        paths = sorted(self._folder.glob("*.npz"))
        for path in paths:
            try:
                yield _read(path)
            except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
                if path == paths[-1]:
                    return  # the recording was cut off while this frame was written
                raise UsageError(f"this frame cannot be read: {error}", where=str(path)) from error


def _read(path: Path) -> Frame:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
        return Frame(
            infrared=data["infrared"],
            depth_m=data["depth_m"],
            time_s=float(data["time_s"]),
            clock=str(data["clock"]),
            sequence=int(data["sequence"]),
        )
