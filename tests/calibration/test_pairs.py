"""Points that are paired already, in frames that are no cameras."""

from datetime import UTC, datetime

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from autd_trials.acoustics.air import Air
from autd_trials.calibration.pairs import PairedPoints, solve_pairs
from autd_trials.calibration.report import report, report_text
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.solve import Solution
from autd_trials.errors import UsageError

TIME = datetime(2026, 11, 24, tzinfo=UTC)
TRUE = RigidMotion(
    Rotation.from_euler("xyz", [20, -50, 70], degrees=True).as_matrix(), np.array([900.0, -300, 150])
)


def pairs(count: int, noise_mm: float, generator: np.random.Generator, number: int = 2) -> PairedPoints:
    """A robot's frame, with the points around its origin, and another's."""
    here = generator.uniform(-700, 700, (count, 3))
    there = TRUE.inverse().apply(here) + generator.normal(0, noise_mm, (count, 3))
    return PairedPoints(1, number, here + generator.normal(0, noise_mm, (count, 3)), there)


def solved(
    *given: PairedPoints, names: tuple[str, ...] = ("robot", "tracker"), settings: Settings | None = None
) -> Solution:
    return solve_pairs(given, names, settings or Settings(), time=TIME, air=Air())


def shift_mm(solution: Solution, unit: int = 1) -> NDArray[np.float64]:
    return np.array(solution.calibration.units[unit].translation_mm) - TRUE.translation_mm


@pytest.mark.parametrize(("count", "noise_mm"), [(39, 10.0), (300, 10.0), (2600, 0.5)])
def test_pairs_are_registered_without_inventing_ranges_or_clocks(count: int, noise_mm: float) -> None:
    solution = solved(pairs(count, noise_mm, np.random.default_rng(1)))
    covariance = np.array(solution.calibration.units[1].covariance)[:3, :3]
    error = shift_mm(solution)
    assert error @ np.linalg.solve(covariance, error) < 16  # chi-square, 3 degrees of freedom: 99.9 %
    assert solution.calibration.units[1].range_error is None
    assert solution.clock_offsets_s is None
    assert solution.time_s is None
    assert solution.calibration.predicted_energy is None  # the frames are no units'
    assert not any("clock" in key for key in solution.calibration.settings)
    assert solution.calibration.settings["viewpoint of robot"] is False
    facts = report(solution)
    assert facts["units"][0]["clock_offset_s"] is None
    assert "clock" not in report_text(facts)
    assert not any("range" in warning for warning in solution.warnings)


def test_three_frames_are_paired_with_the_first_one() -> None:
    generator = np.random.default_rng(2)
    first, second = pairs(200, 1, generator), pairs(150, 1, generator, number=3)
    solution = solved(first, second, names=("a", "b", "c"))
    assert np.linalg.norm(shift_mm(solution, 1)) < 1
    assert np.linalg.norm(shift_mm(solution, 2)) < 1
    assert [unit.counts.points for unit in solution.calibration.units[1:] if unit.counts] == [200, 150]


def test_the_order_of_a_pair_does_not_matter() -> None:
    given = pairs(100, 1, np.random.default_rng(3))
    turned = PairedPoints(2, 1, given.points_second_mm, given.points_first_mm)
    assert shift_mm(solved(turned)) == pytest.approx(shift_mm(solved(given)), abs=1e-9)


def test_the_papers_method_takes_pairs_too() -> None:
    solution = solved(pairs(119, 2, np.random.default_rng(4)), settings=Settings(method="paper"))
    assert np.linalg.norm(shift_mm(solution)) < 2
    assert solution.calibration.method.endswith("pairs as given")


@pytest.mark.parametrize(
    ("numbers", "message"),
    [((1, 1), "between units 1 and 1 of 2"), ((1, 3), "units 1 and 3 of 2"), ((0, 1), "units 0 and 1 of 2")],
)
def test_units_that_do_not_exist_are_refused(numbers: tuple[int, int], message: str) -> None:
    points = np.random.default_rng(5).uniform(-300, 300, (50, 3))
    with pytest.raises(UsageError, match=message):
        solved(PairedPoints(*numbers, points, points + 1))


def test_pairs_that_lack_half_are_refused() -> None:
    points = np.random.default_rng(6).uniform(-300, 300, (50, 3))
    with pytest.raises(UsageError, match="different numbers of paired points"):
        solved(PairedPoints(1, 2, points, points[1:]))


def test_a_unit_that_is_not_paired_with_the_first_is_refused() -> None:
    generator = np.random.default_rng(7)
    with pytest.raises(UsageError, match="c and a have 0 points in common"):
        solved(pairs(50, 1, generator), names=("a", "b", "c"))
