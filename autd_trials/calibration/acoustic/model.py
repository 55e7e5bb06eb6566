"""The phase lag of a unit's sources at points, and how it moves with pose and points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import UnitPose, Vectors, transducer_positions_mm
from autd_trials.calibration.acoustic.heard import Group

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HeardUnit:
    """What is to be heard of a unit; sources s, points k.

    Attributes
    ----------
    lags_rad
        Phase lag, shape (s, k).
    path_rad
        Length of the path in radians, shape (s, k): what the speed of sound divides.
    by_pose
        Derivative of the lag by the unit's shift in mm and its rotation vector about the pivot, shape (s, k,
        6).
    by_point
        Derivative by the point, in 1/mm, shape (s, k, 3).
    centres_mm
        Middles of the sources, shape (s, 3).
    """

    lags_rad: Array
    path_rad: Array
    by_pose: Array
    by_point: Array
    centres_mm: Vectors


def modelled(
    unit: UnitPose, sources: Sequence[Group], points_mm: Vectors, wave_number: float, pivot_mm: Vectors
) -> HeardUnit:
    """Return what is to be heard; the waves of a group add up as exp(i k r) / r.

    Parameters
    ----------
    unit
        The unit's pose.
    sources
        Numbers of the transducers that emit together.
    points_mm
        Points, shape (k, 3).
    wave_number
        In rad/mm.
    pivot_mm
        About which rotations are counted, shape (3,).
    """
    all_mm = transducer_positions_mm([unit]).reshape(-1, 3)
    members = np.array([number for source in sources for number in source])
    firsts = np.cumsum([0, *(len(source) for source in sources[:-1])])
    places_mm = all_mm[members]
    away_mm = places_mm[:, None] - points_mm[None]
    distances_mm = np.linalg.norm(away_mm, axis=2)
    directions = away_mm / distances_mm[..., None]
    waves = np.exp(1j * wave_number * distances_mm) / distances_mm
    sums = np.add.reduceat(waves, firsts, axis=0)
    of_source = np.repeat(np.arange(len(sources)), [len(source) for source in sources])
    shares = np.real(waves / sums[of_source])  # by how much each member moves its source's phase

    def summed(by_member: Array) -> Array:
        weighted: Array = np.add.reduceat(shares[..., None] * by_member, firsts, axis=0)
        return weighted

    arms = np.broadcast_to((places_mm - pivot_mm)[:, None], directions.shape)
    by_pose = wave_number * np.concatenate([directions, np.cross(arms, directions)], axis=2)
    counts = np.array([len(source) for source in sources])[:, None]
    return HeardUnit(
        lags_rad=np.angle(sums),
        path_rad=summed(wave_number * distances_mm[..., None])[..., 0],
        by_pose=summed(by_pose),
        by_point=summed(-wave_number * directions),
        centres_mm=np.add.reduceat(places_mm, firsts, axis=0) / counts,
    )
