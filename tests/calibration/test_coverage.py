"""The truth lies in the reported 95 % ellipsoid about as often as that says; the benchmark has more."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from autd_trials.calibration.sensor_model import SensorNoise
from tests.calibration.situations import Situation, judge

CASES = 14
SITUATIONS = (
    Situation("20 deg", (0, 20)),
    Situation("3 units", (0, 60, 120)),
    Situation("heavy tails", heavy_tails=True),
    Situation("wrong noise model", noise=SensorNoise(1.0, 3.0)),
    Situation("correlated noise", speed_m_s=0.5, seconds=10.0, correlated_s=0.1),
)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_truth_is_inside() -> None:
    """In each situation as far as few cases can say, and over all of them, which sees a common fault."""
    inside = {
        (situation.name, right_ranges): sum(
            judge(situation, seed, right_ranges=right_ranges).inside for seed in range(CASES)
        )
        for situation in SITUATIONS
        for right_ranges in (False, True)
    }
    assert min(inside.values()) >= binom.ppf(1e-3, CASES, 0.95), inside
    assert sum(inside.values()) >= binom.ppf(1e-3, CASES * len(inside), 0.95), inside


@pytest.mark.parametrize("angles_deg", [(0, 20), (0, 90)])
def test_the_default_is_never_clearly_worse_than_the_papers_method(angles_deg: tuple[float, ...]) -> None:
    """Neither where the ranges are right nor where points are no camera's, nor where noise is another."""
    right = Situation("right ranges", angles_deg, bias_mm=0.0, scale=0.0)
    for situation in (
        right,
        replace(right, name="isotropic centimetres, not declared", noise=SensorNoise(10, 10)),
        replace(right, name="noise across", noise=SensorNoise(1, 3)),
    ):
        judged = [judge(situation, seed) for seed in range(10)]
        ours, paper = (
            np.sqrt(np.mean(np.square(each)))
            for each in ([j.error_mm for j in judged], [j.paper_mm for j in judged])
        )
        assert ours < 1.15 * paper, situation.name
