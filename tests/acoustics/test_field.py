"""The fast solver against the plain one, and against the SDK's own field simulation."""

import numpy as np
import pytest
from autd3 import Duration
from autd3.commands import FixedCompletionTime, Pattern, SetSilencer
from autd3.geometry import Autd3, Geometry
from autd3_core import Velocity
from autd3_emulator import Emulator, Recorder, RmsRecordOption
from autd3_emulator import Grid as EmulatorGrid
from autd3_pattern import PhaseBuffer
from hypothesis import example, given, reject, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from autd_trials.acoustics.field import Pressures, grid_pressure, pressure
from autd_trials.acoustics.grid import Grid, box_grid
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium, Sources, Vectors
from autd_trials.acoustics.transducer import FULL_PRESSURE_PA_MM
from autd_trials.array.geometry import transducer_places_mm
from autd_trials.errors import UsageError
from tests.acoustics.conftest import B_MM, MEDIUM, random_sources, two_units

LARGEST_ERROR = 1e-4
LARGEST_POINT_ERROR = 1e-5


def error(found: Pressures, sources: Sources, points_mm: Vectors, peak: float) -> float:
    """The largest error relative to the field's peak, at up to 400 of the points."""
    some = np.random.default_rng(1).choice(len(points_mm), min(400, len(points_mm)), replace=False)
    wanted = reference_pressure(sources, MEDIUM, points_mm[some])
    return float(np.abs(found.ravel()[some] - wanted).max() / max(peak, np.abs(wanted).max()))


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), devices=st.integers(1, 6), transducers=st.integers(1, 300))
@example(seed=843696, devices=1, transducers=58)  # points close to transducers
@example(seed=729989, devices=6, transducers=34)
@example(seed=523740, devices=3, transducers=262)
def test_points_agree_with_the_reference(seed: int, devices: int, transducers: int) -> None:
    generator = np.random.default_rng(seed)
    sources = random_sources(generator, devices, transducers, B_MM)
    points_mm = B_MM + generator.uniform(-300, 300, (400, 3))
    points_mm[0] = B_MM
    try:
        found = pressure(sources, MEDIUM, points_mm)
    except UsageError:
        reject()  # a random device stood in the way
    assert error(found, sources, points_mm, float(np.abs(found[0]))) < LARGEST_POINT_ERROR


def test_where_everything_cancels_the_error_is_small_against_what_cancels() -> None:
    """Pairs of transducers in opposite phase, on the plane between which nothing is left."""
    places = np.array([[-20.0, 10.0], [20.0, 10.0], [-70.0, -30.0], [70.0, -30.0]])
    shape = (1, len(places))
    phases = np.array([[0.0, 0.5, 0.25, 0.75]])
    sources = Sources(np.zeros((1, 3)), np.eye(3)[None], places, phases, np.full(shape, 4386.0))
    points_mm = np.random.default_rng(1).uniform([0, -200, 50], [0, 200, 600], (400, 3))
    distances_mm = np.linalg.norm(points_mm[:, None] - sources.positions_mm[0], axis=2)
    magnitudes_pa = 4386.0 * relative_directivity(points_mm, distances_mm) / distances_mm
    found = np.abs(pressure(sources, MEDIUM, points_mm))
    assert (found < 5e-6 * magnitudes_pa.sum(axis=1)).all()


def relative_directivity(points_mm: Vectors, distances_mm: Vectors) -> Vectors:
    """The directivity of transducers that all face along z, with the loss on the way."""
    cosines = points_mm[:, 2:3] / distances_mm
    spread = np.polynomial.polynomial.polyval(cosines, MEDIUM.directivity)
    return np.asarray(spread * np.exp(-MEDIUM.nepers_per_mm * distances_mm))


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    devices=st.integers(1, 6),
    axes=st.integers(1, 3),
    step_mm=st.floats(0.2, 15),
)
def test_grids_at_any_pose_agree_with_the_reference(
    seed: int, devices: int, axes: int, step_mm: float
) -> None:
    generator = np.random.default_rng(seed)
    sources = random_sources(generator, devices, 249, B_MM)
    directions = Rotation.random(rng=generator).as_matrix()[:axes]
    centre_mm = B_MM + generator.uniform(-40, 40, 3)
    most = {1: 400, 2: 90, 3: 24}[axes]
    grid = box_grid(centre_mm, directions, width_mm=min(300.0, most * step_mm), step_mm=step_mm)
    try:
        found = grid_pressure(sources, MEDIUM, grid)
    except UsageError:
        reject()  # a random device stood in the way
    peak = float(np.abs(reference_pressure(sources, MEDIUM, B_MM[None]))[0])
    assert error(found, sources, grid.points_mm, peak) < LARGEST_ERROR


@pytest.mark.parametrize("focus_mm", [(302, 225, 500), (302, 225, 1000), (302, 225, 1500), (150, 400, 800)])
@pytest.mark.parametrize("axes", [[0, 1], [0, 2], [1, 2], [0, 1, 2]])
def test_planes_and_volumes_of_two_units_agree_with_the_reference(
    focus_mm: tuple[float, float, float], axes: list[int]
) -> None:
    focus = np.array(focus_mm, dtype=float)
    sources = two_units(75.0, focus)
    grid = box_grid(focus, np.eye(3)[axes], width_mm=200 if len(axes) == 2 else 60, step_mm=1.3)
    peak = float(np.abs(reference_pressure(sources, MEDIUM, focus[None]))[0])
    assert error(grid_pressure(sources, MEDIUM, grid), sources, grid.points_mm, peak) < LARGEST_ERROR


