"""The report's opening: a sentence a planned comparison, with a direction only where there is one."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.rates import RATES
from autd_analysis.report.summary import plain_words
from autd_analysis.results import Outcome, Results
from autd_analysis.subject import Answer

from autd_trials.protocol.method import QuestPlusMethod, Range
from autd_trials.protocol.schema import Level
from tests.analysis.made_up import made_up, with_differences, with_method

QUEST = QuestPlusMethod(kind="quest_plus", varies="drive", range=Range(smallest=0.1, largest=1, levels=21))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Results:
    levels: dict[str, Sequence[Level]] = {"clothing": ("inner", "outer"), "modulation_hz": (25, 100)}
    return made_up(tmp_path_factory.mktemp("made"), levels, compared="clothing", at="modulation_hz")


def answers(results: Results) -> list[Answer]:
    return [answer for view in results.views for answer in view.answers]


def with_found(study: Results, *differences: float) -> Results:
    """Return the study with one comparison, in which participants have these differences."""
    first, *_ = study[COMPARISONS]
    found = (with_differences(first, differences),)
    shown = COMPARISONS.words(found, study.trials)
    return Results(study.trials, (Outcome(COMPARISONS, found, shown=shown),))


def test_a_clear_difference_has_a_direction(study: Results) -> None:
    (answer,) = answers(with_found(study, 0.2, 0.3, 0.4, 0.5, 0.3, 0.2, 0.4, 0.3))
    assert answer.where == "25\N{NARROW NO-BREAK SPACE}Hz"
    assert answer.sentence == (
        "felt more often with inner than with outer: difference in rate .32, 95% CI [.24, .41], n = 8, exact "
        "sign-flip p = .008 (least possible .008), adjusted p = .008."
    )
    (less,) = answers(with_found(study, *(-0.2, -0.3) * 4))
    assert less.sentence.startswith("felt less often with inner than with outer")
    assert "difference in rate \N{MINUS SIGN}.25" in less.sentence


def test_no_direction_is_told_of_a_difference_that_is_nothing_on_paper(study: Results) -> None:
    nearly_none = with_found(study, *(0.01, -0.01) * 6, 0.01)
    (answer,) = answers(nearly_none)
    assert answer.sentence.startswith("no clear difference between inner and outer: difference in rate .00")
    assert "the same mean rate with inner as with outer, difference .00" in plain_words(nearly_none)
    (still,) = answers(with_found(study, *[0.004] * 12))
    assert "more often" not in still.sentence


def test_too_few_people_are_said_to_be_too_few(study: Results) -> None:
    (answer,) = answers(with_found(study, 0.5, 0.6, 0.4, 0.5))
    assert answer.sentence.startswith(
        "felt more often with inner than with outer, but so few participants cannot make it clear"
    )
    assert "least possible .125" in answer.sentence


def test_without_a_comparison_the_rates_are_said(study: Results, tmp_path: Path) -> None:
    design = dataclasses.replace(study.trials.design, comparisons=())
    trials = dataclasses.replace(study.trials, design=design)
    (answer,) = RATES.words(study[RATES], trials).answers
    assert answer.sentence == "No comparison was asked for. The mean detection rate was .50 everywhere."
    one = made_up(tmp_path, {"clothing": ("inner",)}, people=1)
    (only,) = answers(one)
    assert "The mean detection rate was ." in only.sentence


def test_thresholds_are_answered_in_db(tmp_path: Path) -> None:
    study = with_method(
        made_up(tmp_path, {"clothing": ("inner", "outer")}, compared="clothing", people=9), QUEST
    )
    (answer,) = answers(study)
    assert answer.where == ""
    assert "\N{NARROW NO-BREAK SPACE}dB, 95% CI [" in answer.sentence
    assert "n = 8" in answer.sentence  # one threshold lies beyond the levels
