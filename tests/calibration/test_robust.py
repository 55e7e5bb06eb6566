"""Registration with gross outliers."""

import numpy as np
import pytest
from numpy.typing import NDArray

from autd_trials.calibration.rigid import fit_rigid
from autd_trials.calibration.robust import (
    NORMAL_MAD_FACTOR,
    PRINTED_MAD_FACTOR,
    register_as_the_paper,
    register_robustly,
)
from tests.calibration.scenes import cube, scene

Points = NDArray[np.float64]

AROUND = scene(0, 90)


def pairs(outliers: float, seed: int, points: int = 119) -> tuple[Points, Points, NDArray[np.bool_]]:
    """What unit 2 and unit 1 see, and which pairs are right."""
    generator = np.random.default_rng(seed)
    cloud = cube(points, 500, generator)
    first, second = (AROUND.seen(cloud, unit, generator) for unit in (0, 1))
    wrong = np.arange(points) < outliers * points
    second[wrong] = AROUND.poses[1].inverse().apply(cube(int(wrong.sum()), 500, generator))
    return second, first, ~wrong


@pytest.mark.parametrize("outliers", [0.0, 0.3, 0.5, 0.6])
def test_up_to_60_percent_of_wrong_pairs_spoil_nothing(outliers: float) -> None:
    errors = []
    for seed in range(20):
        source, target, right = pairs(outliers, seed)
        found = register_robustly(source, target, np.random.default_rng(seed))
        errors.append(AROUND.centre_error_mm(found.motion))
        assert found.inliers[right].mean() > 0.8
        assert found.inliers[~right].sum() <= 5
        assert found.noise_mm == pytest.approx(2.7, abs=0.7)  # sqrt((9 + 1 + 1) / 3 * 2)
    assert max(errors) < 2.0


def test_the_gate_follows_the_noise() -> None:
    for noise_mm in (0.0, 1.0, 20.0):
        generator = np.random.default_rng(5)
        source = cube(200, 500, generator)
        target = source + generator.normal(0, 1, source.shape) * noise_mm
        target[:60] = cube(60, 500, generator)
        found = register_robustly(source, target, generator)
        assert found.noise_mm == pytest.approx(noise_mm, rel=0.15, abs=0.01)
        assert found.inliers[60:].mean() > 0.95


def test_the_papers_weights_solve_its_equations() -> None:
    source, target, right = pairs(0.3, 7)
    motion, weights = register_as_the_paper(source, target)
    distances = np.linalg.norm(target - motion.apply(source), axis=1)
    gate = 2 * np.median(distances) / NORMAL_MAD_FACTOR
    expected = np.where(distances < gate, (1 - (distances / gate) ** 2) ** 2, 0)
    assert weights == pytest.approx(expected, abs=1e-6)
    again = fit_rigid(source, target, weights)
    assert motion.translation_mm == pytest.approx(again.translation_mm, abs=1e-6)
    assert not weights[~right].any()
    assert AROUND.centre_error_mm(motion) < 2


def test_the_misprint_hardly_matters() -> None:
    source, target, _ = pairs(0.0, 8)
    errors = [
        AROUND.centre_error_mm(register_as_the_paper(source, target, factor)[0])
        for factor in (NORMAL_MAD_FACTOR, PRINTED_MAD_FACTOR)
    ]
    assert errors[0] == pytest.approx(errors[1], abs=0.05)
