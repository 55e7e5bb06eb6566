"""The stage of a small session: two blocks, in each a stimulus, a catch trial and a stimulus."""

from typing import Any

import pytest

from autd_trials.protocol.schema import Protocol, Timing
from autd_trials.testing.stage import Stage, make_stage
from autd_trials.testing.studies import make_protocol

WINDOW_S = 2.5
PAUSE_S = 1.5


def small_protocol(**changes: Any) -> Protocol:
    timing = Timing(response_window_s=WINDOW_S, pause_min_s=PAUSE_S, pause_max_s=PAUSE_S, lead_in_s=3.0)
    fields: dict[str, Any] = {"within": {}, "timing": timing} | changes
    return make_protocol("small", **fields)


@pytest.fixture
def stage() -> Stage:
    return make_stage(small_protocol())
