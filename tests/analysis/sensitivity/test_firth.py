"""Firth's penalty against brglm2 (reference/models.R), its closed form, and plain maximisation."""

import math

import numpy as np
import pytest
from autd_analysis.rates.numbers import ConditionRate
from autd_analysis.sensitivity.firth import firth_effect
from autd_analysis.sensitivity.firth_logits import condition_logits
from scipy.optimize import brentq, minimize

from tests.analysis.models.studies import CELLS, STUDIES, r_values, study

CONTRAST = np.array([0.0, 0.0, 0.0, 1.0, -1.0])


@pytest.mark.parametrize("number", STUDIES)
def test_a_separated_study_with_participants_levels_is_that_of_brglm2(number: int) -> None:
    rows = study(number)
    at_100 = rows.fixed[:, 4:].sum(axis=1) > 0
    felt = np.where(rows.fixed[:, 4] > 0, rows.trials, rows.felt)[at_100]
    people = np.eye(int(rows.participant.max()) + 1)[rows.participant[at_100]][:, 1:]
    design = np.column_stack([people, rows.fixed[at_100, 4:]])
    weights = np.array([*np.zeros(people.shape[1]), 1.0, -1.0])
    found = firth_effect(felt, rows.trials[at_100], design, weights)
    expected = r_values("models.csv", number, "firth_separated")
    assert found is not None
    assert found.logits == pytest.approx(expected["100 inner"], abs=1e-5)
    assert found.standard_error == pytest.approx(expected["se 100 inner"], rel=1e-5)


@pytest.mark.parametrize("number", STUDIES)
def test_logits_of_cells_are_those_of_brglm2(number: int) -> None:
    rows = study(number)
    expected = r_values("models.csv", number, "firth_cells")
    for place, cell in enumerate(CELLS):
        found = firth_effect(rows.felt, rows.trials, rows.fixed, np.eye(6)[place])
        assert found is not None
        assert found.logits == pytest.approx(expected[cell], abs=1e-6)
        assert found.standard_error == pytest.approx(expected[f"se {cell}"], rel=1e-6)


FELT = np.array([3.0, 0.0, 5.0, 1.0, 5.0, 2.0, 5.0, 0.0])
TRIALS = np.full(8, 5.0)
DESIGN = np.column_stack([np.repeat(np.eye(4)[:, 1:], 2, axis=0), np.tile(np.eye(2), (4, 1))])


def penalised(coefficients: np.ndarray) -> float:
    predictors = DESIGN @ coefficients
    means = 1 / (1 + np.exp(-predictors))
    information = DESIGN.T @ np.diag(TRIALS * means * (1 - means)) @ DESIGN
    plain = (FELT * np.log(means) + (TRIALS - FELT) * np.log(1 - means)).sum()
    return float(plain + 0.5 * math.log(np.linalg.det(information)))


def profile(difference: float) -> float:
    """The largest penalised likelihood with this difference of the last two coefficients."""

    def loss(free: np.ndarray) -> float:
        return -penalised(np.array([*free, free[-1] - difference]))

    return -float(minimize(loss, np.zeros(4), method="BFGS", options={"gtol": 1e-6}).fun)


def test_estimate_interval_and_test_are_those_of_plain_maximisation() -> None:
    found = firth_effect(FELT, TRIALS, DESIGN, CONTRAST)
    assert found is not None

    def loss(coefficients: np.ndarray) -> float:
        return -penalised(coefficients)

    best = minimize(loss, np.zeros(5), method="BFGS", options={"gtol": 1e-6})
    assert found.logits == pytest.approx(CONTRAST @ best.x, abs=1e-4)
    assert found.statistic == pytest.approx(2 * (-best.fun - profile(0.0)), abs=1e-5)
    level = -best.fun - 3.841458820694124 / 2
    low, high = (brentq(lambda d: profile(d) - level, found.logits, found.logits + s) for s in (-15, 15))
    assert (found.interval.low, found.interval.high) == pytest.approx((low, high), abs=1e-3)


def rate(felt: int, n: int) -> ConditionRate:
    condition = (("clothing", "inner"),)
    return ConditionRate(condition, None, None, None, None, participants=4, felt=felt, n=n)


@pytest.mark.parametrize(("felt", "n"), [(0, 40), (40, 40), (17, 40), (0, 1), (1, 1)])
def test_a_conditions_logit_has_a_closed_form(felt: int, n: int) -> None:
    (found,) = condition_logits([rate(felt, n)])
    assert found.effect is not None
    assert found.effect.logits == pytest.approx(math.log((felt + 0.5) / (n - felt + 0.5)), abs=1e-5)
    assert found.probability == pytest.approx(1 / (1 + math.exp(-found.effect.logits)), abs=1e-6)
    assert found.separated is (felt in (0, n))
    assert found.effect.interval.low < found.effect.logits < found.effect.interval.high


def test_a_condition_without_trials_has_none() -> None:
    (found,) = condition_logits([rate(0, 0)])
    assert (found.effect, found.probability, found.separated) == (None, None, None)


def test_columns_that_cannot_be_told_apart_give_no_effect() -> None:
    design = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert firth_effect(np.array([3.0, 4.0]), np.full(2, 9.0), design, np.array([1.0, 0.0, -1.0])) is None
