"""Presses are recorded in batches, and a box that floods is a fault, not a session that hangs."""

from datetime import UTC, datetime
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError, StoppedByPerson
from autd_trials.responses.responder import Press
from autd_trials.session.events import Fault, ResponseMade, TrialEnd
from autd_trials.session.presses import IN_S, MOST_INPUTS, PressBook, TrialWindow
from autd_trials.session.recorder import Recorder
from autd_trials.testing.stage import MemoryLog, Stage


def recorded(log: MemoryLog) -> list[float]:
    return [event.press_t_s for event in log.events if isinstance(event, ResponseMade)]


def test_a_batch_of_presses_waits_for_the_disk_once(stage: Stage) -> None:
    book = PressBook(Recorder(stage.log, stage.clock))
    book.open_window(TrialWindow(trial=1, attempt=1, start_s=0.0, onset_s=1.0, end_s=3.0))
    book.take([Press(1.0 + 0.05 * number, "a") for number in range(40)])
    assert len(recorded(stage.log)) == 40
    assert stage.log.waits == 1
    book.take([])
    assert stage.log.waits == 1
    assert book.response_time_s == 0.0


@given(batches=st.lists(st.integers(0, 200), max_size=12), presses_per_s=st.floats(0.1, MOST_INPUTS - 1))
def test_no_press_that_a_person_could_make_is_lost(batches: list[int], presses_per_s: float) -> None:
    """Up to the largest rate all are recorded, however they are batched."""
    times_s = iter([number / presses_per_s for number in range(sum(batches))])
    log = MemoryLog()
    book = PressBook(Recorder(log, VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))))
    for size in batches:
        book.take([Press(time_s, "a") for time_s in islice(times_s, size)])
    expected = [number / presses_per_s for number in range(sum(batches))]
    assert recorded(log) == pytest.approx(expected, abs=1e-6)
    assert log.waits == sum(size > 0 for size in batches)


def test_a_flood_is_a_fault_that_counts_what_it_left_out(stage: Stage) -> None:
    book = PressBook(Recorder(stage.log, stage.clock))
    with pytest.raises(DeviceError, match=f"{4000 - MOST_INPUTS} of them were not recorded") as caught:
        book.take([Press(number / 4000, "a") for number in range(4000)])
    assert caught.value.where == "responder"
    assert len(recorded(stage.log)) == MOST_INPUTS
    book.take([Press(10.0, "a")])
    assert len(recorded(stage.log)) == MOST_INPUTS + 1


def test_the_rate_counts_over_batches(stage: Stage) -> None:
    book = PressBook(Recorder(stage.log, stage.clock))
    step_s = 0.9 * IN_S / MOST_INPUTS
    for number in range(MOST_INPUTS):
        book.take([Press(number * step_s, "a")])
    with pytest.raises(DeviceError, match="more than 50 inputs in 1 s; 1 of them"):
        book.take([Press(MOST_INPUTS * step_s, "a")])
    assert len(recorded(stage.log)) == MOST_INPUTS


def test_a_flood_pauses_the_session_and_the_trial_runs_again(stage: Stage) -> None:
    stage.operator.go_on = 1
    present = stage.script.present

    def flood_once(presentation: object) -> None:
        present(presentation)  # type: ignore[arg-type]
        if len(stage.script.presented) == 2:
            onset_s = stage.script.presented[-1].onset_s
            stage.script.due += [Press(onset_s + number / 1000, "a") for number in range(900)]

    stage.script.present = flood_once  # type: ignore[method-assign]
    events = stage.run()
    assert [event.device for event in events if isinstance(event, Fault)] == ["responder"]
    second = [event for event in events if isinstance(event, TrialEnd) and event.trial == 2]
    assert [event.status for event in second] == ["interrupted", "complete"]


def test_a_flood_that_nobody_mends_ends_the_session_and_an_abort_in_it_is_obeyed(stage: Stage) -> None:
    stage.script.press_after_s = tuple(0.001 * number for number in range(1000))
    stage.operator.go_on = 1000
    stage.listeners.append(
        lambda event: stage.interrupts.request_abort() if len(stage.of("pause")) == 3 else None
    )
    with pytest.raises(StoppedByPerson):
        stage.run()
    assert len(stage.of("pause")) == 3
