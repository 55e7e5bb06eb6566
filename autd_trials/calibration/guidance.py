"""What a person who waves the target should know meanwhile: how much there is, and what is missing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.cloud import ADVISED_POINTS, CELLS, coverage, examine_cloud, lacking_parts
from autd_trials.calibration.pairing import pair_interpolated
from autd_trials.calibration.registration import register_jointly
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError

_MOST_POINTS = 300  # of the first unit that are looked at: enough for a hint, and done in half a second


@dataclass(frozen=True, eq=False)
class Guidance:
    """How the calibration stands.

    Attributes
    ----------
    points
        Sightings of each unit.
    overlap
        Share of the first unit's sightings that every other unit has too and that agree.
    cells
        Points in each cell of the workspace, shape (3, 3, 3); of those looked at.
    residual_mm
        Root mean square between the units; None while there is no pose.
    missing
        What to do, in words; empty when all is well.
    """

    points: tuple[int, ...]
    overlap: float
    cells: NDArray[np.int64]
    residual_mm: float | None
    missing: tuple[str, ...]


def guide(
    tracks: Sequence[Track],
    first_mount: RigidMotion,
    centre_mm: Vectors | None,
    half_mm: float,
    generator: np.random.Generator,
) -> Guidance:
    """Look at what was recorded so far.

    Parameters
    ----------
    tracks
        Each unit's sightings so far, by one clock.
    first_mount
        From the first sensor's frame to its unit's.
    centre_mm, half_mm
        The workspace, a cube in the first unit's frame; around the points themselves if the centre is None.
    generator
        For the robust start.
    """
    points = tuple(len(track.time_s) for track in tracks)
    nothing = np.zeros((CELLS,) * 3, dtype=np.int64)
    few = [track.name for track in tracks if len(track.time_s) < ADVISED_POINTS]
    if few:
        return Guidance(points, 0.0, nothing, None, (f"show the target to {' and '.join(few)}",))
    first = _thinned(tracks[0])
    try:
        observed = [first.points_mm]
        observed += [pair_interpolated(first, track, generator).points_mm for track in tracks[1:]]
        found = register_jointly(np.array(observed), [track.name for track in tracks], generator)
    except UsageError as error:
        return Guidance(points, 0.0, nothing, None, (error.what,))
    shared = found.inliers.all(axis=0)
    places_mm = first_mount.apply(found.places_mm[0][shared])
    middle_mm = np.median(places_mm, axis=0) if centre_mm is None else centre_mm
    cells = coverage(places_mm, middle_mm, half_mm)
    missing = [f"wave it further: {part}" for part in lacking_parts(cells, len(first.time_s) / points[0])]
    try:
        sensors_mm = np.array([first_mount.apply(motion.translation_mm) for motion in found.motions])
        missing += examine_cloud(places_mm, sensors_mm).warnings
    except UsageError as error:
        missing.append(error.what)
    gaps_mm = np.concatenate([found.gaps_mm(unit) for unit in range(1, len(tracks))])
    residual_mm = float(np.sqrt(np.nanmean((gaps_mm**2).sum(axis=1))))
    return Guidance(points, float(shared.mean()), cells, residual_mm, tuple(missing))


def _thinned(track: Track) -> Track:
    step = max(1, -(-len(track.time_s) // _MOST_POINTS))
    return Track(track.name, track.time_s[::step], track.points_mm[::step])
