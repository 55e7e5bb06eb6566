"""Arrays of sources that the acoustics tests share."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.sources import Medium, Sources, Vectors

AIR = Air()
MEDIUM = Medium.of(AIR)
PLAIN = Medium(344.0, 0.0, (1.0,))
"""The same in all directions, without loss, and with the paper's speed of sound: a wavelength of 8.6 mm."""

B_MM = np.array([302.0, 225.0, 1000.0])


def board_mm(columns: int = 18, rows: int = 14, pitch_mm: float = 10.16) -> Vectors:
    """Places of a full rectangle of transducers, from a corner on, shape (n, 2)."""
    x, y = np.meshgrid(np.arange(columns) * pitch_mm, np.arange(rows) * pitch_mm)
    return np.column_stack([x.ravel(), y.ravel()])


def two_units(angle_deg: float, focus_mm: Vectors = B_MM, medium: Medium = MEDIUM, units: int = 2) -> Sources:
    """Two units of 3 x 3 boards with 249 transducers each, focused; unit 2 is unit 1 turned about B."""
    places = np.delete(board_mm(), [18 + 1, 18 + 2, 18 + 16], axis=0)
    corners = np.array([(c * 192.0, r * 151.4, 0.0) for r in range(3) for c in range(3)])
    turn = Rotation.from_euler("y", angle_deg, degrees=True).as_matrix()
    origins = [corners, B_MM + (corners - B_MM) @ turn.T][:units]
    rotations = [np.broadcast_to(np.eye(3), (9, 3, 3)), np.broadcast_to(turn, (9, 3, 3))][:units]
    return focused(np.vstack(origins), np.vstack(rotations), places, focus_mm, medium)


def focused(
    origins_mm: Vectors, rotations: Vectors, places_mm: Vectors, focus_mm: Vectors, medium: Medium
) -> Sources:
    """Sources whose contributions all arrive at a point in phase."""
    shape = (len(origins_mm), len(places_mm))
    silent = Sources(origins_mm, rotations, places_mm, np.zeros(shape), np.full(shape, 4386.0))
    distances_mm = np.linalg.norm(silent.positions_mm - focus_mm, axis=-1)
    return Sources(
        origins_mm, rotations, places_mm, -distances_mm * medium.turns_per_mm, silent.amplitudes_pa_mm
    )


def random_sources(
    generator: np.random.Generator, devices: int, transducers: int, focus_mm: Vectors
) -> Sources:
    """Devices at random poses around a focus, half of them focused on it, with random drives."""
    rotations: NDArray[np.float64] = Rotation.random(devices, generator).as_matrix()
    origins = focus_mm - rotations[:, :, 2] * generator.uniform(150, 1200, (devices, 1))
    places = generator.uniform(-90, 90, (transducers, 2))
    sources = focused(origins + generator.uniform(-80, 80, (devices, 3)), rotations, places, focus_mm, MEDIUM)
    noise = generator.uniform(0, 1, sources.phases_turns.shape) * generator.integers(0, 2, (devices, 1))
    return Sources(
        sources.origins_mm,
        rotations,
        places,
        sources.phases_turns + noise,
        sources.amplitudes_pa_mm * generator.uniform(0, 1, sources.phases_turns.shape),
    )


@pytest.fixture
def generator() -> np.random.Generator:
    return np.random.default_rng(20261124)
