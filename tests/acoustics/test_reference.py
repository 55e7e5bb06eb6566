"""The plain solver against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import j1

from autd_trials.acoustics.level import energy_density_j_m3
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium, Sources, Vectors
from autd_trials.acoustics.transducer import ULTRASOUND_HZ
from tests.acoustics.conftest import AIR, B_MM, MEDIUM, PLAIN, board_mm, focused, two_units

WAVELENGTH_MM = 1 / PLAIN.turns_per_mm
K_PER_MM = 2 * np.pi / WAVELENGTH_MM


def disc_sources(radius_mm: float, spacing_mm: float) -> Sources:
    """A piston of many small sources, by Rayleigh's integral: k / 2 pi times its area, shared out evenly."""
    steps = np.arange(-radius_mm, radius_mm, spacing_mm) + spacing_mm / 2
    places = np.array([(x, y) for x in steps for y in steps if np.hypot(x, y) < radius_mm])
    strength = np.full((1, len(places)), np.pi * radius_mm**2 / len(places) * K_PER_MM / (2 * np.pi))
    return Sources(np.zeros((1, 3)), np.eye(3)[None], places, np.zeros((1, len(places))), strength)


def on_axis(distances_mm: Vectors) -> Vectors:
    return np.column_stack([np.zeros((len(distances_mm), 2)), distances_mm])


def test_a_circular_piston_on_its_axis() -> None:
    """2 |sin(k / 2 (sqrt(z^2 + a^2) - z))| of the pressure of a plane wave."""
    radius_mm, z_mm = 50.0, np.linspace(120.0, 800.0, 200)
    found = np.abs(reference_pressure(disc_sources(radius_mm, 0.5), PLAIN, on_axis(z_mm)))
    expected = 2 * np.abs(np.sin(K_PER_MM / 2 * (np.sqrt(z_mm**2 + radius_mm**2) - z_mm)))
    assert np.abs(found - expected).max() < 0.01 * expected.max()


def test_the_last_maximum_of_a_piston() -> None:
    z_mm = np.linspace(270.0, 310.0, 401)
    found = np.abs(reference_pressure(disc_sources(50.0, 0.5), PLAIN, on_axis(z_mm)))
    assert z_mm[found.argmax()] == pytest.approx(288.5, abs=1.0)


def test_the_gain_of_a_focused_bowl() -> None:
    """O'Neil (1949): k h with h = R - sqrt(R^2 - a^2); 23.20 for R = 1 m, a = 0.25 m."""
    radius_mm, aperture_mm = 1000.0, 250.0
    depth_mm = radius_mm - np.sqrt(radius_mm**2 - aperture_mm**2)
    rings = (np.arange(125) + 0.5) / 125 * depth_mm  # a sphere's zones of equal height have equal areas
    area_mm2 = 2 * np.pi * radius_mm * depth_mm
    heights = np.repeat(rings, 100)
    angles = np.tile(np.arange(100) * 2 * np.pi / 100, 125)
    across = np.sqrt(radius_mm**2 - (radius_mm - heights) ** 2)
    points = np.column_stack([across * np.cos(angles), across * np.sin(angles), heights])
    inwards = (np.array([0, 0, radius_mm]) - points) / radius_mm
    strength = area_mm2 / len(points) * K_PER_MM / (2 * np.pi)
    sources = Sources(
        points,
        np.array([_facing(direction) for direction in inwards]),
        np.zeros((1, 2)),
        np.zeros((len(points), 1)),
        np.full((len(points), 1), strength),
    )
    gain = abs(reference_pressure(sources, PLAIN, np.array([[0, 0, radius_mm]]))[0])
    assert gain == pytest.approx(23.20, abs=0.02)


def _facing(direction: Vectors) -> Vectors:
    across = np.linalg.svd(direction[None])[2][1:]
    return np.column_stack([across[0], np.cross(direction, across[0]), direction])


def test_the_far_field_of_a_rectangle_has_its_first_null_at_2_695_degrees() -> None:
    """A board of 18 x 14 transducers at 10.16 mm is as wide as 182.88 x 142.24 mm."""
    places = board_mm() - board_mm().mean(axis=0)
    sources = Sources(np.zeros((1, 3)), np.eye(3)[None], places, np.zeros((1, 252)), np.ones((1, 252)))
    angles_deg = np.linspace(1.5, 4.0, 1001)
    directions = np.column_stack(
        [np.sin(np.radians(angles_deg)), np.zeros(1001), np.cos(np.radians(angles_deg))]
    )
    strength = np.abs(reference_pressure(sources, PLAIN, 1e6 * directions))
    assert angles_deg[strength.argmin()] == pytest.approx(2.695, abs=0.005)


def test_grating_lobes_of_an_unsteered_board_lie_at_57_83_degrees() -> None:
    places = board_mm() - board_mm().mean(axis=0)
    sources = Sources(np.zeros((1, 3)), np.eye(3)[None], places, np.zeros((1, 252)), np.ones((1, 252)))
    angles_deg = np.linspace(50, 65, 3001)
    directions = np.column_stack(
        [np.sin(np.radians(angles_deg)), np.zeros(3001), np.cos(np.radians(angles_deg))]
    )
    strength = np.abs(reference_pressure(sources, PLAIN, 1e6 * directions))
    assert angles_deg[strength.argmax()] == pytest.approx(57.83, abs=0.02)
    ahead = abs(reference_pressure(sources, PLAIN, np.array([[0, 0, 1e6]]))[0])
    assert strength.max() == pytest.approx(ahead, rel=1e-3), "as strong as the main lobe: no directivity here"


