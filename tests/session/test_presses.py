"""What counts as an answer: keys held down, other buttons, what nobody understands, and floods."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError
from autd_trials.responses.responder import Input, Press, Unreadable
from autd_trials.session.events import Fault, ResponseMade
from autd_trials.session.presses import MOST_INPUTS, PressBook, TrialWindow
from autd_trials.session.recorder import Recorder
from autd_trials.testing.stage import MemoryLog

ONSET_S, END_S = 10.0, 12.5


class Book:
    """A press book with one open window, and what it recorded."""

    def __init__(self) -> None:
        self.log = MemoryLog()
        self.presses = PressBook(Recorder(self.log, VirtualClock(datetime(2026, 11, 25, tzinfo=UTC))))
        self.presses.open_window(TrialWindow(1, 1, 8.0, ONSET_S, END_S))

    def take(self, *inputs: Input) -> float | None:
        for each in inputs:
            self.presses.take([each])
        return self.presses.response_time_s

    @property
    def meanings(self) -> list[str | None]:
        return [event.meaning for event in self.log.events if isinstance(event, ResponseMade)]

    @property
    def faults(self) -> list[str]:
        return [event.what for event in self.log.events if isinstance(event, Fault)]


def held(first_s: float, last_s: float, delay_s: float = 0.5, every_s: float = 0.033) -> list[Press]:
    """What a keyboard types while a key is held down."""
    times = [first_s]
    while (time_s := times[-1] + (delay_s if len(times) == 1 else every_s)) <= last_s:
        times.append(time_s)
    return [Press(time_s, "space") for time_s in times]


def test_a_key_held_down_in_the_window_is_one_answer() -> None:
    book = Book()
    assert book.take(*held(ONSET_S + 0.4, ONSET_S + 1.5)) == pytest.approx(0.4)
    assert book.meanings[0] == "felt"
    assert book.meanings.count("repeat") > 10
    book.presses.refuse_doubtful()


@given(
    first_s=st.floats(8.0, ONSET_S - 0.01),
    delay_s=st.floats(0.2, 1.0),
    every_s=st.floats(0.025, 0.12),
)
def test_a_key_held_down_since_before_the_onset_is_no_answer_and_no_silence(
    first_s: float, delay_s: float, every_s: float
) -> None:
    book = Book()
    assert book.take(*held(first_s, END_S, delay_s, every_s)) is None
    with pytest.raises(DeviceError, match="'space' is held down"):
        book.presses.refuse_doubtful()


@given(st.lists(st.floats(0.16, 2.0), min_size=1, max_size=8))
def test_separate_presses_are_never_taken_for_repeats(gaps_s: list[float]) -> None:
    book = Book()
    time_s, times = 8.0, []
    for gap_s in gaps_s:
        time_s += gap_s
        times.append(time_s)
    answer = book.take(*(Press(time_s, "space") for time_s in times))
    within = [time_s - ONSET_S for time_s in times if ONSET_S <= time_s <= END_S]
    assert answer == (pytest.approx(within[0], abs=1e-6) if within else None)
    assert set(book.meanings) == {"felt"}
    book.presses.refuse_doubtful()


def test_a_button_without_that_meaning_is_recorded_said_once_and_does_not_count() -> None:
    book = Book()
    assert book.take(*(Press(ONSET_S + s, "B2", felt=False) for s in (0.5, 1.0))) is None
    assert book.meanings == ["other", "other"]
    assert book.faults == ["button 'B2' was pressed, which does not mean felt; it does not count"]
    assert book.take(Press(ONSET_S + 1.5, "B1")) == pytest.approx(1.5)


def test_what_may_have_been_an_answer_makes_the_trial_run_again() -> None:
    book = Book()
    assert book.take(Unreadable(ONSET_S + 1, "5 bytes: 'b1 12'", may_be_answer=True)) is None
    assert book.faults == ["5 bytes: 'b1 12'"]
    with pytest.raises(DeviceError, match="not known whether this was felt: 5 bytes: 'b1 12'"):
        book.presses.refuse_doubtful()
    book.take(Press(ONSET_S + 1.2, "B1"))
    book.presses.refuse_doubtful()  # an answer was given all the same


@pytest.mark.parametrize(("time_s", "may_be_answer"), [(9.0, True), (12.6, True), (7.0, True), (11.0, False)])
def test_what_was_no_answer_is_recorded_and_goes_on(time_s: float, may_be_answer: bool) -> None:
    book = Book()
    book.take(Unreadable(time_s, "something", may_be_answer=may_be_answer))
    book.presses.refuse_doubtful()
    assert book.faults == ["something"]


@pytest.mark.parametrize("kind", ["press", "unreadable"])
def test_a_flood_is_a_fault_and_work_stays_bounded(kind: str) -> None:
    book = Book()
    made: list[Input] = [
        Press(9 + n / 3840, "B1") if kind == "press" else Unreadable(9 + n / 3840, "?", may_be_answer=True)
        for n in range(5000)
    ]
    with pytest.raises(DeviceError, match=f"{5000 - MOST_INPUTS} of them were not recorded"):
        book.presses.take(made)
    assert len(book.log.events) == MOST_INPUTS
    assert book.log.waits == 1
