"""Mixed models against R's lme4 (reference/glmm.R) and against integrals computed otherwise."""

import numpy as np
import pytest
from autd_analysis.models.glmm import BinomialRows, fit_glmm, likelihood_ratio
from autd_analysis.models.links import PROBIT
from scipy.special import expit

from tests.analysis.models.studies import CELLS, STUDIES, r_values, study


def lme4(number: int, model: str) -> dict[str, float]:
    return r_values("glmm.csv", number, model)


@pytest.mark.parametrize("number", STUDIES)
def test_laplace_with_a_random_slope_is_that_of_glmer(number: int) -> None:
    expected = lme4(number, "slope_laplace")
    fit = fit_glmm(study(number), nodes=1)
    assert fit.coefficients == pytest.approx([expected[cell] for cell in CELLS], abs=1e-4)
    assert fit.standard_deviations == pytest.approx([expected["sd 1"], expected["sd 2"]], abs=1e-4)
    errors = np.sqrt(np.diag(fit.covariance))
    assert errors == pytest.approx([expected[f"se {cell}"] for cell in CELLS], rel=0.02)


@pytest.mark.parametrize("number", STUDIES)
def test_quadrature_with_a_random_intercept_is_that_of_glmer_with_25_nodes(number: int) -> None:
    expected = lme4(number, "intercept_25")
    fit = fit_glmm(study(number, slope=False))
    assert fit.coefficients == pytest.approx([expected[cell] for cell in CELLS], abs=1e-3)
    assert fit.standard_deviations == pytest.approx([expected["sd 1"]], abs=1e-3)
    errors = np.sqrt(np.diag(fit.covariance))
    assert errors == pytest.approx([expected[f"se {cell}"] for cell in CELLS], rel=0.01)


@pytest.mark.parametrize("number", STUDIES)
def test_the_likelihood_ratio_is_that_of_glmer(number: int) -> None:
    full = study(number)
    # without a difference between the cells at 100 Hz
    merged = np.column_stack([full.fixed[:, :4], full.fixed[:, 4] + full.fixed[:, 5]])
    reduced = BinomialRows(full.felt, full.trials, merged, full.random, full.participant)
    statistic, p = likelihood_ratio(fit_glmm(full, nodes=1), fit_glmm(reduced, nodes=1), df=1)
    assert statistic == pytest.approx(lme4(number, "slope_laplace")["lr 100"], abs=5e-3)
    assert 0 <= p <= 1


@pytest.mark.parametrize("number", STUDIES)
def test_probit_by_quadrature_is_that_of_glmer_with_25_nodes(number: int) -> None:
    expected = r_values("models.csv", number, "probit_25")
    fit = fit_glmm(study(number, slope=False), link=PROBIT)
    assert fit.coefficients == pytest.approx([expected[cell] for cell in CELLS], abs=1e-3)
    assert fit.standard_deviations == pytest.approx([expected["sd 1"]], abs=1e-3)


def test_the_likelihood_is_the_integral() -> None:
    rows = study(3)
    fit = fit_glmm(rows)
    step = 0.05  # the trapezoidal rule over a whole line converges faster than any power of the step
    line = np.arange(-8, 8 + step, step)
    first, second = (axis.ravel() for axis in np.meshgrid(line, line))
    normal = np.exp(-(first**2 + second**2) / 2) / (2 * np.pi)
    total = 0.0
    for participant in range(8):
        mine = rows.participant == participant
        effects = fit.factor @ np.array([first, second])
        means = expit((rows.fixed[mine] @ fit.coefficients)[:, None] + rows.random[mine] @ effects)
        felt, trials = rows.felt[mine][:, None], rows.trials[mine][:, None]
        likelihood = np.prod(means**felt * (1 - means) ** (trials - felt), axis=0)
        total += np.log(likelihood @ normal * step**2)
    assert fit.log_likelihood == pytest.approx(total, abs=1e-4)


def test_nothing_is_gained_in_any_direction() -> None:
    rows = study(2)
    fit = fit_glmm(rows)
    shifted = [
        BinomialRows(
            rows.felt, rows.trials, rows.fixed * (1 + step * np.eye(6)[cell]), rows.random, rows.participant
        )
        for cell in range(6)
        for step in (-0.01, 0.01)
    ]
    # a rescaled column is the same model: the maximum must be the same, wherever the steps came from
    for other in shifted:
        assert fit_glmm(other).log_likelihood == pytest.approx(fit.log_likelihood, abs=1e-6)


def test_separated_answers_do_not_converge() -> None:
    rows = study(1)
    felt = np.where(rows.fixed[:, 5] > 0, rows.trials, rows.felt)
    fit = fit_glmm(BinomialRows(felt, rows.trials, rows.fixed, rows.random, rows.participant))
    assert not fit.converged


def test_people_who_do_not_differ_give_a_singular_fit() -> None:
    cells = np.tile(np.arange(6), 8)
    rows = BinomialRows(
        np.tile([5.0, 4.0, 6.0, 3.0, 7.0, 5.0], 8),
        np.full(48, 10.0),
        np.eye(6)[cells],
        np.column_stack([np.ones(48), np.where(cells % 2, 0.5, -0.5)]),
        np.repeat(np.arange(8), 6),
    )
    fit = fit_glmm(rows)
    assert fit.singular
    assert expit(fit.coefficients) == pytest.approx([0.5, 0.4, 0.6, 0.3, 0.7, 0.5], abs=1e-3)


def test_a_model_that_fits_as_well_has_a_ratio_of_zero() -> None:
    fit = fit_glmm(study(1))
    assert likelihood_ratio(fit, fit, 1) == (0.0, 1.0)
