"""The same points as all units saw them, from tracks; and what is known of the sensors that saw them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.pairing import pair_interpolated, pair_nearest
from autd_trials.calibration.sensor_model import Sensor
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError

_WIDEST_VIEW_DEG = 150.0


@dataclass(frozen=True, eq=False)
class Sightings:
    """The same points as all units saw them.

    Attributes
    ----------
    names
        Of the units.
    points_mm
        In each sensor's own frame, shape (units, n, 3), in the order of time; NaN where a unit saw none.
    viewpoint
        Whether they were seen from the origin of their frame, if the settings do not say.
    time_s
        The first unit's times, shape (n,); None if nobody knows them.
    velocities_mm_s
        As the points; None to take the pairs as they are.
    clock_offsets_s
        What was added to the first unit's times to get each unit's; None without times.
    """

    names: Sequence[str]
    points_mm: NDArray[np.float64]
    viewpoint: bool
    time_s: NDArray[np.float64] | None = None
    velocities_mm_s: NDArray[np.float64] | None = None
    clock_offsets_s: Vectors | None = None


def paired(tracks: Sequence[Track], settings: Settings, generator: np.random.Generator) -> Sightings:
    """Return what all units saw at the first unit's times."""
    observed, offsets_s = [tracks[0].points_mm], [0.0]
    velocities_mm_s = [np.zeros_like(tracks[0].points_mm)]
    for track in tracks[1:]:
        if settings.pairing == "nearest":
            pairs = pair_nearest(tracks[0], track)
        else:
            pairs = pair_interpolated(tracks[0], track, generator)
        observed.append(pairs.points_mm)
        velocities_mm_s.append(pairs.velocities_mm_s)
        offsets_s.append(pairs.clock_offset_s)
    return Sightings(
        names=[track.name for track in tracks],
        points_mm=np.array(observed),
        viewpoint=True,
        time_s=tracks[0].time_s,
        velocities_mm_s=np.array(velocities_mm_s) if settings.pairing == "interpolated" else None,
        clock_offsets_s=np.array(offsets_s),
    )


def sensors_of(sightings: Sightings, settings: Settings) -> tuple[list[Sensor], list[str]]:
    """Return what is known of each unit's sensor, and which frames turned out to be no camera's."""
    units = len(sightings.names)
    asked = sightings.viewpoint if settings.viewpoint is None else settings.viewpoint
    declared = (asked,) * units if isinstance(asked, bool) else asked
    if len(declared) != units:
        raise UsageError(f"viewpoints are given for {len(declared)} units, there are {units}")
    sensors, strange = [], []
    for name, viewpoint, points_mm in zip(sightings.names, declared, sightings.points_mm, strict=True):
        around = viewpoint and _all_around(points_mm[~np.isnan(points_mm[:, 0])])
        sensors.append(settings.sensor(viewpoint=viewpoint and not around))
        if around:
            strange.append(
                f"the points of {name} lie all around the origin of their frame, where no camera sees them: "
                "it is taken as a frame without a viewpoint"
            )
    return sensors, strange


def _all_around(points_mm: Vectors) -> bool:
    """Return whether so wide a view is no camera's, from the directions but the 5 % farthest off."""
    rays = points_mm / np.maximum(np.linalg.norm(points_mm, axis=1, keepdims=True), 1e-9)
    middle = np.median(rays, axis=0)
    cosines = rays @ middle / max(float(np.linalg.norm(middle)), 1e-9)
    return bool(np.quantile(cosines, 0.05) < np.cos(np.radians(_WIDEST_VIEW_DEG / 2)))
