"""Rules are asked where a protocol is loaded, and nowhere else."""

import json
from pathlib import Path
from typing import Any

import pytest

from autd_trials.errors import UsageError
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.rules import check_rules, faults
from autd_trials.protocol.schema import Protocol
from autd_trials.tables import RESERVED_NAMES

CHEST = load_protocol(find_protocol("chest"))


def broken(**changes: Any) -> Protocol:
    """Return the chest study in another shape that the schema allows."""
    return Protocol.model_validate_json(json.dumps(json.loads(CHEST.model_dump_json()) | changes))


def test_a_protocol_that_breaks_todays_rules_is_read_and_planned_as_it_was() -> None:
    factors = {"between_blocks": {"response": {"levels": ["NA", "na"]}}}
    old = broken(factors=factors, comparisons=[])
    assert len(list(faults(old))) >= 3
    assert Protocol.model_validate_json(old.model_dump_json()) == old
    assert len(make_plan(old, place=1, session=1, seed=1).blocks) == 2


def test_a_name_reserved_later_leaves_a_protocol_readable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autd_trials.protocol.rules.names.RESERVED_NAMES", RESERVED_NAMES | {"clothing"})
    assert Protocol.model_validate_json(CHEST.model_dump_json()) == CHEST
    with pytest.raises(UsageError, match="'clothing' is a column of the tables already"):
        load_protocol(find_protocol("chest"))


def test_a_protocol_made_in_python_is_checked_with_places() -> None:
    check_rules(CHEST)
    timing = json.loads(CHEST.timing.model_dump_json()) | {"pause_max_s": 0.1}
    with pytest.raises(
        UsageError, match=r"timing\.pause_max_s: pause_max_s \(0.1\) is less than pause_min_s"
    ):
        check_rules(broken(timing=timing))


@pytest.mark.parametrize("name", ["chest", "chest-catch", "chest-threshold", "pilot"])
def test_shipped_protocols_keep_the_rules(name: str) -> None:
    assert list(faults(load_protocol(Path(find_protocol(name))))) == []


@pytest.mark.parametrize(
    ("within", "stimulus", "place"),
    [
        ({"duration_s": {"levels": [0.5, 1]}}, {"duration_s": 16}, "stimulus.duration_s: the burst of 16 s"),
        (
            {"duration_s": {"levels": [0.5, 1]}},
            {"duration_s": 0.001},
            "stimulus.ramp_s: two ramps of 0.005 s",
        ),
        ({"target": {"levels": ["chest"]}}, {"target": "back"}, "stimulus.target: there is no target 'back'"),
        ({"drive": {"levels": [0.5]}}, {"drive": 0}, None),
    ],
)
def test_what_only_catch_trials_take_from_the_stimulus_is_checked(
    within: dict[str, Any], stimulus: dict[str, Any], place: str | None
) -> None:
    declared = json.loads(CHEST.stimulus.model_dump_json()) | stimulus
    changes = {"factors": {"within_block": within}, "stimulus": declared, "comparisons": []}
    check_rules(broken(**changes))
    with_catch_trials = broken(**changes, catch_trials_per_block=2)
    if place is None:
        check_rules(with_catch_trials)
    else:
        with pytest.raises(UsageError, match=place):
            check_rules(with_catch_trials)
