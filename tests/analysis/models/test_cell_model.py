"""The mixed model of all answers against lme4 with emmeans (reference/models.R), and against integrals."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from autd_analysis.data.design import Condition, Design, StudyFactor
from autd_analysis.models.cell_model import LINKS, CellModel, LinkName, cell_model, cell_models
from autd_analysis.models.glmm import fit_glmm
from autd_analysis.rates.numbers import ParticipantRate
from scipy.integrate import quad
from scipy.special import expit, logit, ndtr
from scipy.stats import norm

from autd_trials.protocol.schema import Comparison
from tests.analysis.models.studies import CLOTHING, STUDIES, r_values, rates, study

FREQUENCIES = (25.0, 50.0, 100.0)
LEVELS: list[Condition] = [(("modulation_hz", frequency),) for frequency in FREQUENCIES]
EFFECTS = [f"effect{{}} {frequency:g}" for frequency in FREQUENCIES]


def fitted(number: int, link: LinkName = "logit", nodes: int = 9) -> CellModel:
    return cell_model(rates(number), CLOTHING, LEVELS, link, nodes)


def cell_name(condition: Condition) -> str:
    levels = dict(condition)
    return f"{levels['modulation_hz']:g} {levels['clothing']}"


@pytest.mark.parametrize("number", STUDIES)
@pytest.mark.parametrize("link", LINKS)
def test_means_effects_and_interaction_are_those_of_emmeans(number: int, link: LinkName) -> None:
    """With probit glmer's Laplace approximation takes expected curvature, ours that of the likelihood."""
    expected = r_values("models.csv", number, f"emmeans_{link}")
    model = fitted(number, link, nodes=1)
    absolute, relative = (1e-3, 0.002) if link == "logit" else (0.01, 0.01)
    assert len(model.means) == 6
    for mean in model.means:
        cell = cell_name(mean.condition)
        assert mean.predictor == pytest.approx(expected[f"mean {cell}"], abs=absolute)
        assert mean.standard_error == pytest.approx(expected[f"se {cell}"], rel=relative)
        assert mean.average == pytest.approx(expected[f"probability {cell}"], abs=absolute)
        ends = mean.average_interval.low, mean.average_interval.high
        assert ends == pytest.approx((expected[f"low {cell}"], expected[f"high {cell}"]), abs=absolute)
    found = {name: [expected[each.format(name)] for each in EFFECTS] for name in ("", " se", " z", " holm")}
    assert [each.difference for each in model.effects] == pytest.approx(found[""], abs=absolute)
    assert [each.standard_error for each in model.effects] == pytest.approx(found[" se"], rel=relative)
    assert [each.z for each in model.effects] == pytest.approx(found[" z"], abs=0.03)
    assert [each.p_holm for each in model.effects] == pytest.approx(found[" holm"], abs=0.01)
    assert model.interaction is not None
    assert model.interaction.statistic == pytest.approx(expected["interaction lr"], abs=0.01)
    assert (model.interaction.df, model.interaction.over) == (2, "modulation_hz")


def deviation(model: CellModel, side: float) -> float:
    """Standard deviation of a condition's random part, from SDs and correlation."""
    assert model.fit is not None
    first, second = model.fit.standard_deviations
    return math.sqrt(first**2 + (side * second) ** 2 + 2 * side * first * second * (model.correlation or 0.0))


def test_the_populations_probability_is_the_integral_over_people() -> None:
    model = fitted(3)
    for mean in model.means:
        spread = deviation(model, 0.5 if ("clothing", "inner") in mean.condition else -0.5)
        whole = quad(lambda u, m=mean, s=spread: expit(m.predictor + s * u) * norm.pdf(u), -9, 9)[0]
        assert mean.population == pytest.approx(whole, abs=1e-9)
        assert abs(mean.population - 0.5) < abs(mean.average - 0.5)
        assert mean.population_interval is not None
        assert mean.population_interval.low < mean.population < mean.population_interval.high


def test_with_probit_the_populations_probability_has_a_closed_form() -> None:
    model = fitted(4, "probit")
    for mean in model.means:
        spread = deviation(model, 0.5 if ("clothing", "inner") in mean.condition else -0.5)
        assert mean.population == pytest.approx(float(ndtr(mean.predictor / math.hypot(1, spread))), abs=1e-9)


def test_the_populations_interval_is_the_delta_method_with_all_parameters() -> None:
    model = fitted(5)
    fit = model.fit
    assert fit is not None
    parameters = np.concatenate([fit.coefficients, fit.factor[np.tril_indices(2)]])

    def population_logit(values: np.ndarray, place: int, side: float) -> float:
        factor = np.array([[values[6], 0.0], [values[7], values[8]]])
        spread = float(np.linalg.norm(factor.T @ (1.0, side)))
        return float(logit(quad(lambda u: expit(values[place] + spread * u) * norm.pdf(u), -9, 9)[0]))

    steps = 1e-4 * np.eye(9)
    for place, mean in enumerate(model.means):
        side = 0.5 if ("clothing", "inner") in mean.condition else -0.5
        slopes = [
            population_logit(parameters + step, place, side)
            - population_logit(parameters - step, place, side)
            for step in steps
        ]
        gradient = np.array(slopes) / 2e-4
        error = math.sqrt(gradient @ fit.parameter_covariance @ gradient)
        middle = logit(mean.population)
        assert mean.population_interval is not None
        assert logit(mean.population_interval.high) - middle == pytest.approx(1.959964 * error, rel=1e-3)
        assert middle - logit(mean.population_interval.low) == pytest.approx(1.959964 * error, rel=1e-3)


