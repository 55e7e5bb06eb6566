"""What may not be run is refused before anything is asked, whichever order was drawn."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.array.geometry import UnitPose
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.protocol.method import Range, Staircase
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Factor, Factors, Protocol, StimulusSpec, Target, Timing
from autd_trials.session.preflight import Preflight, Used, preflight
from autd_trials.session.runner import Done
from autd_trials.stimulus import Limits, duty_of_equal_bursts, largest_duty
from autd_trials.testing.stage import LIMITS, Stage, make_stage
from tests.session.conftest import small_protocol


def judge(protocol: Protocol, limits: Limits = LIMITS, used: Used | None = None, seed: int = 1) -> Preflight:
    used = used or Used()
    clock = VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))
    array = PhasedArray(
        [UnitPose("unit 1", np.eye(3), np.zeros(3))],
        VirtualBackend(clock),
        limits,
        clock,
        speed_of_sound_m_s=343.0,
        exposure_used_s=used.session_s,
        daily_used_s=used.today_s,
    )
    plan = make_plan(protocol, place=1, session=1, seed=seed)
    return preflight(protocol, plan, array, limits, used, plan.trials)


def stricter(**changes: float) -> Limits:
    return LIMITS.model_copy(update=changes)


def test_it_says_what_a_session_would_be() -> None:
    found = judge(small_protocol())
    assert (found.trials, found.blocks, found.exposure_s, found.largest_exposure_s) == (6, 2, 4.0, 1.0)
    assert found.duty == pytest.approx(15 / 60)
    assert found.shortest_s == pytest.approx(6 * (2.5 + 1.5) + 2 * 3.0)
    assert found.adaptive_trials is None
    assert found.remarks == ()


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"largest_drive": 0.5}, "the drive would be 1"),
        ({"longest_burst_s": 0.5}, "the burst's length in s would be 1"),
        ({"largest_duty": 0.15}, "the share of on-time in 60 s would be 0.25"),
        ({"session_exposure_s": 3.9}, "the session's exposure"),
        ({"daily_exposure_s": 3.9}, "the participant's exposure in 24 h"),
    ],
)
def test_a_limit_that_the_session_would_pass_is_refused(limits: dict[str, float], message: str) -> None:
    with pytest.raises(UnsafeError, match=message):
        judge(small_protocol(), stricter(**limits))


def test_what_was_used_before_counts() -> None:
    limits = stricter(session_exposure_s=10.0, daily_exposure_s=20.0)
    judge(small_protocol(), limits, Used(session_s=6.0, today_s=16.0))
    with pytest.raises(UnsafeError, match="the session's exposure"):
        judge(small_protocol(), limits, Used(session_s=6.1, today_s=6.1))
    with pytest.raises(UnsafeError, match="in 24 h"):
        judge(small_protocol(), limits, Used(session_s=0.0, today_s=16.1))


def test_limits_that_leave_no_room_for_an_interrupted_trial_are_remarked() -> None:
    for used in (Used(), Used(session_s=1.0, today_s=1.0)):
        found = judge(small_protocol(), stricter(session_exposure_s=4.5 + used.session_s), used)
        assert any("could not be finished" in remark for remark in found.remarks)


@pytest.mark.parametrize("smallest", [0.001, 0.0019])
def test_every_level_that_a_method_may_choose_is_judged(smallest: float) -> None:
    method = Staircase(
        kind="staircase", varies="drive", range=Range(smallest=smallest, largest=1.0, levels=5), start=1.0
    )
    with pytest.raises(UsageError, match="too small for the devices"):
        judge(small_protocol(method=method))


def test_a_target_out_of_reach_is_refused() -> None:
    with pytest.raises(UsageError, match="out of reach"):
        judge(small_protocol(targets={"chest": Target(x_mm=0.0, y_mm=0.0, z_mm=4000.0)}))


def test_short_adaptive_runs_are_remarked() -> None:
    method = Staircase(
        kind="staircase", varies="drive", range=Range(smallest=0.1, largest=1.0, levels=5), start=1.0
    )
    found = judge(small_protocol(method=method, repetitions=4))
    assert found.adaptive_trials == 4
    assert any("has 4 trials" in remark for remark in found.remarks)


@settings(max_examples=60, deadline=None)
@given(
    durations=st.lists(st.floats(0.05, 2.0), min_size=1, max_size=3, unique=True),
    window_s=st.floats(2.0, 4.0),
    pause_s=st.floats(0.1, 2.0),
    limit=st.floats(0.1, 0.9),
    seed=st.integers(0, 1000),
)
def test_whatever_passes_runs_without_being_stopped(
    durations: list[float], window_s: float, pause_s: float, limit: float, seed: int
) -> None:
    """The duty of the schedule as it was run is never over what the preflight had said."""
    protocol = small_protocol(
        factors=Factors(within_block={"duration_s": Factor(levels=tuple(durations))}),
        timing=Timing(response_window_s=window_s, pause_min_s=pause_s, pause_max_s=2.5, lead_in_s=0.0),
        repetitions=6,
    )
    limits = stricter(largest_duty=limit, session_exposure_s=100)
    try:
        found = judge(protocol, limits, seed=seed)
    except UnsafeError:
        longest_s = max(durations)  # refused only for what some order of the trials could have had
        assert duty_of_equal_bursts(longest_s, window_s + pause_s) > limit
        return
    stage = make_stage(protocol)
    stage.plan = make_plan(protocol, place=1, session=1, seed=seed)
    stage.limits = limits
    events = stage.run()
    assert stage.of("session-end")[-1].status == "success"  # type: ignore[union-attr]
    assert [e for e in events if e.event == "note"] == []
    bursts = [
        (e.onset_t_s, e.onset_t_s + e.duration_s) for e in events if e.event == "stimulus" and e.drive > 0
    ]
    assert largest_duty(bursts) <= found.duty + 1e-9


def test_bursts_before_a_resume_delay_the_next_onset_instead_of_ending_the_session(stage: Stage) -> None:
    stage.limits = stricter(largest_duty=0.25)
    stage.earlier_bursts = tuple((-15.0 + number, -14.5 + number) for number in range(15))
    stage.earlier_bursts += ((-0.5, 0.0),)
    events = stage.run(Done(complete=frozenset({1, 2, 3})))
    notes: list[Any] = [event for event in events if event.event == "note"]
    assert notes == []
    assert stage.of("session-end")[-1].status == "success"  # type: ignore[union-attr]

    second = make_stage(stage.protocol)
    second.limits = stricter(largest_duty=0.25)
    second.earlier_bursts = tuple((-29.0 + 2 * number, -28.0 + 2 * number) for number in range(15))
    events = second.run()
    assert any("waits" in event.text for event in events if event.event == "note")
    starts = [e for e in events if e.event == "stimulus" and e.drive > 0]
    bursts = [*second.earlier_bursts, *((e.onset_t_s, e.onset_t_s + e.duration_s) for e in starts)]
    assert largest_duty(bursts) <= 0.25 + 1e-6
    assert starts[0].onset_t_s == pytest.approx(-29.0 + 60, abs=0.01)


def test_the_stimulus_is_in_words_of_the_array() -> None:
    spec = StimulusSpec(duration_s=1.0, modulation_hz=100.0, target="chest", drive=0.5)
    assert judge(small_protocol(stimulus=spec)).exposure_s == pytest.approx(4 * 0.25)
