"""Rigid motions: against scipy's alignment, and what a motion is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from autd_trials.calibration.rigid import RigidMotion, fit_rigid


def random_motion(generator: np.random.Generator) -> RigidMotion:
    return RigidMotion(Rotation.random(random_state=generator).as_matrix(), generator.normal(0, 500, 3))


@given(seed=st.integers(0, 10_000), weighted=st.booleans())
def test_the_fit_is_that_of_scipy(seed: int, weighted: bool) -> None:
    generator = np.random.default_rng(seed)
    source = generator.normal(0, 300, (20, 3))
    target = random_motion(generator).apply(source) + generator.normal(0, 5, (20, 3))
    weights = generator.uniform(0.1, 2, 20) if weighted else np.ones(20)
    found = fit_rigid(source, target, weights)
    share = weights / weights.sum()
    rotation = Rotation.align_vectors(target - share @ target, source - share @ source, weights=weights)[0]
    assert found.rotation == pytest.approx(rotation.as_matrix(), abs=1e-9)
    assert found.translation_mm == pytest.approx(share @ target - found.rotation @ (share @ source), abs=1e-8)


def test_points_in_a_plane_never_give_a_reflection() -> None:
    generator = np.random.default_rng(1)
    source = generator.normal(0, 300, (10, 3)) * [1, 1, 0]
    motion = random_motion(generator)
    found = fit_rigid(source, motion.apply(source))
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    assert found.rotation == pytest.approx(motion.rotation, abs=1e-9)


def test_several_sets_at_once_give_what_each_gives() -> None:
    generator = np.random.default_rng(2)
    source, target = generator.normal(0, 300, (2, 5, 8, 3))
    together = fit_rigid(source, target)
    for number in range(5):
        alone = fit_rigid(source[number], target[number])
        assert together.rotation[number] == pytest.approx(alone.rotation, abs=1e-9)
        assert together.translation_mm[number] == pytest.approx(alone.translation_mm, abs=1e-7)


def test_motions_follow_each_other_and_go_back() -> None:
    generator = np.random.default_rng(3)
    first, second = random_motion(generator), random_motion(generator)
    points = generator.normal(0, 300, (4, 3))
    assert second.after(first).apply(points) == pytest.approx(second.apply(first.apply(points)))
    assert first.inverse().apply(first.apply(points)) == pytest.approx(points)
    assert RigidMotion.identity().apply(points) == pytest.approx(points)
