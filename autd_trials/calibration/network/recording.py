"""What the master keeps of each unit: raw stamps and the history of clock offsets, written as it comes.

A recording is a folder with ``unit1-raw.csv``, ``unit1-clock.csv`` and so on. Lines are added and flushed,
never rewritten. Tracks are made from them afterwards, as often as one likes.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, read_quantities

RAW_COLUMNS = ("t_raw_s", "arrival_s", "run", "sequence", "x_mm", "y_mm", "z_mm", "quality")
CLOCK_COLUMNS = ("t_s", "offset_s")
_SEEN = RAW_COLUMNS[4:]
LONGEST_SILENCE_S = 0.5
"""A longer one is a fault, not a slow frame."""


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


class UnitRecording:
    """Writes one unit's files.

    Parameters
    ----------
    folder
        The recording.
    unit
        Number of the unit, from 1.

    Raises
    ------
    UsageError
        There are such files already.
    """

    def __init__(self, folder: Path, unit: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._raw = _create(folder / f"unit{unit}-raw.csv", RAW_COLUMNS)
        self._clock = _create(folder / f"unit{unit}-clock.csv", CLOCK_COLUMNS)

    def add(self, samples: list[Sample]) -> None:
        """Write samples down."""
        for s in samples:
            numbers = f"{s.t_raw_s:.7f},{s.arrival_s:.7f},{s.run},{s.sequence}"
            self._raw.write(f"{numbers},{s.x_mm:.4f},{s.y_mm:.4f},{s.z_mm:.4f},{s.quality:.4f}\n")
        self._raw.flush()

    def add_clock(self, time_s: float, offset_s: float) -> None:
        """Write an offset down: what was to be added to the node's stamps at a time of the master's clock."""
        self._clock.write(f"{time_s:.7f},{offset_s:.7f}\n")
        self._clock.flush()

    def close(self) -> None:
        """Close the files."""
        self._raw.close()
        self._clock.close()


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


def write_track(folder: Path, unit: int) -> Path:
    """Make a unit's track ``unit1.csv`` from what was recorded, in the master's clock, and return its path.

    A track that is there already must be the same; nothing is overwritten.

    Raises
    ------
    UsageError
        The recording cannot be read, or another track is there.
    """
    rows = master_times(folder, unit)
    lines = [f"{t:.6f},{x:.4f},{y:.4f},{z:.4f},{quality:.4f}\n" for t, x, y, z, quality in rows]
    text = "t_s,x_mm,y_mm,z_mm,quality\n" + "".join(lines)
    path = folder / f"unit{unit}.csv"
    if path.exists() and path.read_text(encoding="utf-8") != text:
        raise UsageError("another track is there already", where=str(path), do="move it away")
    path.write_text(text, encoding="utf-8")
    return path


def master_times(folder: Path, unit: int) -> NDArray[np.float64]:
    """Return sightings in the master's clock in order: t_s, x_mm, y_mm, z_mm, quality; (n, 5)."""
    raw = _read_raw(folder / f"unit{unit}-raw.csv")
    clock = read_quantities(
        folder / f"unit{unit}-clock.csv",
        "history of clock offsets",
        [Quantity(name) for name in CLOCK_COLUMNS],
        advice="seconds",
        unfinished=True,
    )
    seen = raw[~np.isnan(raw[:, 4])]
    time_s = seen[:, 0]
    if len(clock):
        time_s = time_s + np.interp(seen[:, 1], clock[:, 0], clock[:, 1])  # by the time of arrival
    order = np.argsort(time_s, kind="stable")
    rows = np.column_stack([time_s, seen[:, 4:]])[order]
    rising = np.diff(rows[:, 0], prepend=-np.inf) > 0
    return np.asarray(rows[rising])


def silences(folder: Path, unit: int) -> list[tuple[float, float]]:
    """Return where a unit's stamps have gaps over 0.5 s: (from, to) in the node's clock."""
    raw = _read_raw(folder / f"unit{unit}-raw.csv")
    stamps = raw[:, 0]
    gaps = np.flatnonzero(np.diff(stamps) > LONGEST_SILENCE_S)
    return [(float(stamps[gap]), float(stamps[gap + 1])) for gap in gaps]


def _create(path: Path, columns: tuple[str, ...]) -> TextIO:
    try:
        file = path.open("x", encoding="utf-8")
    except FileExistsError:
        raise UsageError("this recording exists already", where=str(path), do="name another folder") from None
    except OSError as error:
        raise UsageError(f"the recording cannot be written: {error}", where=str(path)) from error
    file.write(",".join(columns) + "\n")
    file.flush()
    return file


def _read_raw(path: Path) -> NDArray[np.float64]:
    """Read raw samples, whose places may be NaN; a last line that was cut off is left out."""
    columns = [Quantity(name, gaps=name in _SEEN) for name in RAW_COLUMNS]
    return read_quantities(path, "recording", columns, unfinished=True)
