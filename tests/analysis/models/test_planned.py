"""The mixed model as a test of planned comparisons: what is compared, separation, what cannot be tested."""

from fractions import Fraction

import numpy as np
import pytest
from autd_analysis.data.contrasts import Contrast
from autd_analysis.models.planned import MixedModelTest, mixed_model_test
from autd_analysis.rates.numbers import ParticipantRate
from scipy.special import expit, logit

FREQUENCIES = (25.0, 50.0, 100.0)
AT_100 = (("modulation_hz", 100.0),)


def rates(felt: np.ndarray, trials: int = 10) -> list[ParticipantRate]:
    """Rates from counts of shape (participants, 3 frequencies, 2 clothings)."""
    return [
        ParticipantRate(
            participant=f"{number:02d}",
            condition=(("modulation_hz", frequency), ("clothing", clothing)),
            felt=int(felt[number, row, column]),
            n=trials,
            rate=Fraction(int(felt[number, row, column]), trials),
            interval=None,
        )
        for number in range(len(felt))
        for row, frequency in enumerate(FREQUENCIES)
        for column, clothing in enumerate(("inner", "both"))
    ]


def drawn(seed: int, drop: float, participants: int = 8, ease: float = 0.5) -> list[ParticipantRate]:
    generator = np.random.default_rng(seed)
    people = generator.standard_normal((participants, 2)) * (1.0, 0.8)
    logits = ease + people[:, :1, None] + np.zeros((participants, 3, 2))
    logits[:, :, 1] -= drop + people[:, 1:]
    return rates(generator.binomial(10, expit(logits)))


def compare(
    its_rates: list[ParticipantRate], first: str = "inner", second: str = "both"
) -> MixedModelTest | None:
    return mixed_model_test(its_rates, Contrast("clothing", first, second, AT_100))


def test_people_who_are_alike_give_the_difference_of_their_logits() -> None:
    felt = np.tile([[6, 3], [5, 4], [8, 5]], (8, 1, 1))
    test = compare(rates(felt))
    assert test is not None
    assert test.logits == pytest.approx(logit(0.8) - logit(0.5), abs=1e-3)
    assert test.slope_sd == pytest.approx(0, abs=1e-2)
    assert test.singular
    assert not test.penalised
    assert test.interval.low < test.logits < test.interval.high


def test_the_other_way_round_has_the_other_sign() -> None:
    one, other = compare(drawn(1, 1.0)), compare(drawn(1, 1.0), "both", "inner")
    assert one is not None
    assert other is not None
    assert other.logits == pytest.approx(-one.logits, abs=1e-5)
    assert other.p == pytest.approx(one.p, rel=1e-4)


def test_at_a_frequency_only_the_trials_there_count() -> None:
    its_rates = drawn(2, 1.0)
    there = [rate for rate in its_rates if set(AT_100) <= set(rate.condition)]
    assert compare(its_rates) == compare(there)


def test_over_all_frequencies_people_who_are_alike_give_the_mean_of_the_differences() -> None:
    felt = np.tile([[6, 3], [5, 4], [8, 5]], (8, 1, 1))
    overall = mixed_model_test(rates(felt), Contrast("clothing", "inner", "both"))
    assert overall is not None
    assert overall.logits == pytest.approx(np.diff(logit(felt[0] / 10)).mean() * -1, abs=2e-3)


@pytest.mark.slow
def test_the_level_holds_with_random_slopes_and_large_effects_are_found() -> None:
    """200 studies without effect: the share below .05 has a 99.9 % interval of .01 to .11 around .05."""
    null = [compare(drawn(seed, 0.0)) for seed in range(200)]
    p = np.array([test.p for test in null if test is not None])
    assert len(p) == 200
    assert 0.01 <= (p < 0.05).mean() <= 0.11
    strong = [compare(drawn(seed, 2.5)) for seed in range(30)]
    assert np.mean([test is not None and test.p < 0.05 for test in strong]) > 0.8


@pytest.mark.parametrize("ease", [6.0, -6.0])
def test_separated_answers_get_finite_estimates_and_say_so(ease: float) -> None:
    felt = np.array([[6, 3], [5, 4], [10 if ease > 0 else 0, 5]])
    wobble = np.random.default_rng(3).integers(-2, 3, (8, 3, 2))
    counts = np.clip(felt + wobble, 0, 10)
    counts[:, 2, 0] = 10 if ease > 0 else 0
    test = compare(rates(counts))
    assert test is not None
    assert test.penalised
    assert np.isfinite([test.logits, test.interval.low, test.interval.high, test.p]).all()
    assert np.sign(test.logits) == np.sign(ease)


@pytest.mark.parametrize("value", [0, 10])
def test_a_study_in_which_all_or_nothing_was_felt_shows_no_difference(value: int) -> None:
    test = compare(rates(np.full((8, 3, 2), value)))
    assert test is None or test.p > 0.5


def test_too_few_people_and_empty_cells_are_not_tested() -> None:
    assert compare(drawn(4, 1.0, participants=3)) is None
    empty = [
        ParticipantRate(rate.participant, rate.condition, 0, 0, None, None)
        if set(AT_100) <= set(rate.condition) and ("clothing", "both") in rate.condition
        else rate
        for rate in drawn(5, 1.0)
    ]
    assert compare(empty) is None


def test_missing_cells_of_single_people_are_no_hindrance() -> None:
    its_rates = drawn(6, 1.0)
    assert compare(its_rates[1:-2]) is not None
