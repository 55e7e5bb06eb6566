"""GEE against geepack (reference/models.R), statsmodels, and matrices of single answers."""

import numpy as np
import pytest
import statsmodels.api as sm
from autd_analysis.models.glmm import BinomialRows
from autd_analysis.sensitivity.gee import CORRECTIONS, fit_gee
from scipy.linalg import sqrtm

from tests.analysis.models.studies import CELLS, STUDIES, r_values, single_answers, study, uneven

AT_100 = np.array([0.0, 0.0, 0.0, 0.0, 1.0, -1.0])


@pytest.mark.parametrize("number", STUDIES)
def test_estimates_and_uncorrected_errors_are_those_of_geepack(number: int) -> None:
    expected = r_values("models.csv", number, "gee")
    fit = fit_gee(study(number))
    assert fit is not None
    assert fit.coefficients == pytest.approx([expected[cell] for cell in CELLS], abs=1e-8)
    covariance = fit.covariance("none")
    assert covariance is not None
    assert np.sqrt(np.diag(covariance)) == pytest.approx([expected[f"se {cell}"] for cell in CELLS], rel=1e-6)


def test_with_lost_trials_they_are_near_geepacks_which_counts_no_parameters_in_the_correlation() -> None:
    expected = r_values("models.csv", 4, "gee_uneven")
    fit = fit_gee(uneven(4))
    assert fit is not None
    assert fit.coefficients == pytest.approx([expected[cell] for cell in CELLS], abs=0.01)


@pytest.mark.parametrize("number", [1, 2, 4])
def test_with_lost_trials_they_are_those_of_statsmodels_and_its_bias_reduced_ones(number: int) -> None:
    rows = uneven(number)
    felt, fixed, participant = single_answers(rows)
    structure = sm.cov_struct.Exchangeable()
    model = sm.GEE(felt, fixed, groups=participant, family=sm.families.Binomial(), cov_struct=structure)
    plain = model.fit(maxiter=200, ctol=1e-10)
    reduced = model.fit(maxiter=200, ctol=1e-10, cov_type="bias_reduced")
    fit = fit_gee(rows)
    assert fit is not None
    assert fit.coefficients == pytest.approx(plain.params, abs=1e-8)
    assert fit.correlation == pytest.approx(float(structure.dep_params), abs=1e-8)
    assert fit.covariance("none") == pytest.approx(plain.cov_robust, rel=1e-6, abs=1e-9)
    assert fit.covariance("mancl_derouen") == pytest.approx(reduced.cov_robust_bc, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("number", [1, 3])
def test_kauermann_carroll_and_degrees_of_freedom_by_full_matrices(number: int) -> None:
    """The root of I - H is taken of the matrix itself; residuals are errors less what the fit takes off."""
    rows = uneven(number)
    fit = fit_gee(rows)
    assert fit is not None
    felt, fixed, participant = single_answers(rows)
    means = 1 / (1 + np.exp(-fixed @ fit.coefficients))
    slopes = (means * (1 - means))[:, None] * fixed
    spread = np.sqrt(means * (1 - means))
    alike = participant[:, None] == participant
    working = np.where(np.eye(len(felt)) > 0, 1.0, fit.correlation * alike) * np.outer(spread, spread)
    inverse = np.linalg.inv(working)
    bread = np.linalg.inv(slopes.T @ inverse @ slopes)
    everyone = [participant == each for each in np.unique(participant)]
    maps, meat = [], np.zeros_like(bread)
    for mine in everyone:
        own = np.linalg.inv(working[np.ix_(mine, mine)])
        leverage = slopes[mine] @ bread @ slopes[mine].T @ own
        enlarged = np.linalg.inv(sqrtm(np.eye(int(mine.sum())) - leverage).real)
        maps.append(slopes[mine].T @ own @ enlarged)
        score = maps[-1] @ (felt - means)[mine]
        meat += np.outer(score, score)
    covariance = bread @ meat @ bread
    assert fit.covariance("kauermann_carroll") == pytest.approx(covariance, rel=1e-6, abs=1e-9)
    residual = np.eye(len(felt)) - slopes @ bread @ slopes.T @ inverse
    scores = np.array(
        [AT_100 @ bread @ one @ residual[mine] for one, mine in zip(maps, everyone, strict=True)]
    )
    products = scores @ working @ scores.T
    effect = fit.effect(AT_100, "kauermann_carroll")
    assert effect is not None
    assert effect.standard_error == pytest.approx(np.sqrt(AT_100 @ covariance @ AT_100), rel=1e-6)
    assert effect.df == pytest.approx(np.trace(products) ** 2 / np.trace(products @ products), rel=1e-6)


def test_with_equal_trials_kauermann_carroll_is_the_paired_t_test_of_linear_contributions() -> None:
    rows = study(2)
    fit = fit_gee(rows)
    assert fit is not None
    effect = fit.effect(AT_100, "kauermann_carroll")
    assert effect is not None
    felt = np.array([rows.felt[rows.fixed[:, cell] > 0] for cell in (4, 5)]) / 10
    means = felt.mean(axis=1)
    contributions = np.diff(felt / (means * (1 - means))[:, None], axis=0)[0]
    assert effect.standard_error == pytest.approx(contributions.std(ddof=1) / np.sqrt(12))
    assert effect.df == pytest.approx(11)
    assert effect.interval.low < effect.logits < effect.interval.high


def test_corrections_enlarge_the_error_in_their_order() -> None:
    fit = fit_gee(uneven(3))
    assert fit is not None
    errors = [effect.standard_error for name in CORRECTIONS if (effect := fit.effect(AT_100, name))]
    assert len(errors) == 3
    assert errors == sorted(errors)


@pytest.mark.parametrize("all_felt", [True, False])
def test_separated_answers_have_no_fit(all_felt: bool) -> None:
    rows = study(1)
    felt = np.where(rows.fixed[:, 5] > 0, rows.trials * all_felt, rows.felt)
    assert fit_gee(BinomialRows(felt, rows.trials, rows.fixed, rows.random, rows.participant)) is None


def small(felt: list[float], participant: list[int]) -> BinomialRows:
    cells = np.arange(len(felt)) % 2
    ones = np.ones((len(felt), 1))
    trials = np.full(len(felt), 10.0)
    return BinomialRows(np.array(felt), trials, np.eye(2)[cells], ones, np.array(participant))


def test_people_who_are_alike_give_no_error() -> None:
    fit = fit_gee(small([6, 3, 6, 3, 6, 3, 6, 3], [0, 0, 1, 1, 2, 2, 3, 3]))
    assert fit is not None
    assert fit.coefficients == pytest.approx(np.log([6 / 4, 3 / 7]))
    assert fit.effect(np.array([1.0, -1.0]), "kauermann_carroll") is None


def test_one_participant_determines_all_and_gives_no_corrected_error() -> None:
    fit = fit_gee(small([6, 3], [0, 0]))
    assert fit is not None
    assert fit.covariance("mancl_derouen") is None
    assert fit.effect(np.array([1.0, -1.0]), "none") is None


def test_one_trial_each_can_be_fitted() -> None:
    rows = small([1, 0, 1, 0, 0, 1, 1, 0, 1, 1], [0, 0, 1, 1, 2, 2, 3, 3, 4, 4])
    one = BinomialRows(rows.felt, np.ones(10), rows.fixed, rows.random, rows.participant)
    fit = fit_gee(one)
    assert fit is not None
    assert fit.coefficients == pytest.approx(np.log([4 / 1, 2 / 3]))
