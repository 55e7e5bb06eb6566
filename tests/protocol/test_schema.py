from collections.abc import Callable
from typing import Any

import pytest

from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Protocol
from autd_trials.records.trials_table import trial_columns
from tests.protocol.conftest import Load, Refuse

Data = dict[str, Any]


def test_chest_is_the_papers_study() -> None:
    chest = load_protocol(find_protocol("chest"))
    assert chest.factors.within_block["modulation_hz"].levels == (25.0, 50.0, 100.0)
    assert chest.factors.between_blocks["clothing"].levels == ("inner", "inner_outer")
    assert (chest.repetitions, chest.catch_trials_per_block) == (10, 0)
    assert (chest.stimulus.duration_s, chest.stimulus.waveform) == (1.0, "sine")
    assert (chest.order.trials, chest.order.max_run_length) == ("shuffled", None)
    assert chest.masking is not None
    assert chest.masking.noise == "pink"
    target = chest.targets["chest"]
    assert (target.x_mm, target.y_mm, target.z_mm) == (302, 225, 1000), "the paper's point B"
    (comparison,) = chest.comparisons
    assert (comparison.first, comparison.second, comparison.at_each) == (
        "inner",
        "inner_outer",
        "modulation_hz",
    )


def test_chest_catch_differs_from_chest_by_its_catch_trials() -> None:
    chest, catch = (load_protocol(find_protocol(name)) for name in ("chest", "chest-catch"))
    assert catch.catch_trials_per_block > 0
    assert (catch.factors, catch.stimulus, catch.repetitions) == (
        chest.factors,
        chest.stimulus,
        chest.repetitions,
    )


def test_the_pilot_takes_about_two_minutes() -> None:
    pilot = load_protocol(find_protocol("pilot"))
    plan = make_plan(pilot, place=1, session=1, seed=1)
    trials_s = sum(t.pause_before_s + pilot.timing.response_window_s for t in plan.trials)
    assert 90 <= pilot.timing.lead_in_s + trials_s <= 150


def set_in(*path: str | int) -> Callable[[Any], Callable[[Data], object]]:
    """Return what sets a value deep in the data."""

    def to(value: Any) -> Callable[[Data], object]:
        def change(data: Any) -> None:
            for part in path[:-1]:
                data = data[part]
            data[path[-1]] = value

        return change

    return to


