"""No factor can be called as a column that some table puts beside it."""

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any

import autd_analysis
from autd_analysis.data.design import Design
from autd_analysis.data.trial_table import TrialRow
from autd_analysis.data.trials import data_frame
from autd_analysis.report.table import Declared

from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan, plan_columns
from autd_trials.protocol.schema import Factors, StimulusSpec
from autd_trials.records.trials_table import trial_columns
from autd_trials.tables import RESERVED_NAMES
from autd_trials.testing.studies import make_protocol

BIDS_NAMES = {"channel", "duration", "hed", "onset", "sample", "stim_file", "value"}
"""What columns of events have a meaning for in BIDS; in small letters, as factors are."""

LOGGED_NAMES = {"emulated", "masking", "participant_id", "run"}
"""What a person would take for the session's, not for a factor."""


def result_tables() -> Iterator[Declared[Any, Any]]:
    for module in pkgutil.walk_packages(autd_analysis.__path__, "autd_analysis."):
        for declared in vars(importlib.import_module(module.name)).values():
            if isinstance(declared, Declared):
                yield declared


def names_beside_factors() -> set[str]:
    protocol = load_protocol(find_protocol("chest.yaml"))
    plan = make_plan(protocol, place=1, session=1, seed=1)
    names = {column.name for column in plan_columns(plan)} - set(plan.trials[0].conditions)
    names |= {column.name for column in trial_columns([make_protocol(factors=Factors())])} - {"drive"}
    row = TrialRow("1", "1", 1, 1, 1, "catch", "complete", True, None, {})
    names |= set(map(str, data_frame([row], Design("none", None, (), ())).columns))
    for declared in result_tables():
        if declared.condition is not None:
            names |= {column.name for column in declared.fixed_columns(simulated=False)}
    return names


def test_the_list_is_what_the_tables_have_and_no_more() -> None:
    assert names_beside_factors() | BIDS_NAMES | LOGGED_NAMES == RESERVED_NAMES


def test_the_walk_finds_the_tables() -> None:
    with_factors = {declared.name for declared in result_tables() if declared.condition is not None}
    assert {"rates", "thresholds", "psychometric", "model_means", "response_times"} <= with_factors
    assert {"rate", "felt", "trials", "notes", "used", "participants", "interval", "mean"} <= RESERVED_NAMES


def test_what_a_stimulus_has_can_be_varied() -> None:
    assert not set(StimulusSpec.model_fields) & RESERVED_NAMES
