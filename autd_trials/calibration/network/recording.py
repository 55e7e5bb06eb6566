"""What the master keeps of each unit: raw stamps and the history of clock offsets, written as it comes.

A recording is a folder with ``unit1-raw.csv``, ``unit1-clock.csv``, ``unit1-sensor.json`` (which sensor, and
when) and so on. Lines are added and flushed, never rewritten. Tracks are made from them afterwards, as often
as one likes. Recordings of version 1 have no ``unit1-sensor.json``: where they come from is unknown.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from autd_trials.calibration.provenance import UNKNOWN, Capture, sidecar_path, sidecar_text
from autd_trials.calibration.writing import create_text, writing
from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import lies_at
from autd_trials.tables import Quantity, read_quantities

RAW_COLUMNS = ("t_raw_s", "arrival_s", "run", "sequence", "x_mm", "y_mm", "z_mm", "quality")
CLOCK_COLUMNS = ("t_s", "offset_s")
_SEEN = RAW_COLUMNS[4:]
LONGEST_SILENCE_S = 0.5
"""A longer one is a fault, not a slow frame."""
CLOCK_JUMP_S = 0.05
"""Clocks drift by some hundredths of a millisecond from one comparison to the next; more is a jump."""


@dataclass(frozen=True)
class Sample:
    """One frame's worth from a node; `x_mm`, `y_mm`, `z_mm` are NaN without a sighting."""

    t_raw_s: float
    arrival_s: float
    run: int
    sequence: int
    x_mm: float
    y_mm: float
    z_mm: float
    quality: float

    @property
    def seen(self) -> bool:
        """Whether the target was seen."""
        return not math.isnan(self.x_mm)


class UnitRecording:
    """Writes one unit's files.

    Parameters
    ----------
    folder
        The recording.
    unit
        Number of the unit, from 1.
    capture
        What takes the data, and when.

    Raises
    ------
    UsageError
        There are such files already, or the folder cannot be made.
    DeviceError
        Later: the disk is full or gone, or the files do not lie at their paths any more.
    """

    def __init__(self, folder: Path, unit: int, capture: Capture) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(
                f"the folder of the recording cannot be made: {error.strerror}",
                where=str(folder),
                do="name another one",
            ) from error
        self._folder = folder
        create_text(_sensor_path(folder, unit), capture.model_dump_json(indent=1) + "\n", "recording")
        self._raw = _create(folder / f"unit{unit}-raw.csv", RAW_COLUMNS)
        self._clock = _create(folder / f"unit{unit}-clock.csv", CLOCK_COLUMNS)

    def add(self, samples: list[Sample]) -> None:
        """Write samples down."""
        with self._kept(self._raw):
            for s in samples:
                numbers = f"{s.t_raw_s:.7f},{s.arrival_s:.7f},{s.run},{s.sequence}"
                self._raw.write(f"{numbers},{s.x_mm:.4f},{s.y_mm:.4f},{s.z_mm:.4f},{s.quality:.4f}\n")
            self._raw.flush()

    def add_clock(self, time_s: float, offset_s: float) -> None:
        """Write an offset down: what was to be added to the node's stamps at a time of the master's clock."""
        with self._kept(self._clock):
            self._clock.write(f"{time_s:.7f},{offset_s:.7f}\n")
            self._clock.flush()

    def close(self) -> None:
        """Close the files; what the disk does not take any more has been reported when it was added."""
        for file in (self._raw, self._clock):
            with suppress(OSError):
                file.close()

    @contextmanager
    def _kept(self, file: TextIO) -> Iterator[None]:
        with writing(self._folder, _SAFE):
            yield
        # What is written into a file that was moved, removed or replaced is in nobody's recording.
        if not lies_at(file.fileno(), Path(file.name)):
            raise DeviceError(
                "the recording was moved, removed or replaced while it was written",
                where=file.name,
                do="put it back, then use it with `autd-trials calibrate --recorded FOLDER`, or record again",
            )


_SAFE = (
    "what came before is safe there; free space, then use it with `autd-trials calibrate --recorded FOLDER`, "
    "or record again into a new folder"
)


def recorded_units(folder: Path) -> int:
    """Return how many units a recording has.

    Raises
    ------
    UsageError
        It has none.
    """
    units = 0
    while (folder / f"unit{units + 1}-raw.csv").exists():
        units += 1
    if units == 0:
        raise UsageError("this folder holds no recording: unit1-raw.csv is missing", where=str(folder))
    return units


def recorded_capture(folder: Path, unit: int) -> Capture:
    """Return what took a unit's data, and when; unknown for a recording of version 1.

    Raises
    ------
    UsageError
        The file that says it cannot be read.
    """
    path = _sensor_path(folder, unit)
    try:
        return Capture.model_validate_json(path.read_bytes()) if path.exists() else UNKNOWN
    except OSError as error:
        raise UsageError(f"the recording cannot be read: {error.strerror}", where=str(path)) from error
    except ValidationError as error:
        raise UsageError(
            f"this does not say what was recorded: {error.errors()[0]['msg']}",
            where=str(path),
            do="restore it; without it the origin of the data counts as unknown",
        ) from error


