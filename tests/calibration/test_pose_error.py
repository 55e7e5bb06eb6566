from pathlib import Path

import numpy as np
import pytest

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.focus_metrics import locate_maximum
from autd_trials.acoustics.sources import Medium
from autd_trials.array.emission import focused_sources
from autd_trials.array.geometry import UnitPose, moved
from autd_trials.calibration.budget_figure import draw_error_budget
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.pose_error import ErrorCost, energy_left, error_budget
from autd_trials.yamlfile.shipped import find_file

AIR = Air()
B_MM = (302.0, 225.0, 1000.0)
NO_TURN = np.zeros(3)


@pytest.fixture(scope="module")
def units() -> list[UnitPose]:
    shipped = find_file("emulated", kind="rig", folder="rigs")
    return load_calibration(shipped.with_name("emulated-calibration.yaml"))[0].unit_poses()


@pytest.fixture(scope="module")
def budget(units: list[UnitPose]) -> dict[tuple[str, float], ErrorCost]:
    costs = error_budget(units, B_MM, AIR, np.random.default_rng(5), draws=60)
    return {(cost.kind, cost.size): cost for cost in costs}


def test_right_poses_lose_nothing(units: list[UnitPose]) -> None:
    assert energy_left(units, units, B_MM, AIR) == 1.0


def test_a_common_error_of_all_units_loses_what_the_focus_is_away(units: list[UnitPose]) -> None:
    """Both units and so the focus are 30 mm aside; a rectangle's first side lobe is at -13.3 dB, or 0.047."""
    aside = [moved(unit, np.array([0, 30.0, 0]), NO_TURN) for unit in units]
    assert energy_left(aside, units, B_MM, AIR) < 0.06


def test_unit_2_wrong_by_20_mm_in_z_moves_the_maximum_as_in_the_paper(units: list[UnitPose]) -> None:
    """The paper's section 4.2: the maximum deviates by 20-30 mm in z, unit 2 by about 20 mm."""
    standing = [units[0], moved(units[1], np.array([0, 0, 20.0]), NO_TURN)]
    sources = focused_sources(standing, B_MM, speed_of_sound_m_s=AIR.speed_of_sound_m_s, believed=units)
    shift_mm = locate_maximum(sources, Medium.of(AIR), np.array(B_MM)) - B_MM
    assert 15 <= shift_mm[2] <= 20
    assert np.abs(shift_mm[:2]).max() < 3
    assert energy_left(standing, units, B_MM, AIR) < 0.5


@pytest.mark.parametrize(
    ("kind", "size", "expected", "within"),
    [
        ("position_mm", 0.3, 0.996, 0.002),
        ("position_mm", 1.0, 0.951, 0.01),
        ("position_mm", 1.8, 0.855, 0.03),
        ("position_mm", 3.0, 0.67, 0.06),
        ("position_mm", 20.0, 0.31, 0.06),
        ("angle_deg", 0.1, 0.989, 0.003),
        ("angle_deg", 0.3, 0.909, 0.02),
        ("angle_deg", 1.0, 0.44, 0.06),
    ],
)
def test_mean_costs_agree_with_an_independent_computation(
    budget: dict[tuple[str, float], ErrorCost], kind: str, size: float, expected: float, within: float
) -> None:
    assert budget[kind, size].mean == pytest.approx(expected, abs=within)


def test_quantiles_are_in_order_and_larger_errors_cost_more(
    budget: dict[tuple[str, float], ErrorCost],
) -> None:
    for cost in budget.values():
        assert list(cost.quantiles) == sorted(cost.quantiles)
        assert cost.quantiles[0] <= cost.mean <= cost.quantiles[-1]
    assert budget["position_mm", 0.3].mean > budget["position_mm", 1.0].mean > budget["position_mm", 3.0].mean


def test_the_first_unit_makes_the_frame_and_keeps_its_pose(units: list[UnitPose]) -> None:
    alone = error_budget(units[:1], B_MM, AIR, np.random.default_rng(1), draws=2)
    assert all(cost.mean == 1.0 for cost in alone)


def test_the_same_seed_gives_the_same_budget(units: list[UnitPose]) -> None:
    first, second = (error_budget(units, B_MM, AIR, np.random.default_rng(3), draws=2) for _ in range(2))
    assert first == second


def test_the_budget_is_drawn(budget: dict[tuple[str, float], ErrorCost], tmp_path: Path) -> None:
    paths = draw_error_budget(list(budget.values()), "a budget", tmp_path / "budget")
    assert [path.name for path in paths] == ["budget.png", "budget.svg"]
    before = paths[1].read_bytes()
    draw_error_budget(list(budget.values()), "a budget", tmp_path / "budget")
    assert paths[1].read_bytes() == before
