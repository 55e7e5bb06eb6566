"""The geometry agrees with the SDK's own."""

import numpy as np
import pytest
from autd3.geometry import Autd3, Geometry
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from autd_trials.array.geometry import (
    DEVICES_PER_UNIT,
    TRANSDUCERS_PER_DEVICE,
    UnitPose,
    device_poses,
    is_rotation,
    transducer_positions_mm,
)

ANGLES = st.tuples(*[st.floats(-180, 180)] * 3)
PLACES = st.tuples(*[st.floats(-3000, 3000)] * 3)


def sdk_geometry(units: list[UnitPose]) -> Geometry:
    return Geometry(
        [Autd3(pose.origin_mm, Rotation.from_matrix(pose.rotation)) for pose in device_poses(units)]
    )


@given(ANGLES, PLACES)
def test_transducers_are_where_the_sdk_has_them(
    angles_deg: tuple[float, ...], place_mm: tuple[float, ...]
) -> None:
    unit = UnitPose(
        "unit", Rotation.from_euler("zyx", angles_deg, degrees=True).as_matrix(), np.array(place_mm)
    )
    ours_mm = transducer_positions_mm([unit])
    sdks_mm = np.array([device.positions() for device in sdk_geometry([unit])])
    assert ours_mm.shape == (DEVICES_PER_UNIT, TRANSDUCERS_PER_DEVICE, 3)
    np.testing.assert_allclose(ours_mm, sdks_mm, atol=5e-3)  # the SDK's are float32


@given(ANGLES, PLACES)
def test_the_axis_is_the_sdks_and_the_centre_is_in_the_middle(
    angles_deg: tuple[float, ...], place_mm: tuple[float, ...]
) -> None:
    unit = UnitPose(
        "unit", Rotation.from_euler("zyx", angles_deg, degrees=True).as_matrix(), np.array(place_mm)
    )
    np.testing.assert_allclose(unit.axis, sdk_geometry([unit])[0].axial_direction(), atol=1e-5)
    local_mm = (transducer_positions_mm([unit]) - unit.translation_mm) @ unit.rotation
    middle_mm = (local_mm.min(axis=(0, 1)) + local_mm.max(axis=(0, 1))) / 2
    np.testing.assert_allclose(unit.rotation @ middle_mm + unit.translation_mm, unit.centre_mm, atol=1e-6)


def test_devices_of_a_unit_do_not_overlap(units: list[UnitPose]) -> None:
    places_mm = transducer_positions_mm(units[:1]).reshape(-1, 3)
    assert pdist(places_mm).min() == pytest.approx(10.16)


@pytest.mark.parametrize(
    ("matrix", "rotation"),
    [
        (np.eye(3), True),
        (Rotation.from_rotvec([0.1, -2, 0.5]).as_matrix(), True),
        (np.round(Rotation.from_rotvec([0.1, -2, 0.5]).as_matrix(), 9), True),
        (np.diag([1.0, 1.0, -1.0]), False),
        (1.00001 * np.eye(3), False),
        (np.zeros((3, 3)), False),
        (np.full((3, 3), np.nan), False),
        (np.eye(3) + np.diag([1e-5, 1e-5], 1), False),
    ],
)
def test_only_rotations_are_rotations(matrix: np.ndarray, rotation: bool) -> None:
    assert is_rotation(matrix) is rotation
