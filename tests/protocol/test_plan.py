import hashlib
import itertools
import subprocess
import sys
from collections import Counter
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.errors import UsageError
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import Plan, make_plan, plan_to_tsv
from tests.protocol.conftest import Load

Data = dict[str, Any]
CHEST = load_protocol(find_protocol("chest"))
CATCH = load_protocol(find_protocol("chest-catch"))


def test_a_plan_never_changes() -> None:
    """The paper's study for the first participant, seed 1: every later version must plan the same."""
    table = plan_to_tsv(make_plan(CHEST, place=1, session=1, seed=1))
    assert (
        hashlib.sha256(table.encode()).hexdigest()
        == "0b5bd1fd81022f035daddf4ce2a6c91fb7602fa06557210cb7098ee09c83ef75"
    )


def test_another_process_with_another_hash_seed_plans_the_same() -> None:
    program = (
        "from autd_trials.protocol.load import *; from autd_trials.protocol.plan import *; import sys;"
        "sys.stdout.write(plan_to_tsv(make_plan(load_protocol(find_protocol('chest-catch')),"
        " place=3, session=2, seed=9)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={"PYTHONHASHSEED": "12345"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == plan_to_tsv(make_plan(CATCH, place=3, session=2, seed=9))


@given(place=st.integers(1, 40), session=st.integers(1, 5), seed=st.integers(0, 2**63 - 1))
def test_every_condition_comes_as_often_as_planned(place: int, session: int, seed: int) -> None:
    plan = make_plan(CATCH, place=place, session=session, seed=seed)
    assert [trial.trial for trial in plan.trials] == list(range(1, len(plan.trials) + 1))
    for block in plan.blocks:
        kinds = Counter(t.conditions["modulation_hz"] for t in plan.trials if t.block == block.block)
        assert kinds == {25.0: 10, 50.0: 10, 100.0: 10, None: CATCH.catch_trials_per_block}
    for trial in plan.trials:
        is_catch = trial.trial_type == "catch"
        assert is_catch == (trial.conditions["modulation_hz"] is None) == (trial.stimulus.drive == 0)
        assert trial.conditions["clothing"] == plan.blocks[trial.block - 1].conditions["clothing"]
        assert CATCH.timing.pause_min_s <= trial.pause_before_s <= CATCH.timing.pause_max_s


def test_block_orders_are_counterbalanced_over_places_and_differ_between_sessions() -> None:
    first = [
        make_plan(CHEST, place=p, session=1, seed=1).blocks[0].conditions["clothing"] for p in range(1, 9)
    ]
    assert first == ["inner", "inner_outer"] * 4
    again = make_plan(CHEST, place=1, session=2, seed=1).blocks[0].conditions["clothing"]
    assert again == "inner_outer"


def test_seed_place_and_session_each_give_another_order() -> None:
    keys = itertools.product((1, 2), repeat=3)
    plans = [make_plan(CHEST, place=place, session=session, seed=seed) for place, session, seed in keys]
    assert len({tuple(t.stimulus.modulation_hz for t in plan.trials) for plan in plans}) == len(plans)


def test_pauses_are_spread_over_their_range() -> None:
    pauses_s = [
        t.pause_before_s for seed in range(50) for t in make_plan(CHEST, place=1, session=1, seed=seed).trials
    ]
    assert min(pauses_s) < 1.51
    assert max(pauses_s) > 2.49
    assert sum(pauses_s) / len(pauses_s) == pytest.approx(2.0, abs=0.03)


def test_descriptions_go_with_the_block() -> None:
    plan = make_plan(CHEST, place=2, session=1, seed=1)
    assert plan.blocks[0].descriptions == ("outerwear over inner wear",)


@pytest.mark.parametrize("run_of", [None, "modulation_hz", "trial_type"])
def test_runs_are_limited_in_what_the_protocol_names(load: Load, run_of: str | None) -> None:
    def change(data: Data) -> None:
        data["order"] |= {"max_run_length": 4, "max_run_of": run_of}
        data["factors"]["within_block"]["drive"] = {"levels": [0.5, 1.0]}
        data["repetitions"] = 5
        data["catch_trials_per_block"] = 10
        data["comparisons"] = []

    protocol = load(change)
    for seed in range(10):
        plan = make_plan(protocol, place=1, session=1, seed=seed)
        for block in (1, 2):
            groups = [_run_group(t.conditions, t.trial_type, run_of) for t in plan.trials if t.block == block]
            assert max(len(list(run)) for _, run in itertools.groupby(groups)) <= 4


def _run_group(conditions: dict[str, Any], trial_type: str, run_of: str | None) -> object:
    if run_of == "trial_type" or trial_type == "catch":
        return trial_type
    return conditions[run_of] if run_of else tuple(sorted(conditions.items()))


def test_a_fixed_order_takes_the_kinds_in_turn(load: Load) -> None:
    def change(data: Data) -> None:
        data["order"] = {"trials": "fixed", "blocks": "fixed"}
        data["repetitions"] = 2
        data["catch_trials_per_block"] = 3

    plan = make_plan(load(change), place=2, session=1, seed=1)
    block = [t.conditions["modulation_hz"] for t in plan.trials if t.block == 1]
    assert block == [25, 50, 100, None, 25, 50, 100, None, None]
    assert [b.conditions["clothing"] for b in plan.blocks] == ["inner", "inner_outer"]


def test_shuffled_blocks_come_in_every_order(load: Load) -> None:
    protocol = load(lambda data: data["order"].update(blocks="shuffled"))
    orders = Counter(
        make_plan(protocol, place=1, session=1, seed=seed).blocks[0].conditions["clothing"]
        for seed in range(200)
    )
    assert set(orders) == {"inner", "inner_outer"}
    assert min(orders.values()) > 60


def test_a_plan_without_factors_has_one_block(load: Load) -> None:
    def change(data: Data) -> None:
        data["factors"] = {}
        data["comparisons"] = []

    plan = make_plan(load(change), place=1, session=1, seed=1)
    assert (len(plan.blocks), len(plan.trials)) == (1, 10)
    assert plan_to_tsv(plan).splitlines()[0].split("\t")[-2:] == ["trial_type", "pause_before_s"]


def test_the_largest_block_is_planned(load: Load) -> None:
    def change(data: Data) -> None:
        data["factors"]["within_block"]["modulation_hz"]["levels"] = list(range(10, 35))
        data["factors"]["between_blocks"] = {
            "posture": {"levels": ["sitting", "standing"]},
        }
        data["order"]["max_run_length"] = 1
        data["repetitions"] = 18
        data["catch_trials_per_block"] = 50
        data["safety"] |= {"session_exposure_s": 36000, "daily_exposure_s": 36000}
        data["comparisons"] = []

    plan = make_plan(load(change), place=7, session=1, seed=1)
    assert len(plan.trials) == 1000
    for block in (1, 2):
        kinds = [t.conditions["modulation_hz"] for t in plan.trials if t.block == block]
        assert all(before != after for before, after in itertools.pairwise(kinds))


def test_the_table_has_a_line_per_trial_and_reads_back(load: Load) -> None:
    plan = make_plan(CATCH, place=4, session=1, seed=2)
    header, *lines = [line.split("\t") for line in plan_to_tsv(plan).splitlines()]
    assert header == [
        *("place", "session", "seed", "block", "trial", "trial_type", "modulation_hz", "clothing"),
        "pause_before_s",
    ]
    assert len(lines) == len(plan.trials)
    for line, trial in zip(lines, plan.trials, strict=True):
        level = trial.conditions["modulation_hz"]
        assert line[6] == ("n/a" if level is None else f"{level:g}")
        assert float(line[8]) == trial.pause_before_s


def test_a_plan_survives_json() -> None:
    plan = make_plan(CATCH, place=1, session=1, seed=1)
    assert Plan.model_validate_json(plan.model_dump_json()) == plan


@pytest.mark.parametrize("numbers", [(0, 1, 1), (1, 0, 1), (1, 1, -1)])
def test_numbers_out_of_range_are_refused(numbers: tuple[int, int, int]) -> None:
    place, session, seed = numbers
    with pytest.raises(UsageError, match="give a whole number from"):
        make_plan(CHEST, place=place, session=session, seed=seed)
