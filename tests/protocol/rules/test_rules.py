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
