"""QUEST+ replays the sequences of trials that Watson (2017) published, and finds thresholds that are known.

reference/watson2017.csv has stimuli (dB, in the last example degrees) and answers of the paper's examples:
contrast threshold; threshold and slope; threshold, slope and lapse; mean, standard deviation and lapse.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm

from autd_trials.adaptive.answers import Answer
from autd_trials.adaptive.quest_plus import QuestPlus, QuestPlusRule, weibull
from autd_trials.protocol.method import QuestPlusMethod, Range

CONTRASTS = np.arange(-40.0, 1.0)
LAPSES = np.arange(5) / 100
SEEN_HALF = 0.5
METHOD = QuestPlusMethod(kind="quest_plus", varies="drive", range=Range(smallest=0.1, largest=1.0, levels=41))

Array = NDArray[np.float64]


def published(example: str) -> list[tuple[int, bool]]:
    with (Path(__file__).parent / "reference" / "watson2017.csv").open() as file:
        lines = [line for line in csv.DictReader(file) if line["example"] == example]
    return [(int(line["stimulus"]), line["correct"] == "1") for line in lines]


def grid(*axes: Array) -> Array:
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])


def orientation(x: Array, mean: Array, sd: Array, lapse: Array) -> Array:
    probability: Array = lapse + (1 - 2 * lapse) * norm.cdf(x, mean, sd)
    return probability


def contrast(parameters: Array) -> Array:
    return weibull(CONTRASTS[:, None], *parameters)


SLOPES = np.arange(2.0, 6.0)
EXAMPLES = {
    "threshold": (
        CONTRASTS,
        grid(CONTRASTS, np.array([3.5]), np.array([0.5]), np.array([0.02])),
        contrast,
        (-20, 3.5, 0.5, 0.02),
    ),
    "threshold_slope": (
        CONTRASTS,
        grid(CONTRASTS, SLOPES, np.array([0.5]), np.array([0.02])),
        contrast,
        (-20, 3, 0.5, 0.02),
    ),
    "threshold_slope_lapse": (
        CONTRASTS,
        grid(CONTRASTS, SLOPES, np.array([0.5]), LAPSES),
        contrast,
        (-20, 5, 0.5, 0.04),
    ),
    "mean_sd_lapse": (
        np.arange(-10.0, 11.0),
        grid(np.arange(-5.0, 6.0), np.arange(1.0, 11.0), LAPSES),
        lambda parameters: orientation(np.arange(-10.0, 11.0)[:, None], *parameters),
        (0, 4, 0.01),
    ),
}


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_choice_and_the_estimate_are_those_published(example: str) -> None:
    stimuli, parameters, likelihoods, mode = EXAMPLES[example]
    rule = QuestPlus(likelihoods(parameters))
    trials = published(example)
    answers: list[tuple[int, bool]] = []
    for number, (stimulus, correct) in enumerate(trials, start=1):
        chosen = rule.next_stimulus(rule.posterior(answers))
        assert stimuli[chosen] == stimulus, f"trial {number} of {len(trials)}"
        answers.append((chosen, correct))
    assert parameters[:, rule.posterior(answers).argmax()] == pytest.approx(mode)


def test_the_posterior_is_bayes_rule() -> None:
    likelihoods = np.array([[0.1, 0.5], [0.2, 0.9]])
    posterior = QuestPlus(likelihoods, np.array([0.75, 0.25])).posterior([(1, True), (0, False)])
    weights = np.array([0.75 * 0.2 * 0.9, 0.25 * 0.9 * 0.5])
    assert posterior == pytest.approx(weights / weights.sum())


def test_contradictory_answers_leave_the_prior() -> None:
    likelihoods = np.array([[0.0, 0.0], [1.0, 1.0]])
    assert QuestPlus(likelihoods).posterior([(0, True)]) == pytest.approx([0.5, 0.5])


@given(answers=st.lists(st.tuples(st.sampled_from(METHOD.levels), st.booleans()), max_size=30))
def test_every_choice_is_a_level_whatever_was_answered(answers: list[tuple[float, bool]]) -> None:
    rule = QuestPlusRule(METHOD)
    history = [Answer(level, felt) for level, felt in answers]
    assert rule.next_level(history) in METHOD.levels
    estimate = rule.estimate(history)
    assert (estimate.threshold is None) == (estimate.note is not None)
    if estimate.threshold is not None:
        assert METHOD.range.smallest <= estimate.threshold <= METHOD.range.largest


def test_known_thresholds_are_found_without_bias() -> None:
    """Over 40 runs the mean error is within three standard errors of 0, and the spread is honest."""
    generator, rule = np.random.default_rng(5), QuestPlusRule(METHOD)
    errors_db, spreads_db = [], []
    for _ in range(40):
        true_db = generator.uniform(-14, -4)
        answers: list[Answer] = []
        while len(answers) < 40:
            level = rule.next_level(answers)
            threshold_db = true_db - 20 / 3 * math.log10(math.log(2))
            chance = weibull(*map(np.asarray, (20 * math.log10(level), threshold_db, 3.0, 0.05, 0.02)))
            answers.append(Answer(level, bool(generator.random() < chance)))
        estimate = rule.estimate(answers)
        assert estimate.threshold is not None
        assert estimate.spread_db is not None
        errors_db.append(20 * math.log10(estimate.threshold) - true_db)
        spreads_db.append(estimate.spread_db)
    assert abs(np.mean(errors_db)) < 3 * np.std(errors_db) / math.sqrt(40)
    assert 0.6 < np.std(errors_db) / math.sqrt(np.mean(np.square(spreads_db))) < 1.5


def test_without_answers_nothing_is_estimated() -> None:
    assert QuestPlusRule(METHOD).estimate([]).threshold is None


@pytest.mark.parametrize(("felt", "side"), [(True, "under the smallest"), (False, "over the largest")])
def test_a_threshold_beyond_the_levels_is_told(felt: bool, side: str) -> None:
    rule = QuestPlusRule(METHOD)
    answers: list[Answer] = []
    while len(answers) < 30:
        answers.append(Answer(rule.next_level(answers), felt))
    estimate = rule.estimate(answers)
    assert estimate.threshold is None
    assert estimate.note == f"the threshold lies {side} level"


def test_a_few_answers_tell_no_threshold() -> None:
    rule = QuestPlusRule(METHOD)
    for felt in (True, False):
        answers = [Answer(rule.next_level([]), felt)]
        assert rule.estimate(answers).threshold is None
        assert rule.estimate(answers).note == "the answers do not tell where the threshold lies"
