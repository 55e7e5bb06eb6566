"""Which points of two tracks are the same place of the target: pairing in time, and the clocks' offset."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.robust import Registration, register_robustly
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError

LARGEST_GAP_S = 0.1
"""Nothing is interpolated over a longer gap, and nothing paired over a longer time."""

LARGEST_OFFSET_S = 5.0
"""How far two clocks may be apart."""

_FEWEST_PAIRS = 10
_GRID_S = 0.01
_SPEED_S = 0.1  # speeds and velocities are taken over so long: noise of single points matters little then
_LEAST_OVERLAP_S = 3.0
_LONGEST_FRAME_S = 1.0
_MOST_GRID = 60_000  # ten minutes of speeds are enough to find the offset
_PARTS, _POINTS_IN_A_PART = 10, 60
_LARGEST_CLOCK_STEP_S, _CLOCK_GRID_S = 2.0, 0.04
_CLOCK_STEP_FACTOR = 3.0
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
    for track in (first, second):
        _refuse_other_times(track)
    smooth = _without_spikes(second)
    path = _Path(smooth)
    offset_s = _offset_from_speeds(_without_spikes(first), smooth)
    motion = None
    for _ in range(_ITERATIONS):
        points_mm = path.at(first.time_s + offset_s)
        _refuse_few(first, second, points_mm)
        seen = ~np.isnan(points_mm[:, 0])
        found = register_robustly(points_mm[seen], first.points_mm[seen], generator, motion)
        motion = found.motion
        step_s = _time_step_s(path, first, offset_s, seen, found)
        offset_s += step_s
        if abs(step_s) < _SETTLED_S:
            break
    _refuse_clock_steps(path, first, second, offset_s, found.motion)
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
        points_mm: Vectors = np.where((inside & short)[..., None], self._curve(time_s), np.nan)
        return points_mm

    def velocity(self, time_s: NDArray[np.float64]) -> Vectors:
        """Return velocities in mm/s, shape (n, 3), which do not depend on the noise of the points at hand."""
        before, after = (
            (time_s + side * _SPEED_S).clip(self._time_s[0], self._time_s[-1]) for side in (-1, 1)
        )
        apart_s = np.maximum(after - before, _SPEED_S)
        velocity: Vectors = (self._curve(after) - self._curve(before)) / apart_s[:, None]
        return velocity


def _time_step_s(
    path: _Path, first: Track, offset_s: float, seen: NDArray[np.bool_], found: Registration
) -> float:
    """Return by how much the offset should change, by least squares over time and pose together."""
    time_s = (first.time_s + offset_s)[seen][found.inliers]
    places_mm = found.motion.apply(path.at(time_s))
    gaps_mm = first.points_mm[seen][found.inliers] - places_mm
    velocity = path.velocity(time_s) @ found.motion.rotation.T
    arms = places_mm - places_mm.mean(axis=0)
    turns = np.cross(np.eye(3), arms[:, None, :]).transpose(0, 2, 1)
    shifts = np.broadcast_to(np.eye(3), turns.shape)
    moves = np.concatenate([velocity[:, :, None], turns, shifts], axis=2)
    step: Vectors = np.linalg.lstsq(moves.reshape(-1, 7), gaps_mm.ravel(), rcond=None)[0]
    return float(step[0])


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
    start, speed = _speeds(first)
    other_start, other = _speeds(second)
    least = min(int(_LEAST_OVERLAP_S / _GRID_S), len(speed) // 2, len(other) // 2)
    most = round(LARGEST_OFFSET_S / _GRID_S)
    steps = range(-most, most + 1)
    scores = [_correlation(speed, other, start + step - other_start, least) for step in steps]
    return steps[int(np.argmax(scores))] * _GRID_S


def _speeds(track: Track) -> tuple[int, NDArray[np.float64]]:
    """Return the target's speed at multiples of the grid's step, and which multiple is the first."""
    start, end = int(np.ceil(track.time_s[0] / _GRID_S)), int(track.time_s[-1] / _GRID_S)
    if end - start > _MOST_GRID:
        end = start + _MOST_GRID
    time_s = np.arange(start, end + 1) * _GRID_S
    half_s = _SPEED_S / 2
    ends = [
        np.stack([np.interp(time_s + side * half_s, track.time_s, axis) for axis in track.points_mm.T])
        for side in (-1, 1)
    ]
    speed = np.linalg.norm(ends[1] - ends[0], axis=0)
    return start, np.minimum(speed, np.quantile(speed, 0.9)) if len(speed) else speed  # outliers are fast


def _correlation(first: NDArray[np.float64], second: NDArray[np.float64], ahead: int, least: int) -> float:
    """Return the correlation of two rows of values, the first of which starts so much after the second."""
    one = first[max(0, -ahead) : len(second) - ahead]
    other = second[max(0, ahead) : max(0, ahead) + len(one)]
    if len(one) < max(least, _FEWEST_PAIRS) or np.ptp(one) == 0 or np.ptp(other) == 0:
        return -1.0
    return float(np.corrcoef(one, other)[0, 1])


def _refuse_few(first: Track, second: Track, points_mm: Vectors) -> None:
    pairs = int((~np.isnan(points_mm[:, 0])).sum())
    if pairs < _FEWEST_PAIRS:
        spans = ", ".join(f"{t.name} {t.time_s[0]:g} to {t.time_s[-1]:g} s" for t in (first, second))
        raise UsageError(
            f"{first.name} and {second.name} have {pairs} points in common ({spans})",
            do=f"record both at the same time, with clocks that differ by less than {LARGEST_OFFSET_S:g} s",
        )


def _refuse_other_times(track: Track) -> None:
    frame_s = float(np.median(np.diff(track.time_s)))
    if frame_s > _LONGEST_FRAME_S:
        raise UsageError(
            f"the points of {track.name} follow each other every {frame_s:.3g} s, which looks like "
            "milliseconds",
            do="give t_s in seconds; points without times go in as pairs",
        )


def _refuse_clock_steps(
    path: _Path, first: Track, second: Track, offset_s: float, motion: RigidMotion
) -> None:
    """Refuse a second clock that differs from part to part of the recording."""
    most = round(_LARGEST_CLOCK_STEP_S / _CLOCK_GRID_S)
    steps_s = np.arange(-most, most + 1) * _CLOCK_GRID_S
    for part in np.array_split(np.arange(len(first.time_s)), _PARTS):
        some = part[:: max(1, len(part) // _POINTS_IN_A_PART)]
        others_mm = motion.apply(path.at(first.time_s[some] + offset_s + steps_s[:, None]))
        gaps_mm = _median_gaps(np.linalg.norm(first.points_mm[some] - others_mm, axis=-1))
        best = int(np.argmin(gaps_mm))
        now_mm = gaps_mm[most]
        stepped = abs(steps_s[best]) > _CLOCK_GRID_S and gaps_mm[best] < now_mm / _CLOCK_STEP_FACTOR
        if stepped and np.isfinite(now_mm):
            raise UsageError(
                f"the clock of {second.name} is not steady: from about {first.time_s[part[0]]:.0f} s on its "
                f"points fit {steps_s[best]:+.2f} s later than elsewhere",
                do="record again with clocks that nobody sets meanwhile, or cut the tracks where it stepped",
            )


def _median_gaps(distances_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each row's median; infinite if less than half of it is there."""
    there = ~np.isnan(distances_mm)
    enough = 2 * there.sum(axis=1) > distances_mm.shape[1]
    medians = np.full(len(distances_mm), np.inf)
    if enough.any():
        medians[enough] = np.nanmedian(distances_mm[enough], axis=1)
    return medians
