"""Which points of two tracks are the same place of the target: pairing in time, and the clocks' offset."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.robust import Registration, register_robustly
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError

LARGEST_GAP_S = 0.1
"""Nothing is interpolated over a longer gap, and nothing paired over a longer time."""

LARGEST_OFFSET_S = 1.0
"""How far two clocks may be apart."""

_FEWEST_PAIRS = 10
_COARSE_STEP_S = 0.01
_ITERATIONS = 8
_SETTLED_S = 1e-5
_SPIKE_WINDOW = 7  # frames
_SPIKE_FACTOR = 5.0
_SMALLEST_SPIKE_MM = 20.0


@dataclass(frozen=True, eq=False)
class Pairs:
    """A second track at the first one's times.

    `points_mm` (n, 3) and `velocities_mm_s` (n, 3) are NaN where the second track has nothing;
    `clock_offset_s` is what was added to the first one's times to get the second one's.
    """

    points_mm: Vectors
    velocities_mm_s: Vectors
    clock_offset_s: float


def pair_nearest(first: Track, second: Track) -> Pairs:
    """Pair each point with the one nearest in time, as the paper does; the clocks are taken as equal."""
    after = np.clip(np.searchsorted(second.time_s, first.time_s), 1, len(second.time_s) - 1)
    before_s, after_s = second.time_s[after - 1], second.time_s[after]
    nearest = np.where(first.time_s - before_s < after_s - first.time_s, after - 1, after)
    close = np.abs(second.time_s[nearest] - first.time_s) <= LARGEST_GAP_S
    points_mm = np.where(close[:, None], second.points_mm[nearest], np.nan)
    _refuse_few(first, second, points_mm)
    return Pairs(points_mm, np.zeros_like(points_mm), 0.0)


def pair_interpolated(first: Track, second: Track, generator: np.random.Generator) -> Pairs:
    """Interpolate the second track at the first one's times, with the clocks' offset estimated from both.

    The offset is first found from the speeds, which are the same in any frame; then it is refined together
    with the pose: what is left between the tracks along the target's velocity is a difference in time.

    Parameters
    ----------
    first, second
        Tracks of the same target.
    generator
        For the robust registration.

    Raises
    ------
    UsageError
        The tracks have hardly any time in common.
    """
    smooth = _without_spikes(second)
    path = _Path(smooth)
    offset_s = _offset_from_speeds(_without_spikes(first), smooth)
    for _ in range(_ITERATIONS):
        points_mm = path.at(first.time_s + offset_s)
        _refuse_few(first, second, points_mm)
        seen = ~np.isnan(points_mm[:, 0])
        found = register_robustly(points_mm[seen], first.points_mm[seen], generator)
        step_s = _time_step_s(path, first, offset_s, seen, found)
        offset_s += step_s
        if abs(step_s) < _SETTLED_S:
            break
    time_s = first.time_s + offset_s
    return Pairs(path.at(time_s), path.velocity(time_s), offset_s)


class _Path:
    """A track as a smooth path."""

    def __init__(self, track: Track) -> None:
        from scipy.interpolate import Akima1DInterpolator

        self._time_s = track.time_s
        # local, unlike a spline: a wrong point spoils its neighbours only
        self._curve = Akima1DInterpolator(track.time_s, track.points_mm, method="makima")

    def at(self, time_s: NDArray[np.float64]) -> Vectors:
        """Return points, shape (n, 3), NaN outside and in long gaps."""
        after = np.searchsorted(self._time_s, time_s).clip(1, len(self._time_s) - 1)
        inside = (time_s >= self._time_s[0]) & (time_s <= self._time_s[-1])
        short = self._time_s[after] - self._time_s[after - 1] <= LARGEST_GAP_S
        points_mm: Vectors = np.where((inside & short)[:, None], self._curve(time_s), np.nan)
        return points_mm

    def velocity(self, time_s: NDArray[np.float64]) -> Vectors:
        """Return velocities in mm/s, shape (n, 3)."""
        velocity: Vectors = self._curve(time_s, 1)
        return velocity


def _time_step_s(
    path: _Path, first: Track, offset_s: float, seen: NDArray[np.bool_], found: Registration
) -> float:
    """Return by how much the offset should change: the gaps' part along the velocity, by least squares."""
    time_s = (first.time_s + offset_s)[seen][found.inliers]
    gaps_mm = first.points_mm[seen][found.inliers] - found.motion.apply(path.at(time_s))
    velocity = path.velocity(time_s) @ found.motion.rotation.T
    square = float((velocity**2).sum())
    return float((velocity * gaps_mm).sum()) / square if square > 0 else 0.0


def _without_spikes(track: Track) -> Track:
    """Leave out points that lie far from the running median of their neighbours: other reflectors, mostly."""
    from scipy.ndimage import median_filter

    middle_mm = median_filter(track.points_mm, size=(_SPIKE_WINDOW, 1), mode="nearest")
    distances_mm = np.linalg.norm(track.points_mm - middle_mm, axis=1)
    gate_mm = max(_SPIKE_FACTOR * float(np.median(distances_mm)), _SMALLEST_SPIKE_MM)
    kept = distances_mm <= gate_mm
    return Track(track.name, track.time_s[kept], track.points_mm[kept])


def _offset_from_speeds(first: Track, second: Track) -> float:
    """Return the offset with the best correlation of the target's speeds."""
    speeds, times_s = [], []
    for track in (first, second):
        steps_s = np.diff(track.time_s)
        speeds.append(np.linalg.norm(np.diff(track.points_mm, axis=0), axis=1) / steps_s)
        times_s.append((track.time_s[1:] + track.time_s[:-1]) / 2)
    caps = [np.minimum(speed, np.quantile(speed, 0.9)) for speed in speeds]  # outliers are fast
    offsets_s = np.arange(-LARGEST_OFFSET_S, LARGEST_OFFSET_S + 1e-9, _COARSE_STEP_S)
    scores = [_correlation(times_s[0] + offset, caps[0], times_s[1], caps[1]) for offset in offsets_s]
    return float(offsets_s[int(np.argmax(scores))])


def _correlation(
    time_s: NDArray[np.float64],
    values: NDArray[np.float64],
    other_time_s: NDArray[np.float64],
    other: NDArray[np.float64],
) -> float:
    inside = (time_s >= other_time_s[0]) & (time_s <= other_time_s[-1])
    if inside.sum() < _FEWEST_PAIRS:
        return -1.0
    at = np.interp(time_s[inside], other_time_s, other)
    if np.ptp(at) == 0 or np.ptp(values[inside]) == 0:
        return -1.0
    return float(np.corrcoef(values[inside], at)[0, 1])


def _refuse_few(first: Track, second: Track, points_mm: Vectors) -> None:
    pairs = int((~np.isnan(points_mm[:, 0])).sum())
    if pairs < _FEWEST_PAIRS:
        spans = ", ".join(f"{t.name} {t.time_s[0]:g} to {t.time_s[-1]:g} s" for t in (first, second))
        raise UsageError(
            f"{first.name} and {second.name} have {pairs} points in common ({spans})",
            do="record both at the same time, with clocks that differ by less than 1 s",
        )