MISTAKES = [
    (set_in("stimulus", "ramp_s")(0.6), "stimulus.ramp_s: two ramps of 0.6 s do not fit into a burst of 1 s"),
    (set_in("stimulus", "duration_s")(0.02), "does not hold one period of 25 Hz"),
    (set_in("stimulus", "target")("back"), "stimulus.target: there is no target 'back'; allowed: chest"),
    (set_in("stimulus", "drive")(0), "a stimulus of drive 0 is a catch trial"),
    (set_in("stimulus", "drive")(1.5), "stimulus.drive: is 1.5; allowed: a number less than or equal to 1"),
    (
        set_in("factors", "within_block", "modulation_hz", "levels")([25, 25.0]),
        "factors.within_block.modulation_hz.levels[1]: the level 25 is given twice",
    ),
    (
        set_in("factors", "within_block", "modulation_hz", "levels")([25, "high"]),
        "numbers and words do not mix",
    ),
    (set_in("factors", "within_block", "modulation_hz", "levels")([25, 5000]), "levels[1]: is 5000"),
    (
        set_in("factors", "within_block", "clothes")({"levels": ["a"]}),
        "nothing can vary 'clothes' from trial to trial",
    ),
    (
        set_in("factors", "between_blocks", "modulation_hz")({"levels": [10]}),
        "'modulation_hz' cannot vary both within and between blocks",
    ),
    (
        set_in("factors", "between_blocks", "response")({"levels": ["a"]}),
        "'response' is a column of the tables already",
    ),
    (
        set_in("factors", "between_blocks", "clothing", "describe")({"iner": "x"}),
        "there is no level 'iner'; allowed: inner, inner_outer; did you mean 'inner'?",
    ),
    (
        set_in("factors", "between_blocks", "clothing", "levels")(["None", "inner"]),
        "levels[0]: 'None' would be read as a missing value",
    ),
    (set_in("factors", "between_blocks", "clothing", "levels")([]), "levels: is a list of 0"),
    (set_in("order", "max_run_of")("modulation_hz"), "order.max_run_of: max_run_of needs max_run_length"),
    (
        set_in("order")({"trials": "fixed", "max_run_length": 2}),
        "order.max_run_length: a fixed order has no choice",
    ),
    (
        set_in("order")({"max_run_length": 2, "max_run_of": "clothing"}),
        "order.max_run_of: there is no factor within blocks 'clothing'; allowed: modulation_hz, trial_type",
    ),
    (
        set_in("timing", "pause_max_s")(1.0),
        "timing.pause_max_s: pause_max_s (1) is less than pause_min_s (1.5)",
    ),
    (set_in("timing", "response_window_s")(0.5), "outlasts timing.response_window_s (0.5)"),
    (set_in("masking", "level_dba")(60), "masking: give exactly one of level_dbfs and level_dba"),
    (set_in("masking", "level_dbfs")(-3), "masking.level_dbfs: is -3"),
    (set_in("safety", "largest_drive")(0.5), "the drive 1 is over safety.largest_drive (0.5)"),
    (set_in("safety", "longest_burst_s")(0.5), "the burst of 1 s is over safety.longest_burst_s (0.5)"),
    (set_in("safety", "largest_duty")(0.2), "make a duty of 0.25, which is over 0.2"),
    (set_in("safety", "session_exposure_s")(59), "sum up to 60 s at full drive, which is over 59"),
    (
        set_in("safety", "daily_exposure_s")(59),
        "safety.daily_exposure_s: the session's stimuli sum up to 60 s",
    ),
    (set_in("comparisons", 0, "factor")("cloth"), "comparisons[0].factor: there is no factor 'cloth'"),
    (set_in("comparisons", 0, "at_each")("clothing"), "cannot be compared at each of its own levels"),
    (
        lambda data: data["comparisons"].append(
            {**data["comparisons"][0], "first": "inner_outer", "second": "inner"}
        ),
        "comparisons[1]: this comparison is planned already, perhaps the other way round",
    ),
    (set_in("comparisons", 0, "second")("inner"), "a level cannot be compared with itself"),
    (set_in("comparisons", 0, "first")("iner"), "there is no level of clothing 'iner'"),
    (set_in("name")("my study"), "name: is 'my study'"),
    (set_in("study", "authors")(["One"]), "study.authors: is a list of 1"),
    (set_in("targets", "Chest")({"x_mm": 1, "y_mm": 1, "z_mm": 1}), "targets.Chest"),
    (set_in("repetitions")(1000), "are 3000 trials in a block; allowed: at most 500"),
    (
        set_in("factors", "between_blocks", "drive")({"levels": [n / 20 for n in range(1, 21)]}),
        "these factors make 40 blocks; allowed: at most 20",
    ),
    (set_in("head")({"x_mm": 1, "y_mm": 2}), "head.z_mm: this key is missing"),
    (set_in("timing", "lead_in")(3), "timing.lead_in: unknown key; allowed: break_s, lead_in_s"),
]


@pytest.mark.parametrize(("change", "message"), MISTAKES)
def test_each_mistake_is_told_at_its_key(
    refuse: Refuse, change: Callable[[Data], object], message: str
) -> None:
    assert message in refuse(change)


def test_run_lengths_that_cannot_be_kept_are_told(refuse: Refuse) -> None:
    def change(data: Data) -> None:
        data["order"]["max_run_length"] = 2
        data["order"]["max_run_of"] = "trial_type"
        data["catch_trials_per_block"] = 3

    assert "30 trials of one kind among 3 others cannot keep to runs of 2" in refuse(change)


