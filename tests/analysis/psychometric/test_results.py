"""The functions of whole studies: which factor, whose catch trials, and any number of levels."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest
from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.data.trials import Trials
from autd_analysis.psychometric import PSYCHOMETRIC
from autd_analysis.psychometric.functions import NORMAL, psychometric_function
from autd_analysis.psychometric.misfit import misfits
from autd_analysis.psychometric.numbers import psychometric_results
from autd_analysis.psychometric.options import PsychometricOptions, read_rate
from autd_analysis.study import analyse

from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Level
from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol
from tests.analysis.psychometric.conftest import OCTAVES


def test_the_chest_study_has_functions_along_frequency_in_each_clothing(chest: StudyWriter) -> None:
    (found,) = analyse(chest.folder, only=["psychometric"])[PSYCHOMETRIC]
    assert (found.along, found.axis, found.function) == ("modulation_hz", OCTAVES, "normal along octaves")
    assert len(found.participants) == 16
    first = found.participants[0]
    assert (first.participant, first.condition) == ("01", (("clothing", "inner"),))
    assert first.answers.felt.tolist() == list(CHEST_COUNTS[0][:3])
    assert (first.curve.guess, first.curve.lapse, first.guess_method) == (0, 0.02, "fixed")
    wears = [dict(group.condition)["clothing"] for group in found.groups]
    assert wears == ["inner", "inner_outer"]
    assert all(group.mixed is not None for group in found.groups)
    inner, outer = (group.threshold.value for group in found.groups)
    assert inner is not None
    assert outer is not None
    assert inner < outer
    assert any("need not rise" in note for note in found.notes)
    assert any("three levels" in note for note in found.notes)


def test_a_factor_of_words_or_of_two_numbers_has_no_functions(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(
        within={"modulation_hz": (25.0, 50.0)}, between={"clothing": ("a", "b", "c")}, comparisons=()
    )
    writer.add("01", lambda conditions, repetition: repetition < 5)
    assert analyse(writer.folder, only=["psychometric"])[PSYCHOMETRIC] == ()


def test_catch_trials_of_both_blocks_tell_one_guess_rate(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(catch_trials=8)
    answer = chest_answer((0, 1, 10, 0, 1, 9))

    def with_false_alarms(conditions: Mapping[str, Level | None], repetition: int) -> bool | None:
        if conditions["modulation_hz"] is None:
            return repetition < (3 if conditions["clothing"] == "inner" else 1)
        return answer(conditions, repetition)

    writer.add("01", with_false_alarms)
    (found,) = analyse(writer.folder, only=["psychometric"])[PSYCHOMETRIC]
    inner, outer = found.participants
    assert [(each.answers.catch_felt, each.answers.catch_n) for each in (inner, outer)] == [(3, 8), (1, 8)]
    assert inner.curve.guess == outer.curve.guess
    # 4 of 16 catch trials, and few of 40 stimuli that are as good as none
    assert 0.05 < inner.curve.guess < 0.2
    assert inner.guess_method == "estimated from catch trials and stimuli, for all conditions"


def adaptive(seed: int = 1) -> Trials:
    """Return trials of five people with 60 different drives each."""
    generator = np.random.default_rng(seed)
    records = []
    for person in range(5):
        threshold = 0.3 * 2 ** generator.normal(0, 0.3)
        drives = generator.uniform(0.05, 1, 60)
        p = psychometric_function(NORMAL, OCTAVES, drives, threshold=threshold, slope=0.9)
        records += [
            {
                "participant": f"{person}", "session": "1", "block": 1, "trial": trial, "attempt": 1,
                "trial_type": "stimulus", "trial_status": "complete", "felt": bool(felt),
                "response_time_s": math.nan, "used": True, "drive": float(drive),
            }
            for trial, (drive, felt) in enumerate(zip(drives, generator.random(60) < p, strict=True))
        ]  # fmt: skip
    table = pd.DataFrame.from_records(records).astype({"felt": "boolean", "drive": "object"})
    return Trials(design(), table, simulated=True, warnings=(), inputs=())


def design() -> Design:
    return Design("adaptive", None, (StudyFactor("drive", (0.1, 1.0), {}, within_block=True),), ())


def test_levels_that_no_protocol_names_are_taken_from_the_table() -> None:
    found = psychometric_results(adaptive(), "drive")
    assert [len(each.answers.x) for each in found.participants] == [60] * 5
    (group,) = found.groups
    assert group.threshold.participants == 5
    assert group.threshold.value == pytest.approx(0.3, rel=0.3)
    assert group.mixed is not None
    assert group.mixed.threshold == pytest.approx(0.3, rel=0.3)
    for each in found.participants:
        assert each.intervals.threshold is not None
        assert each.intervals.threshold.low is not None
        assert each.intervals.threshold.high is not None
        assert each.curve.threshold is not None
        assert each.intervals.threshold.low < each.curve.threshold < each.intervals.threshold.high


def test_a_model_may_be_asked_for() -> None:
    found = psychometric_results(
        adaptive(), "drive", PsychometricOptions(guess=0.01, lapse=0.05, core="logistic")
    )
    assert found.function == "logistic along octaves"
    assert {(each.curve.guess, each.curve.lapse) for each in found.participants} == {(0.01, 0.05)}


@pytest.mark.parametrize(
    ("asked", "wrong"),
    [
        ({"guess": 1.0}, "guess rate is 1"),
        ({"lapse": -0.1}, "lapse rate is -0.1"),
        ({"guess": 0.5, "lapse": 0.45}, "0.95 together"),
        ({"guess": "freely"}, "'freely'"),
        ({"lapse": math.nan}, "nan"),
        ({"core": "cauchy"}, "no core 'cauchy'"),
    ],
)
def test_options_that_no_function_can_have_are_refused(asked: dict[str, Any], wrong: str) -> None:
    with pytest.raises(UsageError, match=wrong):
        PsychometricOptions(**asked)


def test_rates_are_read_as_they_are_typed() -> None:
    assert [read_rate(word, "guess") for word in ("0.5", "free", "shared")] == [0.5, "free", "shared"]
    with pytest.raises(UsageError, match="the lapse rate is 'half'"):
        read_rate("half", "lapse")


def constant(rates: Sequence[float], people: int, trials: int, seed: int = 1) -> Trials:
    """Return trials of people who are right at these rates at drives 0.05, 0.1, ..."""
    generator = np.random.default_rng(seed)
    records = [
        {
            "participant": f"{person}", "session": "1", "block": 1, "trial": number, "attempt": 1,
            "trial_type": "stimulus", "trial_status": "complete", "felt": bool(generator.random() < rate),
            "response_time_s": math.nan, "used": True, "drive": 0.05 * 2**place,
        }
        for person in range(people)
        for place, rate in enumerate(rates)
        for number in range(trials)
    ]  # fmt: skip
    table = pd.DataFrame.from_records(records).astype({"felt": "boolean", "drive": "object"})
    return Trials(design(), table, simulated=True, warnings=(), inputs=())


def test_two_alternatives_need_a_guess_rate_and_are_told_so() -> None:
    trials = constant((0.5, 0.52, 0.74, 0.95, 0.98), people=5, trials=60)
    without, given = (
        psychometric_results(trials, "drive", PsychometricOptions(guess=guess)) for guess in (None, 0.5)
    )
    assert any("--guess 0.5" in remark for remark in without.remarks)
    assert given.remarks == ()
    (wrong,), (right,) = without.groups, given.groups
    assert wrong.threshold.value is not None
    assert right.threshold.value == pytest.approx(0.2, rel=0.2)
    assert wrong.threshold.value < 0.1
    assert given.threshold_rates == pytest.approx((0.74, 0.74))
    assert right.mixed is not None
    assert right.mixed.threshold == pytest.approx(0.2, rel=0.2)


def test_a_function_that_does_not_fit_is_remarked() -> None:
    wavy = constant((0.1, 0.8, 0.3, 0.9, 0.95), people=1, trials=60)
    found = psychometric_results(wavy, "drive")
    assert any("do not fit" in remark and "1 of 1" in remark for remark in misfits([found]))
    assert any("does not fit: deviance p = 0.0025" in note for note in found.participants[0].notes)
    smooth = psychometric_results(constant((0.03, 0.2, 0.5, 0.8, 0.95), people=1, trials=60), "drive")
    assert not any("fit" in said for said in (*misfits([smooth]), *smooth.participants[0].notes))


@pytest.mark.parametrize("along", ["no_such", "trial_type"])
def test_a_column_without_numbers_is_refused(along: str) -> None:
    with pytest.raises(UsageError, match=along):
        psychometric_results(adaptive(), along)


def test_a_missing_level_is_refused() -> None:
    trials = adaptive()
    table = trials.table.copy()
    table.loc[3, "drive"] = None
    with pytest.raises(UsageError, match="missing"):
        psychometric_results(dataclasses.replace(trials, table=table), "drive")


def test_a_drive_of_zero_is_no_stimulus() -> None:
    trials = adaptive()
    table = trials.table.copy()
    first = table["trial"] < 12
    table.loc[first, "drive"] = 0.0
    table.loc[first, "felt"] = table.loc[first, "trial"] == 5
    found = psychometric_results(dataclasses.replace(trials, table=table), "drive")
    for each in found.participants:
        assert len(each.answers.x) == 48
        assert (each.answers.catch_felt, each.answers.catch_n) == (1, 12)
        assert 0 < each.curve.guess < 0.2
    assert "drive 0 is taken as no stimulus: it informs the guess rate alone" in found.notes


def test_people_without_trials_in_a_condition_are_left_out_of_it(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), trials=30)
    writer.add("02", chest_answer(CHEST_COUNTS[1]))
    (found,) = analyse(writer.folder, only=["psychometric"])[PSYCHOMETRIC]
    lost = next(each for each in found.participants if each.curve.notes == ("no trials",))
    assert lost.participant == "01"
    assert lost.resampled is None
    assert sorted(group.threshold.participants for group in found.groups) == [1, 2]
    assert all("no mixed model: it needs 4 participants" in group.notes for group in found.groups)
