"""The planned comparisons by GEE, conditional logistic regression and Firth's penalty."""

import numpy as np
import pytest
from autd_analysis.data.design import Condition, Design, StudyFactor
from autd_analysis.rates.numbers import ParticipantRate
from autd_analysis.sensitivity.conditional import fit_conditional
from autd_analysis.sensitivity.gee import fit_gee
from autd_analysis.sensitivity.numbers import CONDITIONAL, FIRTH, GEE_METHODS, OtherEstimate, other_estimates

from autd_trials.protocol.schema import Comparison
from tests.analysis.models.studies import CLOTHING, STUDIES, r_values, rates, study

AT_100: Condition = (("modulation_hz", 100.0),)
KAUERMANN_CARROLL = GEE_METHODS["kauermann_carroll"]


def estimates(
    its_rates: list[ParticipantRate], at_each: str | None = "modulation_hz"
) -> dict[tuple[Condition, str], OtherEstimate]:
    hertz = StudyFactor("modulation_hz", (25.0, 50.0, 100.0), {}, within_block=True)
    clothing = StudyFactor("clothing", ("inner", "both"), {}, within_block=False)
    planned = Comparison(factor="clothing", first="inner", second="both", at_each=at_each)
    found = other_estimates(its_rates, Design("chest", None, (hertz, clothing), (planned,)))
    assert all(each.contrast.overall == CLOTHING for each in found)
    return {(each.contrast.at, each.method): each for each in found}


@pytest.mark.parametrize("number", STUDIES)
def test_conditional_logistic_is_clogit_with_its_likelihood_ratio(number: int) -> None:
    expected = r_values("models.csv", number, "clogit_100")
    found = estimates(rates(number))[AT_100, CONDITIONAL]
    assert found.logits == pytest.approx(expected["100 inner"], abs=1e-5)
    assert found.standard_error == pytest.approx(expected["se 100 inner"], rel=1e-5)
    assert found.wald == pytest.approx(expected["100 inner"] / expected["se 100 inner"], abs=1e-4)
    assert found.ratio == pytest.approx(expected["lr"], abs=1e-5)


@pytest.mark.parametrize("number", STUDIES)
def test_gee_at_a_level_is_that_of_geepack(number: int) -> None:
    """Everybody has the same trials, so the other levels' answers do not matter to estimates and errors."""
    expected = r_values("models.csv", number, "gee")
    found = estimates(rates(number))[AT_100, KAUERMANN_CARROLL]
    assert found.logits == pytest.approx(expected["100 inner"] - expected["100 both"], abs=1e-8)
    assert found.df == pytest.approx(found.participants - 1)


def test_over_all_levels_the_mean_difference_is_compared() -> None:
    found = estimates(rates(1), at_each=None)
    weights = np.array([1.0, -1.0] * 3) / 3
    gee = fit_gee(study(1))
    assert gee is not None
    assert found[(), KAUERMANN_CARROLL].logits == pytest.approx(float(weights @ gee.coefficients), abs=1e-8)
    rows = study(1)
    felt, trials = np.zeros((2, 8, 6))
    cells = rows.fixed.argmax(axis=1)
    felt[rows.participant, cells], trials[rows.participant, cells] = rows.felt, rows.trials
    full = fit_conditional(felt, trials, np.eye(6)[:, 1:])
    # the last cell is what makes the mean difference zero
    constrained = np.vstack([np.eye(5), [1.0, -1.0, 1.0, -1.0, 1.0]])[:, 1:]
    reduced = fit_conditional(felt, trials, constrained)
    assert full is not None
    assert reduced is not None
    ratio = 2 * (full.log_likelihood - reduced.log_likelihood)
    assert found[(), CONDITIONAL].ratio == pytest.approx(ratio, abs=1e-6)
    assert found[(), CONDITIONAL].logits == pytest.approx(
        float(weights @ [0.0, *full.coefficients]), abs=1e-6
    )


def test_firths_is_near_conditional_logistic_where_nothing_is_separated() -> None:
    found = estimates(rates(4))
    conditional, firth = found[AT_100, CONDITIONAL], found[AT_100, FIRTH]
    assert firth.logits == pytest.approx(conditional.logits, abs=0.05)
    assert firth.ratio == pytest.approx(conditional.ratio, rel=0.05)


@pytest.mark.parametrize("felt", [0, 10])
def test_where_answers_are_separated_only_firths_is_given(felt: int) -> None:
    separated = [
        ParticipantRate(rate.participant, rate.condition, felt, 10, None, None)
        if set(AT_100) <= set(rate.condition) and ("clothing", "inner") in rate.condition
        else rate
        for rate in rates(1)
    ]
    found = estimates(separated)
    for method in (*GEE_METHODS.values(), CONDITIONAL):
        assert found[AT_100, method].logits is None
        assert found[AT_100, method].note
    firth = found[AT_100, FIRTH]
    assert firth.logits is not None
    assert firth.interval is not None
    assert (firth.logits > 0) == (felt == 10)
    assert np.isfinite([firth.interval.low, firth.interval.high]).all()


def test_too_few_people_are_not_compared() -> None:
    three = [rate for rate in rates(1) if rate.participant in ("1", "2", "3")]
    assert {(each.participants, each.trials) for each in estimates(three).values()} == {(3, 60)}
    assert all(
        each.logits is None and each.note and "fewer than 4" in each.note
        for each in estimates(three).values()
    )


def test_people_who_are_alike_have_no_gee_error() -> None:
    alike = [
        ParticipantRate(
            rate.participant,
            rate.condition,
            6 if ("clothing", "inner") in rate.condition else 3,
            10,
            None,
            None,
        )
        for rate in rates(1)
    ]
    found = estimates(alike)[AT_100, KAUERMANN_CARROLL]
    assert found.standard_error is None
    assert found.note
    assert "alike" in found.note


def test_participants_who_tell_nothing_are_not_counted_by_conditional_logistic() -> None:
    one_always = [
        ParticipantRate(rate.participant, rate.condition, 10, 10, None, None)
        if rate.participant == "1"
        else rate
        for rate in rates(1)
    ]
    felt = np.array([rate.felt for rate in one_always if set(AT_100) <= set(rate.condition)])
    totals = felt.reshape(8, 2).sum(axis=1)
    telling = int(((totals > 0) & (totals < 20)).sum())
    assert telling < 8
    found = estimates(one_always)
    assert (found[AT_100, CONDITIONAL].participants, found[AT_100, CONDITIONAL].trials) == (
        telling,
        20 * telling,
    )
    assert (found[AT_100, FIRTH].participants, found[AT_100, FIRTH].trials) == (8, 160)