def write_track(folder: Path, unit: int) -> Path:
    """Make a unit's track ``unit1.csv`` from what was recorded, in the master's clock, and return its path.

    Beside it ``unit1.provenance.json`` says where it comes from. A track that is there already must be the
    same; nothing is overwritten.

    Raises
    ------
    UsageError
        The recording cannot be read, another track is there, or the track cannot be written.
    """
    capture = recorded_capture(folder, unit)
    rows = master_times(folder, unit)
    lines = [f"{t:.6f},{x:.4f},{y:.4f},{z:.4f},{quality:.4f}\n" for t, x, y, z, quality in rows]
    text = "t_s,x_mm,y_mm,z_mm,quality\n" + "".join(lines)
    path = folder / f"unit{unit}.csv"
    if capture != UNKNOWN:
        _create_once(sidecar_path(path), sidecar_text(capture, text.encode()))
    _create_once(path, text)
    return path


def master_times(folder: Path, unit: int) -> NDArray[np.float64]:
    """Return sightings in the master's clock in order: t_s, x_mm, y_mm, z_mm, quality; (n, 5).

    Between two offsets of the clocks that differ by a jump, it is unknown which one holds: such sightings are
    left out (`clock_jumps`).
    """
    raw = _read_raw(folder / f"unit{unit}-raw.csv")
    clock = _read_clock(folder, unit)
    seen = raw[~np.isnan(raw[:, 4])]
    time_s, certain = seen[:, 0], np.ones(len(seen), dtype=bool)
    if len(clock):
        time_s = time_s + np.interp(seen[:, 1], clock[:, 0], clock[:, 1])  # by the time of arrival
    for start_s, end_s in clock_jumps(folder, unit):
        certain &= (seen[:, 1] <= start_s) | (seen[:, 1] >= end_s)
    time_s, seen = time_s[certain], seen[certain]
    order = np.argsort(time_s, kind="stable")
    rows = np.column_stack([time_s, seen[:, 4:]])[order]
    rising = np.diff(rows[:, 0], prepend=-np.inf) > 0
    return np.asarray(rows[rising])


def clock_jumps(folder: Path, unit: int) -> list[tuple[float, float]]:
    """Return when a unit's clock jumped: (from, to) in the master's clock."""
    clock = _read_clock(folder, unit)
    jumps = np.flatnonzero(np.abs(np.diff(clock[:, 1])) > CLOCK_JUMP_S)
    return [(float(clock[jump, 0]), float(clock[jump + 1, 0])) for jump in jumps]


def silences(folder: Path, unit: int) -> list[tuple[float, float]]:
    """Return where a unit's stamps have gaps over 0.5 s: (from, to) in the node's clock."""
    raw = _read_raw(folder / f"unit{unit}-raw.csv")
    stamps = raw[:, 0]
    gaps = np.flatnonzero(np.diff(stamps) > LONGEST_SILENCE_S)
    return [(float(stamps[gap]), float(stamps[gap + 1])) for gap in gaps]


def _sensor_path(folder: Path, unit: int) -> Path:
    return folder / f"unit{unit}-sensor.json"


def _create_once(path: Path, text: str) -> None:
    """Write a file unless it is there with this text."""
    try:
        if path.exists():
            if path.read_text(encoding="utf-8", errors="replace") == text:
                return
            raise UsageError("another track is there already", where=str(path), do="move it away")
    except OSError as error:
        raise UsageError(f"the file cannot be read: {error.strerror}", where=str(path)) from error
    create_text(path, text, "track")


def _read_clock(folder: Path, unit: int) -> NDArray[np.float64]:
    return read_quantities(
        folder / f"unit{unit}-clock.csv",
        "history of clock offsets",
        [Quantity(name) for name in CLOCK_COLUMNS],
        advice="seconds",
        unfinished=True,
    )


def _create(path: Path, columns: tuple[str, ...]) -> TextIO:
    try:
        file = path.open("x", encoding="utf-8")
    except FileExistsError:
        raise UsageError("this recording exists already", where=str(path), do="name another folder") from None
    except OSError as error:
        raise UsageError(f"the recording cannot be written: {error}", where=str(path)) from error
    with writing(path, "free space, or name another folder"):
        file.write(",".join(columns) + "\n")
        file.flush()
    return file


def _read_raw(path: Path) -> NDArray[np.float64]:
    """Read raw samples, whose places may be NaN; a last line that was cut off is left out."""
    columns = [Quantity(name, gaps=name in _SEEN) for name in RAW_COLUMNS]
    return read_quantities(path, "recording", columns, unfinished=True)
