"""What a wrong pose costs: the energy that is left at the target when the driver believes other poses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium
from autd_trials.array.emission import focused_sources
from autd_trials.array.geometry import UnitPose, Vectors, moved

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
POSITION_ERRORS_MM = (0.3, 1.0, 1.8, 3.0, 5.0, 10.0, 20.0)
ANGLE_ERRORS_DEG = (0.03, 0.1, 0.3, 1.0)

ErrorKind = Literal["position_mm", "angle_deg"]


@dataclass(frozen=True)
class ErrorCost:
    """Energy left at the target, relative to right poses, over random directions of an error of one size.

    `quantiles` are those of `QUANTILES`.
    """

    kind: ErrorKind
    size: float
    draws: int
    mean: float
    quantiles: tuple[float, ...]


def energy_left(
    units: Sequence[UnitPose],
    believed: Sequence[UnitPose],
    target_mm: tuple[float, float, float],
    air: Air,
) -> float:
    """Return the energy density at a target relative to that with the poses known.

    Parameters
    ----------
    units
        Where the units stand.
    believed
        Where the driver takes them to stand.
    target_mm
        The target in mm in the calibrated frame.
    air
        The air.
    """
    return target_energy(units, believed, target_mm, air) / target_energy(units, units, target_mm, air)


def target_energy(
    units: Sequence[UnitPose], believed: Sequence[UnitPose], target_mm: tuple[float, float, float], air: Air
) -> float:
    """Return the squared pressure at a target in Pa^2; parameters as for `energy_left`."""
    sources = focused_sources(units, target_mm, speed_of_sound_m_s=air.speed_of_sound_m_s, believed=believed)
    return float(abs(reference_pressure(sources, Medium.of(air), np.array([target_mm]))[0]) ** 2)


def error_budget(
    units: Sequence[UnitPose],
    target_mm: tuple[float, float, float],
    air: Air,
    generator: np.random.Generator,
    *,
    draws: int,
    progress: Callable[[float], None] = lambda _share: None,
) -> list[ErrorCost]:
    """Return what errors of several sizes cost, in position and in angle, one at a time.

    Every unit but the first, whose frame is the calibrated one, gets an error of that size in a random
    direction: a shift, or a turn about its centre.

    Parameters
    ----------
    units
        Where the units stand.
    target_mm
        The target in mm in the calibrated frame.
    air
        The air.
    generator
        Where the directions come from.
    draws
        How many directions are drawn for each size.
    progress
        Told how far it is, 0 to 1.
    """
    best = target_energy(units, units, target_mm, air)
    costs = []
    sizes: list[tuple[ErrorKind, float]] = [("position_mm", size) for size in POSITION_ERRORS_MM]
    sizes += [("angle_deg", size) for size in ANGLE_ERRORS_DEG]
    for number, (kind, size) in enumerate(sizes, start=1):
        left = [
            target_energy(_disturbed(units, kind, size, generator), units, target_mm, air) / best
            for _ in range(draws)
        ]
        quantiles = tuple(float(q) for q in np.quantile(left, QUANTILES))
        costs.append(ErrorCost(kind, size, draws, float(np.mean(left)), quantiles))
        progress(number / len(sizes))
    return costs


def _disturbed(
    units: Sequence[UnitPose], kind: ErrorKind, size: float, generator: np.random.Generator
) -> list[UnitPose]:
    def move(unit: UnitPose) -> UnitPose:
        error = size * _random_direction(generator)
        none = np.zeros(3)
        return moved(unit, error, none) if kind == "position_mm" else moved(unit, none, error)

    return [units[0], *map(move, units[1:])]


def _random_direction(generator: np.random.Generator) -> Vectors:
    vector = generator.standard_normal(3)
    direction: Vectors = vector / np.linalg.norm(vector)
    return direction
