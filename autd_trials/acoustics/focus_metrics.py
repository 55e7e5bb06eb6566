"""How good a focus is: where its maximum lies, how large it is, how strong, and what else there is."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.field import grid_pressure
from autd_trials.acoustics.grid import Grid, box_grid
from autd_trials.acoustics.level import (
    disc_force_mn,
    energy_density_j_m3,
    shock_distance_mm,
    sound_level_db,
)
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium, Sources, Vectors
from autd_trials.errors import UsageError

PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""The planes through the focus and the axes of the calibrated frame that span them."""

DISC_MM = 13.0
"""Diameter of the disc for the radiation force: that of the paper's focus at B."""

_THRESHOLD = 1 / math.sqrt(2)
_SEARCH_MM, _SEARCH_STEP_MM = 100.0, 1.5
_REFINEMENTS = ((6.0, 0.5), (1.5, 0.125))
_SMALLEST_MM, _LARGEST_MM = 50.0, 800.0
_STEP_MM = 0.5
_DEPTH_STEP_MM = 0.25


@dataclass(frozen=True)
class SideLobe:
    """A region beside the focus that is over 1 / sqrt 2 of its energy density, in one plane.

    `level_db` is its maximum re that of the focus, `distance_mm` how far away that maximum lies.
    """

    level_db: float
    distance_mm: float


@dataclass(frozen=True)
class FocusMetrics:
    """A focus in figures; energy densities by p_rms^2 / (rho c^2), linear theory.

    `diameters_mm` are the largest chords of the focus per plane through the maximum: of the connected region
    around it over 1 / sqrt 2 of its energy density. `depth_mm` is that region's length along the beams' mean
    direction. `side_lobes` are the other regions over that energy density in these planes, the strongest
    first: crossed beams have fringes. `side_lobe_db` is the highest other maximum in these planes,
    `grating_lobe_db` the highest level in the first grating lobes' directions as far away as the focus, both
    in dB re the maximum; None if there is none.
    """

    focus_mm: tuple[float, float, float]
    maximum_mm: tuple[float, float, float]
    shift_mm: float
    energy_density_max_j_m3: float
    energy_density_focus_j_m3: float
    energy_at_focus: float
    level_max_db: float
    diameters_mm: dict[str, float]
    side_lobes: dict[str, tuple[SideLobe, ...]]
    depth_mm: float
    side_lobe_db: float | None
    grating_lobe_db: float | None
    disc_force_mn: float
    shock_distance_mm: float

    @property
    def linear_is_upper_bound(self) -> bool:
        """Whether air would saturate before the sound has passed the focus."""
        return self.shock_distance_mm < self.depth_mm


def focus_metrics(sources: Sources, air: Air, focus_mm: Vectors) -> FocusMetrics:
    """Measure the field around a focus.

    Parameters
    ----------
    sources
        What emits.
    air
        The air; its medium has the transducers' directivity and the absorption.
    focus_mm
        Where the focus was asked for, in mm, shape (3,). The maximum is looked for within 50 mm of it.

    Raises
    ------
    UsageError
        If nothing arrives there, or points around it lie inside a transducer.
    """
    medium = Medium.of(air)
    maximum_mm = locate_maximum(sources, medium, focus_mm)
    peak_pa, asked_pa = reference_pressure(sources, medium, np.array([maximum_mm, focus_mm]))
    if abs(peak_pa) == 0:
        raise UsageError("nothing is emitted towards the focus", do="check the poses and the focus")
    e_max, e_focus = energy_density_j_m3(np.array([peak_pa, asked_pa]), air)
    planes = {name: _plane(sources, medium, maximum_mm, axes) for name, axes in PLANES.items()}
    lobes = {name: _lobes(grid, energy) for name, (grid, energy) in planes.items()}
    return FocusMetrics(
        focus_mm=_triple(focus_mm),
        maximum_mm=_triple(maximum_mm),
        shift_mm=float(np.linalg.norm(maximum_mm - focus_mm)),
        energy_density_max_j_m3=float(e_max),
        energy_density_focus_j_m3=float(e_focus),
        energy_at_focus=float(e_focus / e_max),
        level_max_db=float(sound_level_db(np.array([peak_pa]))[0]),
        diameters_mm={name: largest_chord_mm(grid, energy) for name, (grid, energy) in planes.items()},
        side_lobes=lobes,
        depth_mm=_depth_mm(sources, medium, maximum_mm),
        side_lobe_db=_side_lobe_db([energy for _, energy in planes.values()]),
        grating_lobe_db=_grating_lobe_db(sources, medium, focus_mm, abs(peak_pa)),
        disc_force_mn=focus_force_mn(sources, air, focus_mm),
        shock_distance_mm=shock_distance_mm(abs(peak_pa), air),
    )