def test_a_run_length_that_can_just_be_kept_is_accepted(load: Load) -> None:
    def change(data: Data) -> None:
        data["order"] |= {"max_run_length": 10, "max_run_of": "trial_type"}
        data["catch_trials_per_block"] = 2

    plan = make_plan(load(change), place=1, session=1, seed=1)
    kinds = [trial.trial_type for trial in plan.trials if trial.block == 1]
    assert kinds == (["stimulus"] * 10 + ["catch"]) * 2 + ["stimulus"] * 10


def test_any_stimulus_field_and_any_word_can_be_a_factor(load: Load) -> None:
    def change(data: Data) -> None:
        data["targets"]["back"] = {"x_mm": 300, "y_mm": 200, "z_mm": 1100}
        data["factors"] = {
            "within_block": {"drive": {"levels": [0.25, 0.5]}, "waveform": {"levels": ["sine", "square"]}},
            "between_blocks": {
                "target": {"levels": ["chest", "back"]},
                "posture": {"levels": ["up", "down"]},
            },
        }
        data["comparisons"] = []

    protocol = load(change)
    plan = make_plan(protocol, place=1, session=1, seed=1)
    assert len(plan.blocks) == 4
    for trial in plan.trials:
        assert trial.stimulus.drive == trial.conditions["drive"]
        assert trial.stimulus.target == trial.conditions["target"]


def test_a_protocol_is_frozen_and_survives_json() -> None:
    chest = load_protocol(find_protocol("chest"))
    assert Protocol.model_validate_json(chest.model_dump_json()) == chest
    with pytest.raises(ValueError, match="frozen"):
        chest.repetitions = 3  # type: ignore[misc]


def test_all_quantities_carry_their_units_in_their_names() -> None:
    """Every number of a protocol is a count, a share or has a unit behind an underscore."""
    plain = {
        "depth",
        "drive",
        "largest_drive",
        "largest_duty",
        "repetitions",
        "catch_trials_per_block",
        "max_run_length",
        *("levels", "felt_to_go_down", "step_up", "step_down"),
    }
    in_a_factors_unit = ("first", "second", "smallest", "largest", "start")
    units = ("_s", "_hz", "_mm", "_dbfs", "_dba")
    for model in Protocol.model_json_schema()["$defs"].values():
        for name, field in model.get("properties", {}).items():
            kinds = {field.get("type")} | {option.get("type") for option in field.get("anyOf", ())}
            if kinds & {"number", "integer"}:
                assert name in plain or name.endswith(units) or name in in_a_factors_unit, name


def test_a_small_level_keeps_its_sentence_however_it_is_spelled(load: Load) -> None:
    for key in ("0.00005", "5e-05", "5.0E-5"):
        depth = {"levels": [5e-05, 0.5], "describe": {key: "hardly any", "0.50": "half"}}

        def change(data: Data, depth: object = depth) -> None:
            data["factors"]["within_block"] = {"depth": depth}
            data["comparisons"] = []

        protocol = load(change)
        factor = protocol.factors.within_block["depth"]
        assert factor.describe == {"0.00005": "hardly any", "0.5": "half"}
        (column,) = [each for each in trial_columns([protocol]) if each.name == "depth"]
        assert column.levels == factor.describe


def test_a_level_described_twice_or_that_is_none_is_refused(refuse: Refuse) -> None:
    levels = set_in("factors", "within_block", "modulation_hz", "describe")
    assert "the level 25 is described twice" in refuse(levels({"25": "slow", "25.0": "slow"}))
    assert "there is no level '0.000005'; allowed: 25, 50, 100" in refuse(levels({"5e-06": "slow"}))


@pytest.mark.parametrize(
    "name", ["rate", "felt", "trials", "notes", "used", "participants", "interval", "mean"]
)
def test_no_factor_is_called_as_a_column_of_the_results(refuse: Refuse, name: str) -> None:
    change = set_in("factors", "between_blocks", name)({"levels": ["a", "b"]})
    assert f"{name!r} is a column of the tables already" in refuse(change)
