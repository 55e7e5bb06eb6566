"""The lag of sources at points: against plain distances, the field solver, and differences."""

from dataclasses import replace

import numpy as np
import pytest

from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium
from autd_trials.array.emission import focused_sources
from autd_trials.array.geometry import UnitPose, Vectors, moved, transducer_positions_mm
from autd_trials.calibration.acoustic.model import HeardUnit, modelled

UNIT = UnitPose("unit 1", np.eye(3), np.zeros(3))
POINTS_MM = np.array([[302.0, 225.0, 1000.0], [100.0, 400.0, 800.0], [500.0, 50.0, 1300.0]])
PIVOT_MM = POINTS_MM.mean(axis=0)
WAVE_NUMBER = 2 * np.pi * 40 / 343.2


def heard(
    unit: UnitPose = UNIT, groups: list[tuple[int, ...]] | None = None, points: Vectors = POINTS_MM
) -> HeardUnit:
    return modelled(unit, groups or [(0,), (500,), (700, 701, 718)], points, WAVE_NUMBER, PIVOT_MM)


def wrapped(phases: Vectors) -> Vectors:
    turned: Vectors = (phases + np.pi) % (2 * np.pi) - np.pi
    return turned


def test_a_single_transducer_lags_by_its_distance() -> None:
    place = transducer_positions_mm([UNIT]).reshape(-1, 3)[500]
    distances = np.linalg.norm(POINTS_MM - place, axis=1)
    assert wrapped(heard().lags_rad[1] - WAVE_NUMBER * distances) == pytest.approx(0, abs=1e-9)
    assert heard().path_rad[1] == pytest.approx(WAVE_NUMBER * distances)


def test_derivatives_are_those_of_differences() -> None:
    model, step = heard(), 1e-3
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        later = heard(UnitPose("unit 1", UNIT.rotation, UNIT.translation_mm + shift))
        assert wrapped(later.lags_rad - model.lags_rad) / step == pytest.approx(
            model.by_pose[..., axis], abs=1e-4
        )
        there = heard(points=POINTS_MM + shift)
        assert wrapped(there.lags_rad - model.lags_rad) / step == pytest.approx(
            model.by_point[..., axis], abs=1e-4
        )
        # a turn about the pivot: about the centre, and a shift for the rest
        turn = np.degrees(1e-6) * np.eye(3)[axis]
        about = np.cross(1e-6 * np.eye(3)[axis], UNIT.centre_mm - PIVOT_MM)
        turned = heard(moved(UNIT, about, turn))
        assert wrapped(turned.lags_rad - model.lags_rad) / 1e-6 == pytest.approx(
            model.by_pose[..., 3 + axis], rel=1e-3, abs=0.05
        )


@pytest.mark.parametrize("group", [(0,), (500,), (2240,), (700, 701, 718)])
def test_the_field_solver_hears_the_same_lags(group: tuple[int, ...]) -> None:
    focused = focused_sources([UNIT], (302.0, 225.0, 1000.0), speed_of_sound_m_s=343.2)
    only = np.zeros(focused.amplitudes_pa_mm.size)
    only[list(group)] = 1.0
    emitting = replace(
        focused,
        phases_turns=np.zeros_like(focused.phases_turns),
        amplitudes_pa_mm=only.reshape(focused.amplitudes_pa_mm.shape),
    )
    heard_pa = reference_pressure(emitting, Medium(343.2, 0.0, (1.0,)), POINTS_MM)
    assert wrapped(heard(groups=[group]).lags_rad[0] - np.angle(heard_pa)) == pytest.approx(0, abs=1e-9)