def test_the_information_is_that_of_differences_of_laplaces_likelihood() -> None:
    """Study 5 has 120 trials a person, where both approximations are nearly the same."""
    exact, differences = fit_glmm(study(5)), fit_glmm(study(5), nodes=1)
    errors = [np.sqrt(np.diag(fit.parameter_covariance)) for fit in (exact, differences)]
    assert errors[0] == pytest.approx(errors[1], rel=0.03)


def counts(felt: np.ndarray, trials: int = 10) -> list[ParticipantRate]:
    """Counts of shape (participants, 3 frequencies, 2 clothings)."""
    return [
        ParticipantRate(
            f"{person:02}",
            (("modulation_hz", frequency), ("clothing", clothing)),
            int(felt[person, row, column]),
            trials,
            None,
            None,
        )
        for person in range(len(felt))
        for row, frequency in enumerate(FREQUENCIES)
        for column, clothing in enumerate(("inner", "both"))
    ]


def test_people_who_are_alike_do_not_vary_and_show_their_own_rates() -> None:
    model = cell_model(counts(np.tile([[6, 3], [5, 4], [8, 5]], (8, 1, 1))), CLOTHING, LEVELS)
    assert model.fit is not None
    assert model.fit.singular
    assert model.correlation is None
    assert any("singular" in note for note in model.notes)
    expected = [0.6, 0.3, 0.5, 0.4, 0.8, 0.5]
    assert [mean.average for mean in model.means] == pytest.approx(expected, abs=1e-3)
    assert [mean.population for mean in model.means] == pytest.approx(expected, abs=1e-3)
    assert [each.difference for each in model.effects] == pytest.approx(
        [logit(0.6) - logit(0.3), logit(0.5) - logit(0.4), logit(0.8) - logit(0.5)], abs=1e-3
    )


@pytest.mark.parametrize("felt", [0, 10])
def test_separated_answers_are_penalised_and_said(felt: int) -> None:
    base = np.array([[6, 3], [5, 4], [8, 5]]) + np.arange(8)[:, None, None] % 3 - 1
    base[:, 2, 0] = felt
    model = cell_model(counts(base), CLOTHING, LEVELS)
    assert model.penalised
    assert any("Firth" in note for note in model.notes)
    assert len(model.effects) == 3
    assert all(np.isfinite([each.difference, each.standard_error, each.p]).all() for each in model.effects)
    assert (model.effects[2].difference > 0) == (felt == 10)


@pytest.mark.parametrize("felt", [0, 10])
def test_a_study_in_which_all_or_nothing_was_felt_shows_no_effect(felt: int) -> None:
    model = cell_model(counts(np.full((8, 3, 2), felt)), CLOTHING, LEVELS)
    assert all(each.difference == pytest.approx(0, abs=1e-6) for each in model.effects)
    assert len(model.effects) == 3
    assert all((mean.average > 0.5) == (felt == 10) for mean in model.means)


@pytest.mark.parametrize("people", [1, 3])
def test_too_few_people_have_no_model(people: int) -> None:
    model = cell_model(counts(np.full((people, 3, 2), 5)), CLOTHING, LEVELS)
    assert (model.fit, model.means, model.effects, model.interaction) == (None, (), (), None)
    assert model.notes == ("no mixed model with fewer than 4 participants",)


def test_without_any_answer_there_is_no_model() -> None:
    assert cell_model(counts(np.zeros((5, 3, 2)), trials=0), CLOTHING, LEVELS).fit is None


def test_a_condition_without_trials_has_no_mean_and_no_effect() -> None:
    empty = [
        rate
        if cell_name(rate.condition) != "50 both"
        else ParticipantRate("1", rate.condition, 0, 0, None, None)
        for rate in rates(1)
    ]
    model = cell_model(empty, CLOTHING, LEVELS)
    assert [cell_name(mean.condition) for mean in model.means] == [
        cell_name(mean.condition) for mean in fitted(1).means if cell_name(mean.condition) != "50 both"
    ]
    assert [each.at for each in model.effects] == [LEVELS[0], LEVELS[2]]
    assert model.interaction is not None
    assert model.interaction.df == 1


def design(*comparisons: Comparison) -> Design:
    hertz = StudyFactor("modulation_hz", FREQUENCIES, {}, within_block=True)
    clothing = StudyFactor("clothing", ("inner", "both"), {}, within_block=False)
    return Design("chest", None, (hertz, clothing), comparisons)


def test_every_compared_pair_has_a_model_by_either_link() -> None:
    over_all = Comparison(factor="modulation_hz", first=100.0, second=25.0)
    at_each = Comparison(factor="clothing", first="inner", second="both", at_each="modulation_hz")
    models: Sequence[CellModel] = cell_models(rates(4), design(over_all, at_each))
    assert [(each.compared and each.compared.factor, each.link) for each in models] == [
        ("modulation_hz", "logit"),
        ("modulation_hz", "probit"),
        ("clothing", "logit"),
        ("clothing", "probit"),
    ]
    first, _, third, _ = models
    assert first.interaction is None
    (effect,) = first.effects
    means = {cell_name(mean.condition): mean.predictor for mean in first.means}
    expected = (means["100 inner"] + means["100 both"] - means["25 inner"] - means["25 both"]) / 2
    assert effect.difference == pytest.approx(expected)
    assert len(third.effects) == 3


def test_without_comparisons_there_is_a_random_intercept_alone() -> None:
    logit_model, probit_model = cell_models(rates(4), design())
    assert (logit_model.link, probit_model.link) == ("logit", "probit")
    assert len(logit_model.means) == 6
    assert logit_model.effects == ()
    assert logit_model.correlation is None
    expected = r_values("glmm.csv", 4, "intercept_25")
    found = {cell_name(mean.condition): mean.predictor for mean in logit_model.means}
    assert found == pytest.approx({cell: expected[cell] for cell in found}, abs=1e-3)
