"""The session's time axis, and clocks that are stepped."""

from datetime import datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.clock import VirtualClock
from autd_trials.session.axis import taken_up
from autd_trials.session.events import Event, HostTime, Note, SessionStart
from autd_trials.session.recorder import Recorder
from autd_trials.testing.script import START, SessionScript
from autd_trials.testing.stage import MemoryLog

BOOT = HostTime(boot="a", since_boot_s=1000.0)


def crashed(host: HostTime | None = BOOT) -> list[Event]:
    events = SessionScript().block(1).trials([1, 2]).begin(3).events
    events[0] = events[0].model_copy(update={"host": host})
    return events


def gap_s(host: HostTime | None, later: timedelta, *, begun: HostTime | None = BOOT) -> float:
    events = crashed(begun)
    now = datetime.fromisoformat(events[-1].utc) + later
    return taken_up(events, host, now).t_s - events[-1].t_s


def remarks(host: HostTime | None, later: timedelta, *, begun: HostTime | None = BOOT) -> tuple[str, ...]:
    events = crashed(begun)
    return taken_up(events, host, datetime.fromisoformat(events[-1].utc) + later).remarks


def test_on_the_same_boot_the_clock_that_nobody_sets_says_how_long_it_was() -> None:
    last_t_s = crashed()[-1].t_s
    host = HostTime(boot="a", since_boot_s=1000.0 + last_t_s + 8.0)
    for step_s in (0.0, 3600.0, -3600.0):
        assert gap_s(host, timedelta(seconds=8 + step_s)) == pytest.approx(8.0)
    assert remarks(host, timedelta(seconds=8.2)) == ()
    assert "stepped by +3600 s" in remarks(host, timedelta(seconds=3608))[0]
    assert "stepped by -3600 s" in remarks(host, timedelta(seconds=8 - 3600))[0]


def test_after_a_restart_of_the_computer_the_wall_clock_says_it_and_that_is_remarked() -> None:
    for host, begun in ((HostTime(boot="b", since_boot_s=60.0), BOOT), (BOOT, None)):
        assert gap_s(host, timedelta(hours=1), begun=begun) == pytest.approx(3600)
        assert (
            "3600 s since the last event, by its wall clock alone"
            in remarks(host, timedelta(hours=1), begun=begun)[0]
        )
        assert gap_s(host, timedelta(hours=-1), begun=begun) == 0
        assert "3600 s behind the last event" in remarks(host, timedelta(hours=-1), begun=begun)[0]


def test_a_system_that_names_no_boot_goes_by_the_wall_clock() -> None:
    unnamed = HostTime(boot=None, since_boot_s=1000.0)
    assert gap_s(unnamed, timedelta(seconds=5), begun=unnamed) == pytest.approx(5)


@given(
    since_boot_s=st.floats(0, 1e7),
    later_s=st.floats(-1e7, 1e7),
    boot=st.sampled_from(["a", "b", None]),
    virtual=st.booleans(),
)
def test_the_axis_never_goes_back(
    since_boot_s: float, later_s: float, boot: str | None, virtual: bool
) -> None:
    host = None if virtual else HostTime(boot=boot, since_boot_s=since_boot_s)
    assert gap_s(host, timedelta(seconds=later_s)) >= 0


class SteppedClock(VirtualClock):
    """Virtual time whose wall clock is set by somebody."""

    def __init__(self) -> None:
        super().__init__(START)
        self.step = timedelta()

    def utc_now(self) -> datetime:
        return super().utc_now() + self.step


@pytest.mark.parametrize("step_s", [3600.0, -3600.0, 0.5, -0.5])
def test_a_step_of_the_wall_clock_is_noted_once_with_the_event_that_follows(step_s: float) -> None:
    clock, log = SteppedClock(), MemoryLog()
    recorder = Recorder(log, clock)
    recorder.record(Note, text="before")
    clock.sleep_until(5.0)
    clock.step = timedelta(seconds=step_s)
    recorder.record(Note, text="after")
    clock.sleep_until(10.0)
    recorder.record(Note, text="later")
    texts = [event.text for event in log.events if isinstance(event, Note)]
    step = f"the computer's wall clock was stepped by {step_s:+.3f} s; t_s was not"
    assert texts == ["before", step, "after", "later"]
    assert [event.t_s for event in log.events] == [0.0, 5.0, 5.0, 10.0]


def test_a_wall_clock_that_is_slowly_corrected_is_not_remarked() -> None:
    clock, log = SteppedClock(), MemoryLog()
    recorder = Recorder(log, clock)
    for _ in range(20):
        clock.sleep_until(clock.now_s() + 600.0)
        clock.step += timedelta(seconds=0.3)  # 500 parts in a million
        recorder.record(Note, text="")
    assert len(log.events) == 20


def test_the_first_event_is_the_start_itself() -> None:
    assert isinstance(crashed()[0], SessionStart)
