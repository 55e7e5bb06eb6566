"""What is said of a focus, against published and independently computed numbers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.acoustics.focus_metrics import (
    focus_force_mn,
    focus_metrics,
    largest_chord_mm,
    locate_maximum,
)
from autd_trials.acoustics.grid import Grid, box_grid
from autd_trials.acoustics.level import energy_density_j_m3
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Vectors
from autd_trials.errors import UsageError
from tests.acoustics.conftest import AIR, B_MM, MEDIUM, two_units

C_MM = np.array([302.0, 225.0, 1500.0])


@pytest.mark.parametrize(
    ("angle_deg", "at_b", "at_c"),
    [
        (40.0, (12, 26, 12), (16, 56, 23)),
        (70.0, (12, 15, 12), (16, 29.6, 15)),
    ],
)
def test_sizes_agree_with_an_independent_computation(
    angle_deg: float, at_b: tuple[float, ...], at_c: tuple[float, ...]
) -> None:
    """Two units turned about the point midway before them; largest chords in xy, xz, yz."""
    for focus_mm, expected in ((B_MM, at_b), (C_MM, at_c)):
        metrics = focus_metrics(two_units(angle_deg, focus_mm), AIR, focus_mm)
        found = [metrics.diameters_mm[plane] for plane in ("xy", "xz", "yz")]
        assert found[0] == pytest.approx(expected[0], rel=0.12)
        assert max(found) <= 1.3 * max(expected)


def test_one_unit_makes_a_long_focus() -> None:
    metrics = focus_metrics(two_units(0.0, units=1), AIR, B_MM)
    assert metrics.diameters_mm["xy"] == pytest.approx(12.2, abs=0.5)
    assert metrics.diameters_mm["xz"] == pytest.approx(119, rel=0.05)
    assert metrics.diameters_mm["yz"] == pytest.approx(114, rel=0.05)
    assert metrics.depth_mm == pytest.approx(115, rel=0.1)


def test_the_papers_sizes_at_75_degrees() -> None:
    """13 mm at B and 30 mm at C (the paper's section 4.2); B's xz plane comes out longer."""
    at_b = focus_metrics(two_units(75.0), AIR, B_MM)
    assert at_b.diameters_mm["xy"] == pytest.approx(13, abs=1)
    assert at_b.diameters_mm["yz"] == pytest.approx(13, abs=1)
    assert max(at_b.diameters_mm.values()) < 17
    at_c = focus_metrics(two_units(75.0, C_MM), AIR, C_MM)
    assert max(at_c.diameters_mm.values()) == pytest.approx(30, abs=4)


def test_the_maximum_is_found_to_a_tenth_of_a_millimetre() -> None:
    """Against a search by a general-purpose optimiser on the plain solver."""
    from scipy.optimize import minimize

    sources = two_units(75.0, B_MM + np.array([3.37, -2.18, 4.61]))
    found = locate_maximum(sources, MEDIUM, B_MM)

    def weakness(place_mm: Vectors) -> float:
        return -float(np.abs(reference_pressure(sources, MEDIUM, place_mm[None]))[0])

    best = minimize(weakness, found, method="Nelder-Mead", tol=1e-4)
    assert np.abs(found - best.x).max() < 0.1
    assert np.abs(found - (B_MM + np.array([3.37, -2.18, 4.61]))).max() < 0.5


def test_metrics_are_of_the_field() -> None:
    sources = two_units(75.0)
    metrics = focus_metrics(sources, AIR, B_MM)
    at_focus = energy_density_j_m3(reference_pressure(sources, MEDIUM, B_MM[None]), AIR)[0]
    assert metrics.energy_density_focus_j_m3 == pytest.approx(at_focus)
    assert metrics.energy_at_focus == pytest.approx(at_focus / metrics.energy_density_max_j_m3)
    assert metrics.level_max_db == pytest.approx(175.3, abs=0.2)
    assert metrics.shock_distance_mm == pytest.approx(10, abs=1)
    assert metrics.linear_is_upper_bound
    assert metrics.side_lobe_db is not None
    assert metrics.grating_lobe_db is not None
    assert -5 < metrics.side_lobe_db < 0, "the fringes of two beams"
    assert -30 < metrics.grating_lobe_db < -5


def test_a_faint_focus_is_linear() -> None:
    loud = two_units(75.0)
    faint = loud.with_amplitudes(loud.amplitudes_pa_mm / 50)
    assert not focus_metrics(faint, AIR, B_MM).linear_is_upper_bound


def test_force_is_the_mean_energy_density_times_the_discs_area() -> None:
    sources = two_units(75.0)
    tiny = focus_force_mn(sources, AIR, B_MM, disc_mm=0.2)
    at_focus = energy_density_j_m3(reference_pressure(sources, MEDIUM, B_MM[None]), AIR)[0]
    assert tiny == pytest.approx(at_focus * math.pi * 0.1**2 / 1000, rel=0.01)
    assert focus_force_mn(sources, AIR, B_MM) < at_focus * math.pi * 6.5**2 / 1000


def test_chords_of_known_shapes() -> None:
    grid = box_grid(np.zeros(3), np.eye(3)[:2], width_mm=40, step_mm=0.5)
    x, y = grid.points_mm[:, 0].reshape(grid.counts), grid.points_mm[:, 1].reshape(grid.counts)
    round_spot = np.exp(-(x**2 + y**2) / 50)
    diameter_mm = 2 * math.sqrt(50 * math.log(math.sqrt(2)))
    assert largest_chord_mm(grid, round_spot) == pytest.approx(diameter_mm, rel=0.005)
    two_spots = round_spot + 0.9 * np.exp(-((x - 15) ** 2 + y**2) / 2)
    assert largest_chord_mm(grid, two_spots) == pytest.approx(diameter_mm, rel=0.02), "what is apart is apart"
    assert largest_chord_mm(grid, np.ones(grid.counts)) == 0.0


@given(
    width_mm=st.floats(2, 6),
    apart_mm=st.floats(12, 17),
    angle=st.floats(0, 2 * math.pi),
    level=st.floats(0.1, 0.99),
)
def test_a_spot_beside_the_focus_never_makes_it_larger(
    width_mm: float, apart_mm: float, angle: float, level: float
) -> None:
    grid = box_grid(np.zeros(3), np.eye(3)[:2], width_mm=40, step_mm=0.5)
    x, y = grid.points_mm[:, 0].reshape(grid.counts), grid.points_mm[:, 1].reshape(grid.counts)
    beside = (x - apart_mm * math.cos(angle)) ** 2 + (y - apart_mm * math.sin(angle)) ** 2
    both = np.exp(-(x**2 + y**2) / width_mm**2) + level * np.exp(-beside / 4)
    expected_mm = 2 * width_mm * math.sqrt(math.log(math.sqrt(2)))
    assert largest_chord_mm(grid, both) == pytest.approx(expected_mm, rel=0.03)


def test_fringes_are_side_lobes_and_no_part_of_the_focus() -> None:
    """At A, 0.5 m away, the xz plane has three fringes over the threshold: 17.8 mm across altogether."""
    a_mm = np.array([302.0, 225.0, 500.0])
    metrics = focus_metrics(two_units(75.0, a_mm), AIR, a_mm)
    assert metrics.diameters_mm["xz"] == pytest.approx(8.4, abs=0.3)
    assert metrics.depth_mm == pytest.approx(metrics.diameters_mm["xz"], abs=1)
    lobes = metrics.side_lobes["xz"]
    assert len(lobes) == 2
    assert metrics.side_lobes["xy"] == ()
    for lobe in lobes:
        assert -1.51 < lobe.level_db < 0, "over 1 / sqrt 2"
        # the fringes of two beams under 75 degrees are lambda / (2 sin 37.5) = 7.0 mm apart
        assert lobe.distance_mm == pytest.approx(7.0, abs=0.6)
    assert metrics.side_lobe_db == pytest.approx(max(lobe.level_db for lobe in lobes), abs=0.3)


def test_a_field_that_does_not_arrive_is_told() -> None:
    silent = two_units(75.0).with_amplitudes(np.zeros((18, 249)))
    with pytest.raises(UsageError, match="nothing is emitted towards the focus"):
        focus_metrics(silent, AIR, B_MM)


@pytest.mark.parametrize(
    ("origin", "steps", "counts"),
    [
        (np.zeros(3), np.eye(3), (2, 0, 2)),
        (np.zeros(3), np.eye(3), (2, 2)),
        (np.zeros(2), np.eye(3), (2, 2, 2)),
        (np.full(3, np.nan), np.eye(3), (2, 2, 2)),
        (np.zeros(3), np.eye(3), ()),
    ],
)
def test_grids_that_are_none_are_refused(origin: Vectors, steps: Vectors, counts: tuple[int, ...]) -> None:
    with pytest.raises(UsageError):
        Grid(origin, steps, counts)
