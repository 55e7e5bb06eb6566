"""Acoustic refinement with a simulated microphone: from 20 mm and 1 degree to a tenth of a millimetre."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import UnitPose, Vectors, moved
from autd_trials.calibration.acoustic.heard import Heard
from autd_trials.calibration.acoustic.microphone import Microphone, advised_points_mm, listen
from autd_trials.calibration.acoustic.refine import Refined, refine
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.pose_error import energy_left
from autd_trials.errors import UsageError
from autd_trials.yamlfile.shipped import find_file

TRUE = load_calibration(find_file("emulated-calibration", kind="calibration", folder="rigs"))[0].unit_poses()
B_MM = np.array([302.0, 225.0, 1000.0])
EXPECTED_M_S = Air(20.0).speed_of_sound_m_s


def towards(generator: np.random.Generator, size: float) -> Vectors:
    direction = generator.standard_normal(3)
    return np.asarray(size * direction / np.linalg.norm(direction))


def disturbed(generator: np.random.Generator, shift_mm: float, turn_deg: float) -> list[UnitPose]:
    return [TRUE[0], moved(TRUE[1], towards(generator, shift_mm), towards(generator, turn_deg))]


def heard_by(
    microphone: Microphone,
    generator: np.random.Generator,
    units: tuple[int, ...] = (2,),
    warmer_c: float = 0.7,
) -> list[Heard]:
    points_mm = advised_points_mm(B_MM, generator)
    speed_m_s = Air(20.0 + warmer_c).speed_of_sound_m_s
    return listen(TRUE, units, points_mm, microphone, speed_m_s, generator)


def refined(start: list[UnitPose], heard: list[Heard], seed: int = 1) -> Refined:
    generator = np.random.default_rng(seed)
    return refine(start, heard, speed_of_sound_m_s=EXPECTED_M_S, microphone_sd_mm=0.1, generator=generator)


def error_mm(found: Refined) -> float:
    """How far the refined pose puts B from where unit 2 has it."""
    unit, true = found.units[1], TRUE[1]
    there = unit.rotation @ true.rotation.T @ (B_MM - true.translation_mm) + unit.translation_mm
    return float(np.linalg.norm(there - B_MM))


@pytest.mark.parametrize(("shift_mm", "turn_deg"), [(20.0, 1.0), (40.0, 3.0)])
@pytest.mark.parametrize("amplitude_only", [False, True])
def test_wrong_poses_are_mended(shift_mm: float, turn_deg: float, amplitude_only: bool) -> None:
    errors, ratios = [], []
    for seed in range(4):
        generator = np.random.default_rng(seed)
        microphone = Microphone(amplitude_only=amplitude_only)
        found = refined(disturbed(generator, shift_mm, turn_deg), heard_by(microphone, generator), seed)
        errors.append(error_mm(found))
        assert energy_left(TRUE, list(found.units), (302.0, 225.0, 1000.0), Air(20.0)) > 0.98
        turn = Rotation.from_matrix(found.units[1].rotation @ TRUE[1].rotation.T).as_rotvec()
        error = np.concatenate([found.units[1].translation_mm - TRUE[1].translation_mm, turn])
        ratios.append(error @ np.linalg.solve(np.asarray(found.covariances[1]), error))
    assert np.median(errors) < 0.3
    assert max(errors) < 0.6
    assert np.mean(ratios) < 15  # chi-square with 6 degrees of freedom


def test_the_speed_of_sound_is_found_too() -> None:
    generator = np.random.default_rng(3)
    found = refined(disturbed(generator, 5, 0.5), heard_by(Microphone(), generator, warmer_c=2.0))
    assert found.speed_of_sound_m_s == pytest.approx(Air(22.0).speed_of_sound_m_s, abs=0.15)


def test_a_stage_of_its_own_will_do_if_both_units_are_heard() -> None:
    """The microphone's points are off by 7 mm and 1 degree altogether; only their relation is right."""
    generator = np.random.default_rng(4)
    turn = Rotation.from_rotvec(towards(generator, np.radians(1))).as_matrix()
    microphone = Microphone()
    points_mm = advised_points_mm(B_MM, generator)
    truth = TRUE
    heard = listen(truth, (1, 2), points_mm, microphone, EXPECTED_M_S, generator)
    told = [
        Heard(
            h.unit,
            h.sources,
            (h.points_mm - B_MM) @ turn.T + B_MM + np.array([3.0, -5.0, 4.0]),
            h.lags_rad,
            True,
        )
        for h in heard
    ]
    found = refined(disturbed(generator, 20, 1), told)
    assert error_mm(found) < 0.4
    assert (found.units[0].rotation == np.eye(3)).all()


def test_groups_of_transducers_serve_as_sources() -> None:
    generator = np.random.default_rng(5)
    groups = [(start, start + 1, start + 2) for start in range(0, 2200, 40)]
    heard = listen(
        TRUE, (2,), advised_points_mm(B_MM, generator), Microphone(), EXPECTED_M_S, generator, groups
    )
    assert error_mm(refined(disturbed(generator, 3, 0.2), heard)) < 0.5


def test_dead_transducers_and_shadowed_points_are_left_out() -> None:
    generator = np.random.default_rng(6)
    (heard,) = heard_by(Microphone(), generator)
    heard.lags_rad[::5] = np.nan
    heard.lags_rad[:, 3] = np.nan
    heard.lags_rad[1, ::2] += 2.0  # a loose cable
    assert error_mm(refined(disturbed(generator, 20, 1), [heard])) < 0.4


def test_a_sensor_to_array_offset_that_no_points_show_is_found() -> None:
    """Unit 2 stands 20 mm off in z, as in the paper; points would never tell."""
    generator = np.random.default_rng(7)
    start = [TRUE[0], moved(TRUE[1], np.array([0.0, 0.0, 20.0]), np.zeros(3))]
    target_mm = (302.0, 225.0, 1000.0)
    assert energy_left(TRUE, start, target_mm, Air(20.0)) < 0.4
    found = refined(start, heard_by(Microphone(), generator))
    assert energy_left(TRUE, list(found.units), target_mm, Air(20.0)) > 0.99


def test_phases_of_the_other_sign_are_refused() -> None:
    generator = np.random.default_rng(8)
    (heard,) = heard_by(Microphone(), generator)
    leading = Heard(heard.unit, heard.sources, heard.points_mm, -heard.lags_rad, heard.synchronised)
    with pytest.raises(UsageError, match="the phases fit no pose"):
        refined(disturbed(generator, 20, 1), [leading])


def test_a_unit_that_is_not_there_is_told() -> None:
    (heard,) = heard_by(Microphone(), np.random.default_rng(9))
    with pytest.raises(UsageError, match="unit 2 was heard; the calibration has 1 units"):
        refined([TRUE[0]], [heard])
