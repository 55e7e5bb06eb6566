"""Effects of order: planted ones are found, none is found where there is none, and SciPy agrees."""

import numpy as np
import pandas as pd
import pytest
from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.data.trials import Trials
from autd_analysis.order.numbers import OrderEffect, order_effects
from scipy import stats

WORN = StudyFactor("clothing", ("inner", "both"), {}, within_block=False)
HZ = StudyFactor("modulation_hz", (25.0, 100.0), {}, within_block=True)


def study(
    felt: "Rule", people: int = 8, repetitions: int = 20, sessions: int = 1, seed: int = 1
) -> dict[str, OrderEffect]:
    """A study of two blocks a session; `felt` gives the probability of each trial from what is known."""
    generator = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        for session in range(sessions):
            levels = WORN.levels if person % 2 == 0 else WORN.levels[::-1]
            before, trial = False, 0
            for block, worn in enumerate(levels, start=1):
                for hz in generator.permutation(np.repeat(HZ.levels, repetitions)):
                    trial += 1
                    when = trial / (4 * repetitions)
                    before = bool(
                        generator.random() < felt(when=when, before=before, block=block, session=session)
                    )
                    rows.append((f"{person:02}", f"{session}", block, trial, before, worn, hz))
    table = pd.DataFrame(
        rows, columns=["participant", "session", "block", "trial", "felt", "clothing", "modulation_hz"]
    ).assign(used=True, trial_type="stimulus")
    trials = Trials(Design("test", None, (HZ, WORN), ()), table, True, (), ())
    return {effect.name: effect for effect in order_effects(trials)}


class Rule:
    def __call__(self, *, when: float, before: bool, block: int, session: int) -> float:
        return 0.5


class Tiring(Rule):
    def __call__(self, *, when: float, before: bool, block: int, session: int) -> float:
        return 0.9 - 0.8 * when


class Repeating(Rule):
    def __call__(self, *, when: float, before: bool, block: int, session: int) -> float:
        return 0.75 if before else 0.25


class BetterFirst(Rule):
    def __call__(self, *, when: float, before: bool, block: int, session: int) -> float:
        return 0.8 if block == 1 else 0.4


class Practised(Rule):
    def __call__(self, *, when: float, before: bool, block: int, session: int) -> float:
        return 0.3 + 0.4 * session


def p(effect: OrderEffect) -> float:
    assert effect.p is not None
    return effect.p


def test_fatigue_is_found_and_its_size() -> None:
    effects = study(Tiring())
    fatigue = effects["course of the session"]
    assert p(fatigue) < 0.002
    assert fatigue.interval is not None
    assert fatigue.interval.low < -0.8 < fatigue.interval.high


def test_serial_dependence_is_found_and_its_size() -> None:
    effects = study(Repeating(), repetitions=40)
    assert p(effects["answer before"]) < 0.002
    assert effects["answer before"].estimate == pytest.approx(0.5, abs=0.1)


def test_the_order_of_blocks_is_found_and_is_no_effect_of_clothing() -> None:
    effect = study(BetterFirst())["order of blocks"]
    assert p(effect) < 0.01
    assert effect.estimate == pytest.approx(0.4, abs=0.1)


def test_the_order_of_blocks_is_welchs_test() -> None:
    rates = {"00": (0.9, 0.5), "02": (0.7, 0.6), "04": (0.8, 0.2), "01": (0.4, 0.6), "03": (0.6, 0.9)}
    rows = [
        (person, "1", block, 20 * block + k, k < 10 * each[WORN.levels.index(worn)], worn, 25.0)
        for person, each in rates.items()
        for block, worn in enumerate(WORN.levels if int(person) % 2 == 0 else WORN.levels[::-1], start=1)
        for k in range(10)
    ]
    columns = ["participant", "session", "block", "trial", "felt", "clothing", "modulation_hz"]
    table = pd.DataFrame(rows, columns=columns).assign(used=True, trial_type="stimulus")
    trials = Trials(Design("test", None, (HZ, WORN), ()), table, True, (), ())
    effect = {each.name: each for each in order_effects(trials)}["order of blocks"]
    groups = [[a - b for person, (a, b) in rates.items() if int(person) % 2 == k] for k in (0, 1)]
    expected = stats.ttest_ind(*groups, equal_var=False)
    ends = expected.confidence_interval(0.95)
    assert effect.p == pytest.approx(float(expected.pvalue))
    assert effect.interval is not None
    assert (effect.interval.low, effect.interval.high) == pytest.approx((ends.low / 2, ends.high / 2))


def test_practice_from_session_to_session_is_found() -> None:
    effect = study(Practised(), sessions=2)["session"]
    assert p(effect) < 0.002
    assert effect.estimate == pytest.approx(0.4, abs=0.08)


def test_sessions_are_in_the_order_of_their_numbers() -> None:
    """Of twelve sessions named 1 to 12 the later are better; by the alphabet 10 to 12 would come second."""
    rows = [
        ("01", f"{session}", 1, trial, trial < session, "inner", 25.0)
        for session in range(1, 13)
        for trial in range(12)
    ]
    columns = ["participant", "session", "block", "trial", "felt", "clothing", "modulation_hz"]
    table = pd.DataFrame(rows, columns=columns).assign(used=True, trial_type="stimulus")
    trials = Trials(Design("test", None, (HZ, WORN), ()), table, True, (), ())
    effect = {each.name: each for each in order_effects(trials)}["session"]
    assert effect.estimate == pytest.approx(1 / 12)


def test_without_any_effect_the_shuffles_find_one_in_twenty() -> None:
    """240 tests: the 99.9 % range around 12 of 240 is 2 to 24."""
    found = 0
    for seed in range(80):
        effects = study(Rule(), people=6, repetitions=5, seed=100 + seed)
        names = ("course of the session", "answer before", "order of blocks")
        found += sum(p(effects[name]) < 0.05 for name in names)
    assert 2 <= found <= 24


def test_slopes_are_those_of_least_squares_within_conditions() -> None:
    generator = np.random.default_rng(5)
    frame = pd.DataFrame(
        {
            "participant": "01", "session": "1", "block": 1, "trial": np.arange(1, 31), "clothing": "inner",
            "felt": generator.random(30) < 0.5, "used": True, "trial_type": "stimulus", "modulation_hz": 25.0,
        }
    )  # fmt: skip
    trials = Trials(Design("test", None, (HZ, WORN), ()), frame, True, (), ())
    effect = {each.name: each for each in order_effects(trials)}["course of the session"]
    expected = stats.linregress(np.linspace(0, 1, 30), frame["felt"].astype(float))
    assert effect.estimate == pytest.approx(expected.slope)
    assert effect.interval is None
    shuffled = stats.permutation_test(
        (frame["felt"].astype(float).to_numpy(),),
        lambda y: stats.pearsonr(np.linspace(0, 1, 30), y).statistic,
        permutation_type="pairings",
        n_resamples=4000,
        rng=np.random.default_rng(1),
    )
    assert effect.p == pytest.approx(float(shuffled.pvalue), abs=0.04)


def test_what_cannot_be_tested_says_why() -> None:
    effects = study(Rule(), people=1)
    assert effects["session"].note == "time does not vary within a condition"
    assert "fewer than two participants" in str(effects["order of blocks"].note)
    always = study(type("Always", (Rule,), {"__call__": lambda self, **known: 1.0})())
    assert "no participant answers differently" in str(always["answer before"].note)
    assert p(always["course of the session"]) == 1
    assert always["order of blocks"].p is None
