"""Limits, exposure and duty: one place of judgement for protocol, rig and array."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from autd_trials.array.driver import Stimulus
from autd_trials.protocol.schema import Safety, StimulusSpec
from autd_trials.rig.schema import LimitsSpec
from autd_trials.stimulus import (
    DAILY_EXPOSURE_S,
    DUTY_WINDOW_S,
    LimitName,
    Limits,
    StimulusFields,
    duty_of_equal_bursts,
    duty_until,
    exposure_s,
    largest_duty,
    total_exposure_s,
)

limits = st.builds(
    Limits,
    largest_drive=st.floats(0, 1),
    longest_burst_s=st.floats(0, 16, exclude_min=True),
    largest_duty=st.floats(0, 1, exclude_min=True),
    session_exposure_s=st.floats(0, 36_000, exclude_min=True),
    daily_exposure_s=st.floats(0, 36_000, exclude_min=True),
)
names = st.sampled_from(list(Limits.model_fields))


@given(limits, limits, names, st.floats(allow_nan=True))
def test_under_two_limits_what_is_over_one_of_them_is_over_both(
    rig: Limits, protocol: Limits, name: LimitName, value: float
) -> None:
    over_one = bool(rig.excess(name, value) or protocol.excess(name, value))
    assert bool(rig.and_also(protocol).excess(name, value)) == over_one
    assert rig.and_also(protocol) == protocol.and_also(rig)


@given(limits, names)
def test_a_limit_allows_itself_and_nothing_over_it(some: Limits, name: LimitName) -> None:
    allowed = getattr(some, name)
    assert some.excess(name, allowed) is None
    excess = some.excess(name, allowed * 1.001 + 5e-324)
    assert (excess is not None) == (allowed * 1.001 + 5e-324 > allowed)
    assert some.excess(name, math.nan) is not None


def test_an_excess_names_both_numbers() -> None:
    strict = Limits(largest_drive=0.5, longest_burst_s=1.0, largest_duty=0.1, session_exposure_s=10.0)
    assert str(strict.excess("largest_drive", 0.75)) == "the drive would be 0.75, over the limit of 0.5"
    assert strict.daily_exposure_s == DAILY_EXPOSURE_S


def test_a_rig_must_say_its_largest_drive_and_a_protocol_need_not() -> None:
    some = {"longest_burst_s": 1.0, "largest_duty": 0.1, "session_exposure_s": 10.0}
    assert Safety.model_validate(some).largest_drive == 1
    with pytest.raises(ValidationError, match="largest_drive"):
        LimitsSpec.model_validate(some)


def test_protocol_and_array_speak_of_a_stimulus_in_the_same_fields() -> None:
    assert set(StimulusSpec.model_fields) - {"target"} == set(StimulusFields.model_fields)
    assert set(Stimulus.model_fields) - {"target_mm"} == set(StimulusFields.model_fields)


def test_exposure_is_drive_squared_times_duration() -> None:
    stimulus = StimulusFields(duration_s=2.0, modulation_hz=50.0, drive=0.3)
    assert exposure_s(stimulus) == pytest.approx(0.18)
    assert total_exposure_s([stimulus] * 10) == pytest.approx(1.8)


@given(st.lists(st.tuples(st.floats(0, 20), st.floats(0.01, 5)), min_size=1, max_size=30), st.data())
def test_no_window_holds_more_than_the_largest_duty(
    pauses_and_lengths_s: list[tuple[float, float]], data: st.DataObject
) -> None:
    bursts, now_s = [], 0.0
    for pause_s, length_s in pauses_and_lengths_s:
        bursts.append((now_s + pause_s, now_s + pause_s + length_s))
        now_s += pause_s + length_s
    end_s = data.draw(st.floats(0, now_s + 70))
    assert duty_until(bursts, end_s) <= largest_duty(bursts) + 1e-9


@given(burst_ms=st.integers(50, 5000), gap_ms=st.integers(0, 5000))
def test_the_duty_of_equal_bursts_is_that_of_a_sliding_window(burst_ms: int, gap_ms: int) -> None:
    """Against sums over every window of whole milliseconds."""
    period_ms = burst_ms + gap_ms
    times_ms = np.arange(200_000)
    on_ms = np.concatenate([[0], np.cumsum(times_ms % period_ms < burst_ms)])
    window_ms = round(DUTY_WINDOW_S * 1000)
    brute = (on_ms[window_ms:] - on_ms[:-window_ms]).max() / window_ms
    assert duty_of_equal_bursts(burst_ms / 1000, period_ms / 1000) == pytest.approx(brute, abs=1e-9)
