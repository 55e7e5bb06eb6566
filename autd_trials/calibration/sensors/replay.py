"""Recorded frames on disk: writing them while a sensor runs, and playing them as a sensor.

A recording is a folder with ``recording.json`` and one compressed numpy file a frame. Frames are added, never
rewritten, so what was recorded before a crash is there. A recording that is played is as old as when it was
taken, and simulated if its sensor was.
"""

import json
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any, Self
from zipfile import BadZipFile

import numpy as np
from pydantic import ValidationError

from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.sensors.frame import Frame, Intrinsics, Sensor
from autd_trials.calibration.writing import writing
from autd_trials.errors import UsageError

_HEADER = "recording.json"
_SYNTHETIC = "synthetic"  # the serial number of all simulated sensors, also in recordings of version 1
_MOST_PIXELS = 50_000_000
_DAMAGED = (OSError, ValueError, KeyError, EOFError, TypeError, ArithmeticError, RuntimeError, MemoryError)
_DAMAGED_ZIP = (BadZipFile, zlib.error)


class RecordingSensor:
    """Gives another sensor's frames and writes them down on the way.

    Parameters
    ----------
    sensor
        Whose frames.
    folder
        Where to; it must not hold a recording yet.
    now
        The wall-clock time, for the record; aware.

    Raises
    ------
    UsageError
        There is a recording already.
    DeviceError
        Later: the disk is full or gone.
    """

    def __init__(self, sensor: Sensor, folder: Path, now: datetime) -> None:
        with writing(folder, _ADVICE):
            there = (folder / _HEADER).exists()
        if there:
            raise UsageError(
                "this folder holds a recording already", where=str(folder), do="name another one"
            )
        self._sensor = sensor
        self._folder = folder
        self._now = now

    @property
    def capture(self) -> Capture:
        """The recorded sensor."""
        return self._sensor.capture

    @property
    def intrinsics(self) -> Intrinsics:
        """The recorded sensor's camera."""
        return self._sensor.intrinsics

    def __enter__(self) -> Self:
        self._sensor.__enter__()
        capture = self.capture.at(self._now).model_dump(mode="json")
        header = {"capture": capture, "intrinsics": asdict(self.intrinsics)}
        with writing(self._folder, _ADVICE):
            self._folder.mkdir(parents=True, exist_ok=True)
            with (self._folder / _HEADER).open("x", encoding="utf-8") as file:
                json.dump(header, file)
        return self

    def __exit__(self, *error: object) -> None:
        self._sensor.__exit__(*error)

    def __iter__(self) -> Iterator[Frame]:
        for number, frame in enumerate(self._sensor):
            with writing(self._folder, f"frames 0 to {number - 1} are safe there; {_ADVICE}"):
                self._write(frame, self._folder / f"{number:06d}.npz")
            yield frame

    def _write(self, frame: Frame, path: Path) -> None:
        with path.open("xb") as file:
            np.savez_compressed(
                file,
                infrared=frame.infrared,
                depth_m=frame.depth_m,
                time_s=frame.time_s,
                clock=frame.clock,
                sequence=frame.sequence,
            )


_ADVICE = "free space or name another folder, and start again"


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
            self.capture = _capture(header)
            self.intrinsics = Intrinsics(**header["intrinsics"])
            _refuse_wrong(self.intrinsics)
        except (OSError, ValueError, KeyError, TypeError, RecursionError, ValidationError) as error:
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
                frame = _read(path)
            except (*_DAMAGED, *_DAMAGED_ZIP) as error:
                if path == paths[-1]:
                    return  # the recording was cut off while this frame was written
                raise UsageError(f"this frame cannot be read: {error}", where=str(path)) from error
            if not frame.infrared.shape == frame.depth_m.shape == self._shape:
                raise UsageError(
                    f"this frame is no picture of {self.intrinsics.width} x {self.intrinsics.height} pixels",
                    where=str(path),
                )
            yield frame

    @property
    def _shape(self) -> tuple[int, int]:
        return self.intrinsics.height, self.intrinsics.width


def _capture(header: dict[str, Any]) -> Capture:
    """Return what took a recording; one of version 1 has a serial number only."""
    if "capture" in header:
        return Capture.model_validate_json(json.dumps(header["capture"]))
    serial = str(header["serial"])
    if serial == _SYNTHETIC:
        return Capture(origin="simulated", sensor=_SYNTHETIC, serial=serial)
    return Capture(origin="unknown", sensor="", serial=serial)


def _refuse_wrong(camera: Intrinsics) -> None:
    sizes = (camera.width, camera.height)
    numbers = (camera.fx, camera.fy, camera.cx, camera.cy)
    if not all(isinstance(size, int) and size > 0 for size in sizes) or np.prod(sizes) > _MOST_PIXELS:
        raise ValueError(f"a camera of {sizes[0]} x {sizes[1]} pixels")
    if not np.isfinite(numbers).all() or min(camera.fx, camera.fy) <= 0:
        raise ValueError("focal lengths and principal point are no finite numbers")


def _read(path: Path) -> Frame:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
        return Frame(
            infrared=data["infrared"],
            depth_m=data["depth_m"],
            time_s=float(data["time_s"]),
            clock=str(data["clock"]),
            sequence=int(data["sequence"]),
        )
