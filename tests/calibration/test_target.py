"""Finding the target: where it is, how fast, and what is not the target."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensors.frame import Frame
from autd_trials.calibration.sensors.synthetic import Imperfections, Reflector, SyntheticSensor
from autd_trials.calibration.target import RADIUS_MM, Sighting, find_target

QUIET = Imperfections(frame_noise_mm=0, pixel_noise_mm=0)


def seen(place_mm: list[float], wrong: Imperfections = QUIET, seed: int = 1) -> tuple[Frame, Sighting | None]:
    sensor = SyntheticSensor(
        RigidMotion.identity(),
        lambda time_s: np.tile(np.array(place_mm), (len(time_s), 1)),
        RADIUS_MM,
        np.random.default_rng(seed),
        imperfections=wrong,
        frames=1,
    )
    (frame,) = sensor
    return frame, find_target(frame, sensor.intrinsics)


def test_the_radius_is_the_papers() -> None:
    assert pytest.approx(12.07, abs=0.005) == RADIUS_MM


@settings(max_examples=60, deadline=None)
@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.4, 0.4), depth_mm=st.floats(500, 2000))
def test_the_centre_is_found_wherever_the_target_is(x: float, y: float, depth_mm: float) -> None:
    true = np.array([x * depth_mm, y * depth_mm, depth_mm])
    _, sighting = seen(list(true))
    assert sighting is not None
    ray = true / np.linalg.norm(true)
    error = sighting.point_mm - true
    along = error @ ray
    assert -0.5 < along < 2.0  # the depth of the disc's middle lies a little behind the nearest point
    assert np.linalg.norm(error - along * ray) < 0.6
    assert sighting.quality > 0.5


def test_accuracy_at_a_metre_is_a_tenth_of_a_millimetre_across_the_ray() -> None:
    across = []
    for seed in range(40):
        true = np.array([*np.random.default_rng(seed).uniform(-200, 200, 2), 1000.0])
        _, sighting = seen(list(true), seed=seed)
        assert sighting is not None
        error = sighting.point_mm - true
        ray = true / np.linalg.norm(true)
        across.append(np.linalg.norm(error - (error @ ray) * ray))
    assert np.sqrt(np.mean(np.square(across))) < 0.15


@pytest.mark.parametrize(
    "reflector",
    [
        Reflector((300.0, 100.0, 900.0), 60.0),  # a plate
        Reflector((-250.0, -100.0, 1500.0), 4.0),  # a screw
        Reflector((200.0, 200.0, 700.0), 40.0),
    ],
)
def test_other_reflectors_are_rejected_by_their_size(reflector: Reflector) -> None:
    alone = Imperfections(dropouts=1.0, reflectors=(reflector,))
    assert seen([0, 0, 1000], alone)[1] is None
    _, sighting = seen([0, 0, 1000], Imperfections(reflectors=(reflector,)))
    assert sighting is not None
    assert sighting.point_mm == pytest.approx([0, 0, 1000], abs=12)


def test_long_bright_things_are_no_target() -> None:
    frame, _ = seen([0, 0, 1000], Imperfections(dropouts=1.0))
    frame.infrared[100:102, 50:120] = 30_000
    frame.depth_m[100:102, 50:120] = 1.0
    assert find_target(frame, SyntheticSensor.intrinsics) is None


def test_without_target_and_without_depth_nothing_is_found() -> None:
    assert seen([0, 0, 1000], Imperfections(dropouts=1.0))[1] is None
    frame, _ = seen([0, 0, 1000])
    frame.depth_m[:] = 0
    assert find_target(frame, SyntheticSensor.intrinsics) is None


def test_a_target_that_blinds_the_camera_is_not_taken_for_the_target() -> None:
    assert seen([0, 0, 700], Imperfections(saturated=True))[1] is None


def test_a_range_bias_moves_the_point_along_its_ray() -> None:
    true = np.array([200.0, -100.0, 1000.0])
    points = []
    for bias_mm in (0.0, 20.0):
        sighting = seen(list(true), Imperfections(0, 0, range_bias_mm=bias_mm))[1]
        assert sighting is not None
        points.append(sighting.point_mm)
    assert points[1] - points[0] == pytest.approx(20 * true / np.linalg.norm(true), abs=0.05)
