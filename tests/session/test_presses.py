"""Presses are recorded in batches, and a box that floods is a fault, not a session that hangs."""

from datetime import UTC, datetime
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError, StoppedByPerson
from autd_trials.responses.rate import IN_S, MOST_INPUTS
from autd_trials.responses.responder import Presentation, Press, Repeat, Unreadable
from autd_trials.session.events import Fault, ResponseMade, TrialEnd, UnreadableInput
from autd_trials.session.presses import PressBook, TrialWindow
from autd_trials.session.recorder import Recorder
from autd_trials.testing.stage import MemoryLog, Stage
from tests.session.conftest import PAUSE_S


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
    assert book.answer is not None
    assert book.answer.response_time_s == 0.0


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


ONSET_S, END_S = 1.0, 3.0
inputs = st.one_of(
    st.builds(
        Press,
        st.floats(0, 4),
        st.sampled_from(["a", "b"]),
        means=st.sampled_from(["felt", "not_felt", "undeclared"]),
        repeat=st.sampled_from(["no", "yes"]),
    ),
    st.builds(Unreadable, st.floats(0, 4), st.text(max_size=5)),
)


@given(st.lists(inputs, max_size=8).map(lambda came: sorted(came, key=lambda each: each.time_s)))
def test_not_felt_is_said_only_where_nothing_unclear_came(came: list[Press | Unreadable]) -> None:
    """Whatever comes is recorded; the first press that means something answers; else a doubt is a fault."""
    log = MemoryLog()
    book = PressBook(Recorder(log, VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))))
    book.open_window(TrialWindow(trial=1, attempt=1, start_s=0.0, onset_s=ONSET_S, end_s=END_S))
    for each in came:
        book.take(*([each], []) if isinstance(each, Press) else ([], [each]))
    assert len(log.events) == len(came)
    inside = [each for each in came if ONSET_S <= each.time_s <= END_S]
    answers = [p for p in inside if isinstance(p, Press) and p.means != "undeclared" and p.repeat == "no"]
    if answers:
        assert book.answer is not None
        assert (book.answer.means, book.answer.button) == (answers[0].means, answers[0].button)
        book.refuse_unclear()
    elif inside:
        assert book.answer is None
        with pytest.raises(DeviceError, match="not clear whether trial 1 was answered"):
            book.refuse_unclear()
    else:
        book.refuse_unclear()


def test_something_unreadable_in_a_window_pauses_and_the_trial_runs_again(stage: Stage) -> None:
    stage.operator.go_on = 1
    stage.script.garbage = [Unreadable(3.0 + PAUSE_S + 1.0, "b'b1'"), Unreadable(1.0, "b'ready'")]
    stage.script.garbage.sort(key=lambda each: each.time_s)
    events = stage.run()
    found = [event for event in events if isinstance(event, UnreadableInput)]
    assert [(event.phase, event.trial, event.what) for event in found] == [
        ("outside", None, "b'ready'"),
        ("window", 1, "b'b1'"),
    ]
    first = [event for event in events if isinstance(event, TrialEnd) and event.trial == 1]
    assert [(end.status, end.response) for end in first] == [("interrupted", None), ("complete", "not_felt")]
    assert any("b'b1'" in asked for asked in stage.operator.asked)


def test_a_key_held_down_is_no_answer_in_any_trial(stage: Stage) -> None:
    """The first press of it is one, if it falls into a window."""
    held_s = [3.0 + PAUSE_S + 0.5 + number / 30 for number in range(3000)]
    stage.script.due = [
        Press(time_s, "a", repeat="yes" if number else "no") for number, time_s in enumerate(held_s)
    ]
    with pytest.raises(DeviceError, match="held down"):
        stage.run()
    ends = [event for event in stage.log.events if isinstance(event, TrialEnd)]
    assert [(end.trial, end.response) for end in ends if end.status == "complete"] == [(1, "felt")]
    assert all(end.trial == 2 for end in ends if end.status == "interrupted")


def test_a_button_that_means_not_felt_answers_so(stage: Stage) -> None:
    stage.script.answer = lambda shown: ()
    present = stage.script.present

    def press_no(presentation: Presentation) -> None:
        present(presentation)
        stage.script.due += [
            Press(presentation.onset_s + 0.5, "B2", means="not_felt"),
            Press(presentation.onset_s + 0.9, "B1"),
        ]

    stage.script.present = press_no  # type: ignore[method-assign]
    events = stage.run()
    ends = [event for event in events if isinstance(event, TrialEnd)]
    assert {(end.status, end.response, end.response_time_s) for end in ends} == {
        ("complete", "not_felt", None)
    }


@pytest.mark.parametrize(
    ("times_s", "repeats", "answered_s"),
    [
        ([0.4, 0.9, 0.93, 0.96], ["no", "perhaps", "yes", "yes"], 0.4),  # pressed, and held from then on
        ([0.3, 0.33, 0.36], ["perhaps", "yes", "yes"], None),  # held since shortly before the onset
        ([0.01, 0.04, 0.07], ["yes", "yes", "yes"], None),  # held since long before
        ([0.2, 0.5, 0.8], ["perhaps", "perhaps", "perhaps"], 0.2),  # tapped again and again
        ([1.95], ["perhaps"], None),  # no time left to see whether it goes on
        ([0.3, 0.33, 1.6], ["perhaps", "yes", "no"], 1.6),  # let go, and pressed anew
    ],
)
def test_a_held_key_is_told_from_one_that_is_pressed_again(
    times_s: list[float], repeats: list[Repeat], answered_s: float | None
) -> None:
    book = PressBook(Recorder(MemoryLog(), VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))))
    book.open_window(TrialWindow(trial=1, attempt=1, start_s=0.0, onset_s=ONSET_S, end_s=END_S))
    presses = zip(times_s, repeats, strict=True)
    book.take([Press(ONSET_S + time_s, "a", repeat=repeat) for time_s, repeat in presses])
    assert (book.answer and book.answer.response_time_s) == answered_s
    if answered_s is None:
        with pytest.raises(DeviceError, match="held down"):
            book.refuse_unclear()
