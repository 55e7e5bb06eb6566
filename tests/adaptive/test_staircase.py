"""Staircases: every step by the book, and where they settle."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import expit

from autd_trials.adaptive.answers import Answer
from autd_trials.adaptive.staircase import StaircaseRule
from autd_trials.protocol.method import Range, Staircase

LADDER = Range(smallest=0.125, largest=8.0, levels=7)  # 1/8, 1/4, ... 8


def staircase(
    *, n_down: int = 1, up: int = 1, down: int = 1, factors: tuple[int, ...] = (1,), start: float = 1.0
) -> Staircase:
    return Staircase(
        kind="staircase",
        varies="drive",
        range=LADDER,
        start=start,
        felt_to_go_down=n_down,
        step_up=up,
        step_down=down,
        step_factors=factors,
    )


def levels_of(method: Staircase, felt: str) -> list[float]:
    """Return the levels that follow from answers + and -, the first and the one to come included."""
    rule, answers = StaircaseRule(method), []
    levels = [rule.next_level([])]
    for answer in felt:
        answers.append(Answer(levels[-1], answer == "+"))
        levels.append(rule.next_level(answers))
    return levels


@pytest.mark.parametrize(
    ("method", "felt", "levels"),
    [
        (staircase(), "++-+--", [1, 0.5, 0.25, 0.5, 0.25, 0.5, 1]),
        (staircase(n_down=2), "++-+++-", [1, 1, 0.5, 1, 1, 0.5, 0.5, 1]),
        (staircase(n_down=3), "+++++-+++", [1, 1, 1, 0.5, 0.5, 0.5, 1, 1, 1, 0.5]),
        (staircase(up=3), "+-+++", [1, 0.5, 4, 2, 1, 0.5]),
        (staircase(down=3, start=8), "+-+-", [8, 1, 2, 0.25, 0.5]),
        (staircase(factors=(3, 2, 1), start=8), "+-+-+-", [8, 1, 4, 2, 4, 2, 4]),
        (staircase(start=1.3), "", [1]),
        (staircase(start=8), "--+", [8, 8, 8, 4]),
        (staircase(start=0.125), "+++-", [0.125, 0.125, 0.125, 0.125, 0.25]),
    ],
)
def test_steps(method: Staircase, felt: str, levels: list[float]) -> None:
    assert levels_of(method, felt) == pytest.approx(levels)


def answers_of(method: Staircase, felt: str) -> list[Answer]:
    pairs = zip(levels_of(method, felt), felt, strict=False)
    return [Answer(level, answer == "+") for level, answer in pairs]


def test_the_threshold_is_the_mean_of_an_even_number_of_reversals() -> None:
    method = staircase()
    answers = answers_of(method, "++-+-+-")  # turns at 1/4, 1/2, 1/4, 1/2, 1/4: the first is left out
    estimate = StaircaseRule(method).estimate(answers)
    assert estimate.threshold == pytest.approx(math.sqrt(0.25 * 0.5))
    assert estimate.spread_db == pytest.approx(20 * math.log10(2) * math.sqrt(1 / 3))
    assert estimate.rate == 0.5
    assert estimate.note is None


def test_reversals_before_the_final_steps_do_not_count() -> None:
    method = staircase(factors=(2, 1), start=2)
    steps = StaircaseRule(method).steps(answers_of(method, "+-+-"))
    assert [step.reversal for step in steps] == [False, False, True, True]


def test_too_few_reversals_tell_no_threshold() -> None:
    method = staircase()
    estimate = StaircaseRule(method).estimate(answers_of(method, "+++-"))
    assert estimate.threshold is None
    assert estimate.note == "1 reversals with the final steps; a threshold needs 4"


@pytest.mark.parametrize(("felt", "beyond"), [("--+-+--", 1), ("+++-+-+++", -1)])
def test_a_staircase_held_at_an_end_tells_no_threshold(felt: str, beyond: int) -> None:
    method = staircase(start=8 if beyond == 1 else 0.125)
    estimate = StaircaseRule(method).estimate(answers_of(method, felt))
    assert (estimate.threshold, estimate.beyond) == (None, beyond)
    assert estimate.note is not None
    assert "it lies beyond or close to it" in estimate.note


def test_known_thresholds_are_found_and_those_at_the_end_are_not_taken_for_lower_ones() -> None:
    """1-up-2-down: told thresholds are right on average, and those over the top are not told."""
    method = Staircase(
        kind="staircase",
        varies="drive",
        range=Range(smallest=0.1, largest=1.0, levels=41),
        start=1.0,
        felt_to_go_down=2,
        step_factors=(8, 4, 2),
    )
    generator, rule = np.random.default_rng(3), StaircaseRule(method)
    for true_db, told in ((-8.0, True), (-4.0, True), (1.5, False)):
        estimates = []
        for _ in range(12):
            answers: list[Answer] = []
            while len(answers) < 40:
                level = rule.next_level(answers)
                over_db = 20 * math.log10(level) - true_db
                answers.append(Answer(level, bool(generator.random() < expit(0.6 * over_db + 0.8814))))
            estimates.append(rule.estimate(answers))
        db = [20 * math.log10(each.threshold) for each in estimates if each.threshold is not None]
        assert len(db) >= 11 if told else len(db) <= 1
        assert not told or abs(np.mean(db) - true_db) < 3 * np.std(db) / math.sqrt(len(db))
        assert told or sum(each.beyond == 1 for each in estimates) >= 11


@given(
    felt=st.text(alphabet="+-", max_size=60),
    n_down=st.integers(1, 4),
    up=st.integers(1, 5),
    down=st.integers(1, 5),
    factors=st.lists(st.integers(1, 4), min_size=1, max_size=3).map(tuple),
    start=st.floats(0.125, 8),
)
def test_every_level_is_on_the_ladder_and_felt_never_leads_up(
    felt: str, n_down: int, up: int, down: int, factors: tuple[int, ...], start: float
) -> None:
    method = staircase(n_down=n_down, up=up, down=down, factors=factors, start=start)
    levels = levels_of(method, felt)
    assert set(levels) <= set(method.levels)
    for answer, level, following in zip(felt, levels, levels[1:], strict=False):
        assert following <= level if answer == "+" else following >= level


@pytest.mark.parametrize(
    ("n_down", "up", "down", "rate"),
    [
        (1, 1, 1, 0.5),
        (2, 1, 1, 0.7071),
        (3, 1, 1, 0.7937),
        (1, 3, 1, 0.75),
        (1, 1, 3, 0.25),
        (2, 2, 1, 0.8165),
    ],
)
def test_it_settles_where_levitt_and_kaernbach_say(n_down: int, up: int, down: int, rate: float) -> None:
    """Levitt (1971), table I; Kaernbach (1991), equation 1. With small steps, on a known function."""
    method = Staircase(
        kind="staircase",
        varies="drive",
        range=Range(smallest=0.1, largest=10.0, levels=50),
        start=1.0,
        felt_to_go_down=n_down,
        step_up=up,
        step_down=down,
    )
    assert method.converges_to == pytest.approx(rate, abs=1e-4)
    generator, rule = np.random.default_rng(1), StaircaseRule(method)
    answers: list[Answer] = []
    while len(answers) < 400:
        level = rule.next_level(answers[-40:])
        answers.append(Answer(level, bool(generator.random() < expit(1.5 * math.log(level)))))
    # the geometric mean of all levels is where steps up and down are in balance
    mean = float(np.mean([math.log(answer.level) for answer in answers[50:]]))
    assert expit(1.5 * mean) == pytest.approx(rate, abs=0.05)
