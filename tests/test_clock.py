import math
import time
from datetime import UTC, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from autd_trials.clock import RealClock, VirtualClock

START = datetime(2026, 11, 24, 9, 0, tzinfo=UTC)


@given(st.lists(st.floats(-10, 1e6), max_size=20))
def test_virtual_time_jumps_forward_and_never_back(times_s: list[float]) -> None:
    clock = VirtualClock(START)
    for time_s in times_s:
        before_s = clock.now_s()
        clock.sleep_until(time_s)
        assert clock.now_s() == max(before_s, time_s)
    assert abs(clock.utc_now() - START - timedelta(seconds=clock.now_s())) <= timedelta(microseconds=1)
    assert clock.poll_s == math.inf


def test_real_time_is_the_machines_and_waits_are_never_too_short() -> None:
    clock = RealClock()
    assert abs(clock.now_s() - time.monotonic()) < 0.1
    assert abs(clock.utc_now() - datetime.now(UTC)) < timedelta(seconds=0.1)
    for wait_s in (-1.0, 0.0, 0.0002, 0.003):
        until_s = clock.now_s() + wait_s
        clock.sleep_until(until_s)
        assert clock.now_s() >= until_s