def test_a_grid_close_to_and_behind_devices_agrees_with_the_reference() -> None:
    sources = two_units(75.0, units=1)
    steps_mm = np.array([[7.0, 0, 0], [0.5, 3.0, 0], [0, 1.0, 20.0]])
    grid = Grid(np.array([-200.0, 100.0, -150.0]), steps_mm, (60, 10, 30))
    found = grid_pressure(sources, MEDIUM, grid)
    peak = float(np.abs(reference_pressure(sources, MEDIUM, B_MM[None]))[0])
    assert error(found, sources, grid.points_mm, peak) < LARGEST_ERROR
    assert (found == 0).any(), "behind it nothing arrives"


def test_a_grid_is_its_points_in_order() -> None:
    sources = two_units(60.0)
    grid = Grid(B_MM, np.array([[2.0, 0, 0], [0, 0, 3.0]]), (4, 5))
    assert grid_pressure(sources, MEDIUM, grid).shape == (4, 5)
    found = grid_pressure(sources, MEDIUM, grid).ravel()
    assert np.abs(found - pressure(sources, MEDIUM, grid.points_mm)).max() < 1e-4 * np.abs(found).max()


def test_progress_is_told_up_to_the_end_and_memory_is_asked_for_in_parts() -> None:
    sources = two_units(75.0)
    told: list[float] = []
    pressure(sources, MEDIUM, B_MM + np.random.default_rng(1).uniform(-50, 50, (50_000, 3)), told.append)
    assert len(told) > 1
    assert told == sorted(told)
    assert told[-1] == 1.0
    told.clear()
    grid_pressure(sources, MEDIUM, box_grid(B_MM, np.eye(3), width_mm=40, step_mm=0.4), told.append)
    assert len(told) > 1
    assert told[-1] == 1.0


def test_the_sdks_field_simulation_agrees(generator: np.random.Generator) -> None:
    """Without directivity and absorption, which it does not have; two posed devices with random phases."""
    origins = np.array([[0.0, 0, 0], [150.0, 30, 20]])
    rotations = np.array([np.eye(3), Rotation.from_euler("y", -20, degrees=True).as_matrix()])
    phases = generator.integers(0, 256, (2, 249)).astype(np.uint8)
    devices = [Autd3(o, Rotation.from_matrix(r)) for o, r in zip(origins, rotations, strict=True)]

    def emit(recorder: Recorder) -> None:
        strict = FixedCompletionTime(
            intensity=Duration.from_micros(25), phase=Duration.from_micros(25), strict_mode=False
        )
        recorder.send(SetSilencer(strict))
        recorder.send(Pattern(PhaseBuffer.from_array(phases), 255))
        recorder.tick(Duration.from_millis(10))

    record = Emulator(Geometry(devices)).record(emit)
    simulated = record.sound_field(
        EmulatorGrid(x=(0.0, 60.0), y=20.0, z=(200.0, 260.0), resolution=2.0, order="xyz"),
        RmsRecordOption(sound_speed=Velocity.from_m_s(343.2)),
    )
    places = simulated.observe_points().to_numpy()
    rms_pa = simulated.next(Duration.from_millis(10)).to_numpy()[:, -1]
    sources = Sources(
        origins, rotations, transducer_places_mm(), phases / 256, np.full((2, 249), FULL_PRESSURE_PA_MM)
    )
    found_pa = np.abs(pressure(sources, Medium(343.2, 0.0, (1.0,)), places)) / np.sqrt(2)
    assert np.abs(found_pa - rms_pa).max() < LARGEST_ERROR * rms_pa.max()


def test_points_inside_a_transducer_are_refused_with_their_place() -> None:
    sources = two_units(75.0)
    with pytest.raises(UsageError, match=r"1 points lie inside a transducer, the first at \(1, 2, 0.5\) mm"):
        pressure(sources, MEDIUM, np.array([[300.0, 200, 900], [1.0, 2.0, 0.5]]))
    with pytest.raises(UsageError, match="inside a transducer"):
        grid_pressure(
            sources, MEDIUM, box_grid(np.array([20.0, 20, 0]), np.eye(3)[:2], width_mm=40, step_mm=1)
        )
    pressure(sources, MEDIUM, np.array([[5.08, 5.08, 5.5]]))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.empty((0, 3)), "points_mm has the shape"),
        (np.zeros((3, 2)), "points_mm has the shape"),
        (np.zeros(3), "points_mm has the shape"),
        (np.array([[0.0, np.nan, 500]]), "not finite"),
        (np.array([[0.0, np.inf, 500]]), "not finite"),
    ],
)
def test_bad_points_are_refused(points: Vectors, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        pressure(two_units(75.0), MEDIUM, points)


def test_a_directivity_of_too_many_terms_is_refused() -> None:
    with pytest.raises(UsageError, match="too many terms"):
        pressure(two_units(75.0), Medium(343.0, 1.0, (1.0,) * 8), B_MM[None])
