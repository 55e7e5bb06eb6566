import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.safety_checks import DUTY_WINDOW_S, largest_duty, session_exposure_s


@given(burst_ms=st.integers(50, 5000), gap_ms=st.integers(0, 5000))
def test_largest_duty_is_that_of_a_sliding_window(burst_ms: int, gap_ms: int) -> None:
    """Against sums over every window of whole milliseconds."""
    period_ms = burst_ms + gap_ms
    times_ms = np.arange(200_000)
    on_ms = np.concatenate([[0], np.cumsum(times_ms % period_ms < burst_ms)])
    window_ms = round(DUTY_WINDOW_S * 1000)
    brute = (on_ms[window_ms:] - on_ms[:-window_ms]).max() / window_ms
    assert largest_duty(burst_ms / 1000, period_ms / 1000) == pytest.approx(brute, abs=1e-9)


@pytest.mark.parametrize("name", ["chest", "chest-catch", "chest-threshold", "pilot"])
def test_exposure_is_that_of_the_planned_stimuli(name: str) -> None:
    protocol = load_protocol(find_protocol(name))
    plan = make_plan(protocol, place=1, session=1, seed=3)
    planned_s = sum(trial.stimulus.drive**2 * trial.stimulus.duration_s for trial in plan.trials)
    assert session_exposure_s(protocol) == pytest.approx(planned_s)