def locate_maximum(sources: Sources, medium: Medium, near_mm: Vectors) -> Vectors:
    """Return where the pressure is largest within 50 mm of a point, to 0.1 mm or better; shape (3,)."""
    place_mm = np.asarray(near_mm, dtype=np.float64)
    for width_mm, step_mm in ((_SEARCH_MM, _SEARCH_STEP_MM), *_REFINEMENTS):
        cube = box_grid(place_mm, np.eye(3), width_mm=width_mm, step_mm=step_mm)
        strength = np.abs(grid_pressure(sources, medium, cube))
        index = tuple(int(i) for i in np.unravel_index(int(strength.argmax()), strength.shape))
        place_mm = cube.origin_mm + np.array(index) @ cube.steps_mm
    return _vertex(place_mm, strength, index, step_mm)


def focus_force_mn(sources: Sources, air: Air, focus_mm: Vectors, disc_mm: float = DISC_MM) -> float:
    """Return the radiation force in mN on a disc around the focus that faces the devices.

    Parameters
    ----------
    sources, air
        What emits into what.
    focus_mm
        The disc's middle in mm, shape (3,).
    disc_mm
        The disc's diameter in mm.
    """
    points_mm = focus_mm + _disc(disc_mm) @ _across(_mean_direction(sources, focus_mm))
    energy = energy_density_j_m3(reference_pressure(sources, Medium.of(air), points_mm), air)
    return disc_force_mn(float(energy.mean()), disc_mm)


def largest_chord_mm(grid: Grid, energy: NDArray[np.float64], threshold: float = _THRESHOLD) -> float:
    """Return the largest distance in mm between points of the connected region around a plane's maximum.

    Parameters
    ----------
    grid
        A plane.
    energy
        Values on it.
    threshold
        Of the energy in the region, relative to the largest value.
    """
    from scipy.spatial.distance import pdist

    level = threshold * energy.max()
    regions = _regions(energy, threshold)
    focus = regions == regions.flat[energy.argmax()]
    rim = np.vstack([_crossings(energy, focus, level), _crossings(energy.T, focus.T, level)[:, ::-1]])
    if len(rim) < 2:
        return 0.0
    return float(pdist(_hull(rim) @ grid.steps_mm).max())


def _plane(
    sources: Sources, medium: Medium, centre_mm: Vectors, axes: tuple[int, int]
) -> tuple[Grid, NDArray[np.float64]]:
    """Return the squared pressure on a plane that holds the whole region over the threshold."""
    width_mm = _SMALLEST_MM
    while True:
        grid = box_grid(centre_mm, np.eye(3)[list(axes)], width_mm=width_mm, step_mm=_STEP_MM)
        energy = np.abs(grid_pressure(sources, medium, grid)) ** 2
        over = energy > _THRESHOLD * energy.max()
        if width_mm >= _LARGEST_MM or not (over[[0, -1]].any() or over[:, [0, -1]].any()):
            return grid, energy
        width_mm *= 2


def _regions(energy: NDArray[np.float64], threshold: float = _THRESHOLD) -> NDArray[np.int64]:
    """Return the number of the connected region over a threshold that each point is in; 0 for none."""
    from scipy.ndimage import label

    regions: NDArray[np.int64] = np.asarray(label(energy > threshold * energy.max())[0], dtype=np.int64)
    return regions


def _lobes(grid: Grid, energy: NDArray[np.float64]) -> tuple[SideLobe, ...]:
    """Return the regions over the threshold beside the one of the maximum, the strongest first."""
    regions = _regions(energy)
    peak = np.unravel_index(energy.argmax(), energy.shape)
    lobes = []
    for number in set(range(1, int(regions.max()) + 1)) - {int(regions[peak])}:
        place = np.unravel_index(np.where(regions == number, energy, 0).argmax(), energy.shape)
        away = np.array(place) - np.array(peak)
        lobes.append(
            SideLobe(
                level_db=float(10 * np.log10(energy[place] / energy[peak])),
                distance_mm=float(np.linalg.norm(away @ grid.steps_mm)),
            )
        )
    return tuple(sorted(lobes, key=lambda lobe: -lobe.level_db))


def _crossings(energy: NDArray[np.float64], inside: NDArray[np.bool_], level: float) -> Vectors:
    """Return where a region's rim crosses the steps along the first axis, in indices, shape (n, 2).

    A neighbour that is outside the region lies under the level, else it would be connected to it.
    """
    before, after = energy[:-1], energy[1:]
    rows, columns = np.nonzero(inside[:-1] != inside[1:])
    share = (level - before[rows, columns]) / (after[rows, columns] - before[rows, columns])
    return np.column_stack([rows + share, columns])


