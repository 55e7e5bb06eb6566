"""What a microphone heard: single transducers or small groups of a unit, at points of known position.

Two ways to measure, each with a CSV file of its own:

- phases: ``unit,transducers,x_mm,y_mm,z_mm,amplitude_pa,phase_rad``. The microphone is sampled in step with
the
  array's 40 kHz; `phase_rad` is by how much its signal lags behind the drive, up to one constant for a unit.
- amplitudes: ``unit,transducers,reference,step,x_mm,y_mm,z_mm,amplitude_pa``. Source and reference emit
  together, the source's drive lagging by `step` quarters of a period (0, 1, 2 and 3). No phase is needed:
  four amplitudes tell by how much the source lags behind the reference there.

`transducers` counts through a unit, device by device as they are wired (0 to 2240); a group is joined by
``+``.
"""

import cmath
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import DEVICES_PER_UNIT, TRANSDUCERS_PER_DEVICE, Vectors
from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, Table, read_table

PHASE_COLUMNS = ("unit", "transducers", "x_mm", "y_mm", "z_mm", "amplitude_pa", "phase_rad")
AMPLITUDE_COLUMNS = ("unit", "transducers", "reference", "step", "x_mm", "y_mm", "z_mm", "amplitude_pa")
STEPS = 4

_UNIT = Quantity("unit", least=1, largest=1000, whole=True)
_PLACE = tuple(Quantity(name, -10_000, 10_000) for name in ("x_mm", "y_mm", "z_mm"))
_AMPLITUDE = Quantity("amplitude_pa", least=0, largest=1e6)
_PHASE = Quantity("phase_rad")
_STEP = Quantity("step", least=0, largest=STEPS - 1, whole=True)
_TRANSDUCER = re.compile(r"[0-9]{1,6}")
_TRANSDUCERS = DEVICES_PER_UNIT * TRANSDUCERS_PER_DEVICE
_LEAST_AMPLITUDE = 0.05  # of the median: what is weaker is a dead transducer or a shadow
_FEWEST_POINTS = _FEWEST_SOURCES = 6
_MOST_PAIRS = 1_000_000  # of a source and a point

Group = tuple[int, ...]
Point = tuple[float, float, float]
Phasors = dict[tuple[Group, Point], complex]
"""Amplitude and lag of each source at each point."""


@dataclass(frozen=True, eq=False)
class Heard:
    """What was heard of one unit.

    Attributes
    ----------
    unit
        Number of the unit, from 1.
    sources
        Transducers that emitted together.
    points_mm
        Where the microphone was told to be, shape (points, 3), in the calibrated frame.
    lags_rad
        Phase lag of each source at each point, shape (sources, points); NaN where nothing was heard.
    synchronised
        Whether all lags share one unknown constant; if not, each point has a constant of its own.
    """

    unit: int
    sources: tuple[Group, ...]
    points_mm: Vectors
    lags_rad: NDArray[np.float64]
    synchronised: bool


def read_heard(path: Path) -> list[Heard]:
    """Read what a microphone heard, of one unit or several.

    Raises
    ------
    UsageError
        The file cannot be read, has other columns or values, or too few sources or points.
    """
    table = read_table(path, "measurement")
    synchronised = set(PHASE_COLUMNS) <= set(table.header)
    if not synchronised and not set(AMPLITUDE_COLUMNS) <= set(table.header):
        raise UsageError(
            f"the columns are {', '.join(table.header)}",
            where=table.where_header,
            do=f"name them {', '.join(PHASE_COLUMNS)}, or {', '.join(AMPLITUDE_COLUMNS)}",
        )
    rows = _rows(table, synchronised=synchronised)
    if not rows:
        raise UsageError("nothing was measured", where=str(path))
    by_unit: defaultdict[int, list[_Row]] = defaultdict(list)
    for row in rows:
        by_unit[row.unit].append(row)
    phasors = _phasors if synchronised else _phasors_of_steps
    return [
        heard_of(unit, phasors(its_rows), str(path), synchronised=synchronised)
        for unit, its_rows in sorted(by_unit.items())
    ]