@pytest.mark.parametrize("angle_deg", [40.0, 60.0, 75.0])
def test_two_beams_make_fringes(angle_deg: float) -> None:
    """Their distance is lambda / (2 sin(angle / 2)); from two boards so far away that the beams are plane."""
    half = np.radians(angle_deg / 2)
    turns = [Rotation.from_euler("y", side * half).as_matrix() for side in (-1, 1)]
    places = board_mm() - board_mm().mean(axis=0)
    origins = np.array([B_MM - 8000.0 * turn[:, 2] for turn in turns])
    sources = focused(origins, np.array(turns), places, B_MM, PLAIN)
    along_mm = np.linspace(-15, 15, 6001)
    strength = np.abs(reference_pressure(sources, PLAIN, B_MM + along_mm[:, None] * [1.0, 0, 0]))
    inner = strength[1:-1]
    peaks_mm = along_mm[1:-1][(inner > strength[:-2]) & (inner > strength[2:])]
    assert np.diff(peaks_mm) == pytest.approx(WAVELENGTH_MM / (2 * np.sin(half)), rel=0.01)


def test_energy_is_conserved() -> None:
    """W = 2 pi A^2 / (rho c) sum_ij sinc(k r_ij) into full space; half of it goes into the front."""
    generator = np.random.default_rng(3)
    places = np.column_stack([generator.uniform(-20, 20, 30), np.zeros(30)])
    sources = Sources(np.zeros((1, 3)), np.eye(3)[None], places, np.zeros((1, 30)), np.ones((1, 30)))
    distances = np.linalg.norm(places[:, None] - places[None], axis=-1)
    expected = np.pi * np.sinc(K_PER_MM * distances / np.pi).sum()  # times A^2 / (rho c), half space
    cosines, weights = np.polynomial.legendre.leggauss(120)
    cosines, weights = (cosines + 1) / 2, weights / 2
    azimuths = np.arange(240) * 2 * np.pi / 240
    sines = np.sqrt(1 - cosines**2)
    directions = np.stack(
        [
            sines[:, None] * np.cos(azimuths),
            sines[:, None] * np.sin(azimuths),
            np.repeat(cosines[:, None], 240, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    far_mm = 1e5
    intensity = (np.abs(reference_pressure(sources, PLAIN, far_mm * directions)) * far_mm) ** 2 / 2
    power = (intensity.reshape(120, 240).sum(axis=1) * 2 * np.pi / 240) @ weights
    assert power == pytest.approx(expected, rel=1e-3)


def test_the_far_field_of_a_disc_is_an_airy_pattern() -> None:
    radius_mm, far_mm = 40.0, 1e6
    angles = np.radians(np.linspace(0.5, 30, 60))
    directions = np.column_stack([np.sin(angles), np.zeros(60), np.cos(angles)])
    sources = disc_sources(radius_mm, 0.5)
    ahead = abs(reference_pressure(sources, PLAIN, np.array([[0, 0, far_mm]]))[0])
    found = np.abs(reference_pressure(sources, PLAIN, far_mm * directions)) / ahead
    argument = K_PER_MM * radius_mm * np.sin(angles)
    assert np.abs(found - np.abs(2 * j1(argument) / argument)).max() < 0.01


def test_two_posed_units_reach_960_joules_per_cubic_metre_at_b() -> None:
    pressure = reference_pressure(two_units(75.0), MEDIUM, B_MM[None])
    assert energy_density_j_m3(pressure, AIR)[0] == pytest.approx(960, rel=0.02)


def test_one_transducer_falls_off_with_distance_absorption_and_angle() -> None:
    one = Sources(
        np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 2)), np.zeros((1, 1)), np.full((1, 1), 4386.0)
    )
    points = np.array([[0, 0, 1000.0], [0, 0, 2000.0], [0, 0, -1000.0], [500 * 3**0.5, 0, 500.0]])
    ahead, twice, behind, aside = np.abs(reference_pressure(one, MEDIUM, points))
    per_metre = 10 ** (-AIR.absorption_db_m(ULTRASOUND_HZ) / 20)
    assert ahead == pytest.approx(4.386 * per_metre, rel=0.01)
    assert twice / ahead == pytest.approx(per_metre / 2, rel=1e-9)
    assert behind == 0
    assert aside / ahead == pytest.approx(0.355, abs=0.01), "60 degrees off axis"


def test_phases_focus() -> None:
    sources = focused(np.zeros((1, 3)), np.eye(3)[None], board_mm(), np.array([80.0, 60, 300]), MEDIUM)
    at_focus = reference_pressure(sources, MEDIUM, np.array([[80.0, 60, 300]]))
    assert at_focus[0].real == pytest.approx(abs(at_focus[0]), rel=1e-9), "all arrive with the phase 0"


def test_a_medium_in_words_and_numbers() -> None:
    medium = Medium(340.0, 8.685889638, (1.0,))
    assert medium.turns_per_mm == pytest.approx(40 / 340)
    assert medium.nepers_per_mm == pytest.approx(0.001)
