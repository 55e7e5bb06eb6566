"""Mutated protocols: refused with the place of what is wrong, never accepted wrongly.

`tests/fuzz/inputs.py` tries 10,000 of them through the command.
"""

import random
import re
from pathlib import Path

import pytest

from autd_trials.errors import UsageError
from autd_trials.protocol.load import load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Protocol, StimulusSpec
from tests.fuzz.mutations import mutated_yaml
from tests.fuzz.seeds import protocols

CASES = 400
PLANNED_EVERY = 7


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
def test_mutated_protocols_are_refused_with_their_place_or_are_right(tmp_path: Path) -> None:
    chance = random.Random(20261124)
    path = tmp_path / "hostile.yaml"
    accepted = refused = 0
    for _ in range(CASES):
        path.write_text(mutated_yaml(chance, chance.choice(protocols())), encoding="utf-8", errors="replace")
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
