"""What a protocol may say of an adaptive method, and what follows for its plan and its limits."""

import itertools
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.protocol.method import Range, Staircase
from autd_trials.protocol.plan import make_plan
from tests.protocol.conftest import Load, Refuse
from tests.protocol.test_schema import set_in

STAIRCASE = {
    "kind": "staircase",
    "varies": "drive",
    "range": {"smallest": 0.1, "largest": 1, "levels": 21},
    "start": 1,
    "felt_to_go_down": 2,
    "step_factors": [4, 2, 1],
}

MISTAKES = [
    (set_in("method", "kind")("stairs"), "method.kind: is 'stairs'; allowed: 'staircase', 'quest_plus'"),
    (set_in("method", "kind")("quest-plus"), "did you mean 'quest_plus'?"),
    (set_in("method", "kind")(None), "method.kind: is empty; allowed: 'staircase', 'quest_plus'"),
    (lambda data: data["method"].pop("kind"), "method.kind: this key is missing; add it"),
    (set_in("method")("quest_plus"), "method: is 'quest_plus'; allowed: a mapping"),
    (set_in("method", "varies")("waveform"), "method.varies: is 'waveform'; allowed: 'drive', 'depth'"),
    (set_in("method", "varies")("modulation_hz"), "method.varies: 'modulation_hz' is a factor already"),
    (set_in("method", "range", "largest")(0.1), "method.range.largest: largest (0.1) is not over smallest"),
    (
        set_in("method", "range", "largest")(1.5),
        "method.range.largest: is 1.5; allowed: a number less than or equal to 1",
    ),
    (
        set_in("method", "range", "smallest")(0),
        "method.range.smallest: is 0; allowed: a number greater than 0",
    ),
    (set_in("method", "range", "levels")(2), "method.range.levels: is 2"),
    (set_in("method", "range", "smallest")(0.9999999), "method.range.levels: 41 levels"),
    (
        set_in("method", "slope")([3]),
        "method.slope: unknown key; allowed: guess_rates, kind, lapse_rates, range, slopes, varies; did",
    ),
    (set_in("method", "guess_rates")([0.1, 0.1]), "method.guess_rates[1]: 0.1 is given twice"),
    (set_in("method", "lapse_rates")([2]), "method.lapse_rates[0]: is 2; allowed: a number less than"),
    (set_in("method", "lapse_rates")([]), "method.lapse_rates: is a list of 0; allowed: at least 1"),
    (
        lambda data: data["method"].update(guess_rates=[0.5], lapse_rates=[0.5]),
        "the largest guess and lapse rates sum up to 1 or more",
    ),
    (set_in("method")({**STAIRCASE, "start": 2}), "method.start: start (2) is not within 0.1 to 1"),
    (set_in("method")({**STAIRCASE, "felt_to_go_down": 0}), "method.felt_to_go_down: is 0"),
    (
        set_in("safety", "largest_drive")(0.5),
        "method.range.largest: the drive 1 is over safety.largest_drive",
    ),
    (set_in("safety", "session_exposure_s")(79), "sum up to 80 s at full drive, which is over 79"),
    (set_in("comparisons", 0, "factor")("drive"), "comparisons[0].factor: there is no factor 'drive'"),
]


@pytest.mark.parametrize(("change", "message"), MISTAKES, ids=[message for _, message in MISTAKES])
def test_mistakes_are_told_with_their_place(refuse: Refuse, change: Any, message: str) -> None:
    refusal = refuse(change, "chest-threshold")
    assert message in refusal
    assert "after validation" not in refusal


def test_wrong_items_do_not_make_their_list_too_short(refuse: Refuse) -> None:
    refusal = refuse(set_in("method", "lapse_rates")([2]), "chest-threshold")
    assert "is a list of" not in refusal


def test_the_plan_has_the_largest_level_and_leaves_the_choice_open(load: Load) -> None:
    plan = make_plan(load(name="chest-threshold"), place=1, session=1, seed=1)
    stimuli = [trial for trial in plan.trials if trial.trial_type == "stimulus"]
    assert {trial.stimulus.drive for trial in stimuli} == {1.0}
    assert {trial.conditions["drive"] for trial in plan.trials} == {None}
    assert {trial.stimulus.drive for trial in plan.trials if trial.trial_type == "catch"} == {0.0}


def test_a_burst_that_holds_no_period_at_some_level_is_refused(refuse: Refuse) -> None:
    def change(data: Any) -> None:
        data["method"] = {**STAIRCASE, "varies": "duration_s", "start": 0.5}
        data["method"]["range"] = {"smallest": 0.01, "largest": 1, "levels": 9}
        data["stimulus"]["ramp_s"] = 0.001

    assert "does not hold one period of 50 Hz" in refuse(change, "chest-threshold")


@given(
    smallest=st.floats(1e-3, 10),
    ratio=st.floats(1.01, 1000),
    levels=st.integers(3, 50),
)
def test_levels_are_evenly_spaced_in_ratio_and_keep_their_ends(
    smallest: float, ratio: float, levels: int
) -> None:
    values = Range(smallest=smallest, largest=smallest * ratio, levels=levels).values
    assert (values[0], values[-1], len(values)) == (smallest, smallest * ratio, levels)
    steps = [above / below for below, above in itertools.pairwise(values)]
    assert steps == pytest.approx([ratio ** (1 / (levels - 1))] * len(steps), rel=2e-5)


@pytest.mark.parametrize(
    ("n_down", "up", "down", "rate"),
    [(1, 1, 1, 0.5), (2, 1, 1, 0.707), (3, 1, 1, 0.794), (4, 1, 1, 0.841), (1, 3, 1, 0.75), (1, 1, 3, 0.25)],
)
def test_staircases_settle_where_their_inventors_say(n_down: int, up: int, down: int, rate: float) -> None:
    """Levitt (1971), table I; Kaernbach (1991), equation 1."""
    data = {**STAIRCASE, "felt_to_go_down": n_down, "step_up": up, "step_down": down}
    data["range"] = Range(smallest=0.1, largest=1.0, levels=21)
    data["step_factors"] = (1,)
    assert Staircase.model_validate(data).converges_to == pytest.approx(rate, abs=5e-4)