def heard_of(unit: int, phasors: Phasors, where: str, *, synchronised: bool) -> Heard:
    """Arrange a unit's phasors by sources and points.

    Sources that are hardly heard somewhere are left out there.

    Raises
    ------
    UsageError
        There are fewer than 6 sources or points, or over 1,000,000 pairs of them.
    """
    sources = sorted({source for source, _ in phasors})
    points = sorted({point for _, point in phasors})
    if len(sources) < _FEWEST_SOURCES or len(points) < _FEWEST_POINTS:
        raise UsageError(
            f"unit {unit} was heard with {len(sources)} sources at {len(points)} points",
            where=where,
            do="measure 54 sources (6 a device) at 32 points; at least "
            f"{_FEWEST_SOURCES} at {_FEWEST_POINTS} are needed for a pose",
        )
    if len(sources) * len(points) > _MOST_PAIRS:
        raise UsageError(
            f"unit {unit} was heard with {len(sources)} sources at {len(points)} points, too many to fit",
            where=where,
            do="measure all sources at the same points",
        )
    table = np.array([[phasors.get((source, point), 0) for point in points] for source in sources])
    heard = np.abs(table) > _LEAST_AMPLITUDE * np.median(np.abs(table[table != 0]))
    lags_rad = np.where(heard, np.angle(table), np.nan)
    return Heard(unit, tuple(sources), np.array(points), lags_rad, synchronised)


@dataclass(frozen=True)
class _Row:
    unit: int
    source: Group
    reference: Group
    step: int
    point: Point
    amplitude_pa: float
    phase_rad: float
    where: str


def _rows(table: Table, *, synchronised: bool) -> list[_Row]:
    columns = [_UNIT, *_PLACE, _AMPLITUDE, _PHASE if synchronised else _STEP]
    numbers = table.quantities(columns).tolist()
    sources = table.column("transducers")
    references = [""] * len(sources) if synchronised else table.column("reference")
    return [
        _Row(
            unit=int(unit),
            source=_group(source, table.where(row)),
            reference=() if synchronised else _group(reference, table.where(row)),
            step=0 if synchronised else int(last),
            point=(x_mm, y_mm, z_mm),
            amplitude_pa=amplitude_pa,
            phase_rad=last if synchronised else 0.0,
            where=table.where(row),
        )
        for row, ((unit, x_mm, y_mm, z_mm, amplitude_pa, last), source, reference) in enumerate(
            zip(numbers, sources, references, strict=True)
        )
    ]


def _group(text: str, where: str) -> Group:
    parts = [part.strip() for part in text.split("+")]
    if not all(_TRANSDUCER.fullmatch(part) and int(part) < _TRANSDUCERS for part in parts):
        raise UsageError(
            f"{text[:40]!r} names no transducers",
            where=where,
            do=f"number them 0 to {_TRANSDUCERS - 1}; join a group by +",
        )
    return tuple(sorted(int(part) for part in parts))


def _phasors(rows: list[_Row]) -> Phasors:
    return {(row.source, row.point): cmath.rect(row.amplitude_pa, row.phase_rad) for row in rows}


def _phasors_of_steps(rows: list[_Row]) -> Phasors:
    """Turn four amplitudes into amplitude and lag behind the reference, whose own lag is 0 by definition.

    With lag d, the squared amplitude at step s is constant + 2 a b cos(d + s pi / 2).
    """
    reference = rows[0].reference
    steps: defaultdict[tuple[Group, Point], dict[int, float]] = defaultdict(dict)
    for row in rows:
        if row.reference != reference:
            raise UsageError(
                "another reference than in the unit's first line",
                where=row.where,
                do="measure all sources of a unit against one reference",
            )
        steps[row.source, row.point][row.step] = row.amplitude_pa**2
    phasors: Phasors = {}
    for (source, point), power in steps.items():
        if len(power) < STEPS:
            missing = ", ".join(str(step) for step in range(STEPS) if step not in power)
            name = "+".join(map(str, source))
            raise UsageError(f"source {name} at {point} lacks step {missing}", where=rows[0].where)
        phasors[source, point] = complex(power[0] - power[2], power[3] - power[1])
    typical = float(np.median(np.abs(list(phasors.values()))))
    phasors |= {(reference, point): complex(typical) for _, point in steps}
    return phasors
