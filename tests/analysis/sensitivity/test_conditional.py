"""Conditional logistic regression against R's clogit (reference/models.R), statsmodels, and enumeration."""

import itertools
import math

import numpy as np
import pytest
from autd_analysis.models.marginal import BinomialRows
from autd_analysis.sensitivity.conditional import fit_conditional
from statsmodels.discrete.conditional_models import ConditionalLogit

from tests.analysis.models.studies import CELLS, STUDIES, r_values, study


def counts(rows: BinomialRows, cells: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Felt and trials, participants by the cells named."""
    felt, trials = np.zeros((2, int(rows.participant.max()) + 1, len(CELLS)))
    places = rows.fixed.argmax(axis=1)
    felt[rows.participant, places], trials[rows.participant, places] = rows.felt, rows.trials
    columns = [CELLS.index(cell) for cell in cells]
    return felt[:, columns], trials[:, columns]


def against_first(conditions: int) -> np.ndarray:
    return np.eye(conditions)[:, 1:]


@pytest.mark.parametrize("number", STUDIES)
@pytest.mark.parametrize("model", ["clogit", "clogit_100"])
def test_estimates_errors_and_likelihood_ratio_are_those_of_clogit(number: int, model: str) -> None:
    expected = r_values("models.csv", number, model)
    cells = sorted(CELLS) if model == "clogit" else ["100 both", "100 inner"]
    felt, trials = counts(study(number), cells)
    fit = fit_conditional(felt, trials, against_first(len(cells)))
    null = fit_conditional(felt, trials, np.zeros((len(cells), 0)))
    assert fit is not None
    assert null is not None
    assert fit.coefficients == pytest.approx([expected[cell] for cell in cells[1:]], abs=1e-5)
    errors = np.sqrt(np.diag(fit.covariance))
    assert errors == pytest.approx([expected[f"se {cell}"] for cell in cells[1:]], rel=1e-5)
    assert 2 * (fit.log_likelihood - null.log_likelihood) == pytest.approx(expected["lr"], abs=1e-5)


FELT = np.array([[2.0, 1.0, 0.0], [1.0, 0.0, 1.0], [3.0, 1.0, 2.0], [0.0, 0.0, 0.0]])
TRIALS = np.array([[3.0, 2.0, 2.0], [2.0, 2.0, 3.0], [3.0, 2.0, 3.0], [3.0, 2.0, 2.0]])


def test_a_small_case_is_that_of_statsmodels() -> None:
    answers, columns, people = [], [], []
    for person, cell in itertools.product(range(4), range(3)):
        for trial in range(int(TRIALS[person, cell])):
            answers.append(float(trial < FELT[person, cell]))
            columns.append(against_first(3)[cell])
            people.append(person)
    with pytest.warns(Warning, match="groups"):  # the fourth tells nothing
        model = ConditionalLogit(np.array(answers), np.array(columns), groups=np.array(people))
    expected = model.fit(disp=0, gtol=1e-8)
    fit = fit_conditional(FELT, TRIALS, against_first(3))
    assert fit is not None
    assert fit.coefficients == pytest.approx(expected.params, abs=1e-3)
    assert np.sqrt(np.diag(fit.covariance)) == pytest.approx(expected.bse, rel=1e-3)
    assert fit.participants == 3


def test_the_likelihood_is_that_of_all_ways_to_feel_so_often() -> None:
    fit = fit_conditional(FELT, TRIALS, against_first(3))
    assert fit is not None
    logits = np.array([0.0, *fit.coefficients])
    total = 0.0
    for felt, trials in zip(FELT, TRIALS, strict=True):
        ways = itertools.product(*(range(int(n) + 1) for n in trials))
        weights = [
            math.prod(math.comb(int(n), k) for n, k in zip(trials, way, strict=True)) * math.exp(logits @ way)
            for way in ways
            if sum(way) == felt.sum()
        ]
        total += float(felt @ logits) - math.log(sum(weights))
    assert fit.log_likelihood == pytest.approx(total, abs=1e-10)


def test_many_trials_and_extreme_rates_lose_no_digits() -> None:
    """With one participant and two conditions it is Fisher's noncentral hypergeometric distribution."""
    felt, trials = np.array([[495.0, 20.0]]), np.array([[500.0, 500.0]])
    fit = fit_conditional(felt, trials, against_first(2))
    assert fit is not None
    k = np.arange(15, 501)
    logs = np.array([math.lgamma(501) - math.lgamma(j + 1) - math.lgamma(501 - j) for j in range(501)])
    weights = logs[k] + logs[515 - k] - k * fit.coefficients[0]
    shares = np.exp(weights - weights.max())
    assert (shares @ k) / shares.sum() == pytest.approx(495, abs=1e-3)


@pytest.mark.parametrize(
    "felt",
    [
        [[10, 5], [10, 3], [10, 0]],  # separated within participants
        [[10, 10], [0, 0], [10, 10]],  # nobody tells anything
        [[0, 0], [0, 0], [0, 0]],
    ],
)
def test_infinite_or_undetermined_effects_are_not_given(felt: list[list[int]]) -> None:
    assert fit_conditional(np.array(felt, float), np.full((3, 2), 10.0), against_first(2)) is None


def test_participants_with_one_condition_each_tell_nothing() -> None:
    felt, trials = np.array([[3.0, 0.0], [0.0, 4.0]]), np.array([[10.0, 0.0], [0.0, 10.0]])
    assert fit_conditional(felt, trials, against_first(2)) is None