def _hull(points: Vectors) -> Vectors:
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners: Vectors = points[ConvexHull(points).vertices]
    except QhullError:  # all on a line
        return points
    return corners


def _vertex(
    place_mm: Vectors, strength: NDArray[np.float64], index: tuple[int, ...], step_mm: float
) -> Vectors:
    """Return the vertex of the parabolas through the largest value and its neighbours along each axis."""
    moved_mm = place_mm.copy()
    for axis, position in enumerate(index):
        if 0 < position < strength.shape[axis] - 1:
            at = [(*index[:axis], position + side, *index[axis + 1 :]) for side in (-1, 0, 1)]
            left, middle, right = (strength[place] for place in at)
            curvature = left - 2 * middle + right
            moved_mm[axis] += step_mm * (left - right) / (2 * curvature) if curvature < 0 else 0.0
    return moved_mm


def _depth_mm(sources: Sources, medium: Medium, maximum_mm: Vectors) -> float:
    """Return how long the energy stays over the threshold along the beams' mean direction."""
    direction = _mean_direction(sources, maximum_mm)
    line = box_grid(maximum_mm, direction[None], width_mm=_LARGEST_MM, step_mm=_DEPTH_STEP_MM)
    energy = np.abs(grid_pressure(sources, medium, line)) ** 2
    over = energy > _THRESHOLD * energy[len(energy) // 2]
    below = np.flatnonzero(~over)
    middle = len(energy) // 2
    first = below[below < middle].max(initial=0)
    last = below[below > middle].min(initial=len(energy) - 1)
    return float((last - first - 1) * _DEPTH_STEP_MM)


def _side_lobe_db(planes: Sequence[NDArray[np.float64]]) -> float | None:
    from scipy.ndimage import maximum_filter

    levels_db = []
    for energy in planes:
        peaks = np.sort(energy[(energy == maximum_filter(energy, size=5)) & (energy > 0)])
        levels_db += [float(10 * np.log10(peaks[-2] / peaks[-1]))] if len(peaks) > 1 else []
    return max(levels_db, default=None)


def _grating_lobe_db(sources: Sources, medium: Medium, focus_mm: Vectors, peak_pa: float) -> float | None:
    """Return the largest level in the directions of the first grating lobes, as far away as the focus."""
    points_mm = [
        p for d in range(len(sources.origins_mm)) for p in _grating_lobes(sources, medium, d, focus_mm)
    ]
    if not points_mm:
        return None
    strengths = np.abs(reference_pressure(sources, medium, np.array(points_mm)))
    return float(20 * np.log10(max(strengths.max() / peak_pa, 1e-12)))


def _grating_lobes(sources: Sources, medium: Medium, device: int, focus_mm: Vectors) -> list[Vectors]:
    """Return where a device's first grating lobes pass, seen from its middle."""
    rotation = sources.rotations[device]
    middle_mm = sources.positions_mm[device].mean(axis=0)
    way_mm = rotation.T @ (focus_mm - middle_mm)
    distance_mm = float(np.linalg.norm(way_mm))
    sines = way_mm[:2] / distance_mm
    shift = 1 / (medium.turns_per_mm * _pitch_mm(sources.places_mm))
    lobes = [sines + shift * np.array(order) for order in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    return [
        middle_mm + distance_mm * rotation @ np.append(lobe, math.sqrt(1 - lobe @ lobe))
        for lobe in lobes
        if lobe @ lobe < 1
    ]


def _pitch_mm(places_mm: Vectors) -> float:
    columns = np.unique(np.round(places_mm[:, 0], 3))
    return float(np.diff(columns).min()) if len(columns) > 1 else math.inf


def _mean_direction(sources: Sources, point_mm: Vectors) -> Vectors:
    """Return the mean direction from the devices to a point, a unit vector, shape (3,)."""
    ways_mm = point_mm - sources.positions_mm.mean(axis=1)
    direction = (ways_mm / np.linalg.norm(ways_mm, axis=1, keepdims=True)).sum(axis=0)
    length = np.linalg.norm(direction)
    return direction / length if length > 0 else np.array([0.0, 0.0, 1.0])


def _across(direction: Vectors) -> Vectors:
    """Return two unit vectors across a direction, shape (2, 3)."""
    basis: Vectors = np.linalg.svd(direction[None])[2]
    return basis[1:]


def _disc(diameter_mm: float) -> Vectors:
    """Return points spread evenly over a disc about the origin, shape (n, 2)."""
    steps = np.arange(-diameter_mm / 2, diameter_mm / 2 + 1e-9, diameter_mm / 12)
    points = np.array([(x, y) for x in steps for y in steps])
    inside: Vectors = points[np.hypot(*points.T) <= diameter_mm / 2]
    return inside


def _triple(vector: Vectors) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
