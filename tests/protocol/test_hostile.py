"""Mutated protocols, 10,000 of them: never a traceback, never accepted wrongly."""

import copy
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from autd_trials.errors import UsageError
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Protocol, StimulusSpec

CASES = 10_000
SHIPPED = ("chest", "chest-catch", "chest-threshold", "pilot")
PLANNED_EVERY = 7

HOSTILE: list[Any] = [
    *(None, True, False, 0, -1, 1, 2, 17, 0.5, 1e-9, -0.0, 1e18, 10**30, 1e308, float("nan"), float("inf")),
    *(
        "",
        " ",
        "x",
        "inner",
        "chest",
        "sine",
        "no",
        "1:30",
        "010",
        "2026-11-22",
        "null",
        "NaN",
        "../../etc",
        "a" * 3000,
    ),
    *(
        "\x07",
        "\u202e",
        "\u0000",
        "{",
        "- -",
        "!!python/object/apply:os.system ['true']",
        "&a *a",
        "%s%n",
        "💥",
    ),
    *(
        [],
        {},
        [[]],
        [1, "a"],
        ["inner"],
        {"x_mm": 1},
        {"levels": [1, 2]},
        {"levels": []},
        [None],
        {"": 1},
        [25, 50],
    ),
]
TEXT_SPLINTERS = [
    "\t",
    "  ",
    "\n",
    ":",
    "- ",
    "#",
    "'",
    '"',
    "{",
    "]",
    "&x ",
    "*x",
    "!!int ",
    "---\n",
    "\x00",
    "é",
    "\ufeff",
]

Change = Callable[[random.Random, Any], None]


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the place of every value."""
    children = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in children:
        yield (*path, key)
        yield from places(value, (*path, key))


def parent_and_key(data: Any, chance: random.Random) -> tuple[Any, Any]:
    path = chance.choice(list(places(data)))
    for part in path[:-1]:
        data = data[part]
    return data, path[-1]


def replace_value(chance: random.Random, data: Any) -> None:
    parent, key = parent_and_key(data, chance)
    parent[key] = copy.deepcopy(chance.choice(HOSTILE))


def scale_number(chance: random.Random, data: Any) -> None:
    numbers = [path for path in places(data) if type(value_at(data, path)) in (int, float)]
    path = chance.choice(numbers)
    *way, key = path
    value_at(data, way)[key] = value_at(data, path) * chance.choice([-1, 0, 0.1, 0.5, 1.0001, 2, 10, 1e6])


def remove(chance: random.Random, data: Any) -> None:
    parent, key = parent_and_key(data, chance)
    del parent[key]


def rename(chance: random.Random, data: Any) -> None:
    parent, key = parent_and_key(data, chance)
    if isinstance(parent, dict):
        parent[chance.choice([f"{key}x", str(key)[:-1], "target", "name", "modulation_hz", ""])] = parent.pop(
            key
        )


def swap(chance: random.Random, data: Any) -> None:
    first, first_key = parent_and_key(data, chance)
    second, second_key = parent_and_key(data, chance)
    first[first_key], second[second_key] = copy.deepcopy(second[second_key]), copy.deepcopy(first[first_key])


def duplicate(chance: random.Random, data: Any) -> None:
    parent, key = parent_and_key(data, chance)
    if isinstance(parent, list):
        parent.append(copy.deepcopy(parent[key]))


CHANGES: list[Change] = [replace_value, replace_value, scale_number, remove, rename, swap, duplicate]


def value_at(data: Any, path: Any) -> Any:
    for part in path:
        data = data[part]
    return data


def mutated_text(chance: random.Random, data: Any, text: str) -> str:
    """Return a protocol with one to three mistakes, in its data or in its text."""
    if chance.random() < 0.6:
        data = copy.deepcopy(data)
        for _ in range(chance.randint(1, 3)):
            chance.choice(CHANGES)(chance, data)
        dumped: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
        return dumped
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(text))
        kind = chance.randrange(4)
        if kind == 0:
            text = text[:at] + chance.choice(TEXT_SPLINTERS) + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + chance.randint(1, 40) :]
        elif kind == 2:
            text = text[:at] or "\n"
        else:
            lines = text.splitlines(keepends=True)
            line = chance.randrange(len(lines))
            lines.insert(chance.randrange(len(lines)), lines.pop(line))
            text = "".join(lines)
    return text


def recheck(protocol: Protocol) -> None:
    """Check an accepted protocol by rules written down once more, from the field's point of view."""
    safety, timing = protocol.safety, protocol.timing
    assert 0 < timing.pause_min_s <= timing.pause_max_s
    assert re.fullmatch(r"[A-Za-z0-9-]+", protocol.name)
    assert protocol.targets
    names = [*protocol.factors.within_block, *protocol.factors.between_blocks]
    assert len(names) == len(set(names))
    for comparison in protocol.comparisons:
        factor = {**protocol.factors.within_block, **protocol.factors.between_blocks}[comparison.factor]
        assert {comparison.first, comparison.second} <= set(factor.levels)
        assert comparison.first != comparison.second
    if protocol.masking is not None:
        assert (protocol.masking.level_dbfs is None) != (protocol.masking.level_dba is None)
    assert safety.longest_burst_s <= 16


def recheck_plan(protocol: Protocol) -> None:
    """Plan a session and check every stimulus of it against the protocol's limits."""
    plan = make_plan(protocol, place=1, session=1, seed=1)
    exposure_s = 0.0
    for trial in plan.trials:
        stimulus = trial.stimulus
        assert stimulus.target in protocol.targets
        assert 0 <= stimulus.drive <= protocol.safety.largest_drive
        assert 0 < stimulus.duration_s <= protocol.safety.longest_burst_s
        assert stimulus.duration_s <= protocol.timing.response_window_s
        assert 2 * stimulus.ramp_s <= stimulus.duration_s
        assert 0 < stimulus.modulation_hz <= 1000
        assert (stimulus.drive == 0) == (trial.trial_type == "catch")
        exposure_s += stimulus.drive**2 * stimulus.duration_s
    assert exposure_s <= protocol.safety.session_exposure_s * (1 + 1e-6)
    if protocol.method is not None:
        for level in protocol.method.levels:
            at_level = {**protocol.stimulus.model_dump(), protocol.method.varies: level}
            assert StimulusSpec.model_validate(at_level).drive <= protocol.safety.largest_drive
    combinations = 1
    for factor in protocol.factors.within_block.values():
        combinations *= len(factor.levels)
    per_block = combinations * protocol.repetitions + protocol.catch_trials_per_block
    assert len(plan.trials) == per_block * len(plan.blocks)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_mutated_protocols_are_refused_with_their_place_or_are_right(tmp_path: Path) -> None:
    texts = [find_protocol(name).read_text(encoding="utf-8") for name in SHIPPED]
    plain = [(yaml.safe_load(text), text) for text in texts]
    chance = random.Random(20261124)
    path = tmp_path / "hostile.yaml"
    accepted = refused = 0
    for _ in range(CASES):
        path.write_text(mutated_text(chance, *chance.choice(plain)), encoding="utf-8", errors="replace")
        try:
            protocol = load_protocol(path)
        except UsageError as error:
            refused += 1
            lines = str(error).splitlines()
            assert all(re.match(r".*hostile\.yaml:(\d+:\d+| and \d+ more)", line) for line in lines), lines
            continue
        accepted += 1
        recheck(protocol)
        if accepted % PLANNED_EVERY == 0:
            recheck_plan(protocol)
    assert refused > CASES / 2, "most mutations break something"
    assert accepted > CASES / 50, "some are harmless, and were checked"
