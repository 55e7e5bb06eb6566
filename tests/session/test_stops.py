"""Every stop is obeyed at once, and what follows is recorded."""

import os
import signal
import threading
import time
from datetime import UTC, datetime

import numpy as np
import pytest

from autd_trials.array.geometry import UnitPose
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.errors import StoppedByPerson
from autd_trials.session.events import Event, SessionEnd, StimulusStart, TrialEnd
from autd_trials.session.interrupts import Interrupts
from autd_trials.stimulus import Limits
from autd_trials.testing.stage import Stage
from tests.session.conftest import PAUSE_S

LONG_S = 8.0


def end(stage: Stage) -> SessionEnd:
    last = stage.log.events[-1]
    assert isinstance(last, SessionEnd)
    return last


def test_an_abort_halts_the_array_before_anything_else_happens(stage: Stage) -> None:
    """It is silent when the request returns, though the session has not come to look at it yet."""
    silent: list[bool] = []

    def ask(event: Event) -> None:
        if isinstance(event, StimulusStart) and event.trial == 3:
            stage.clock.sleep_until(stage.clock.now_s() + 0.5)
            stage.interrupts.request_abort("ended by SIGTERM")
            silent.append(stage.backend.states().on_burst == stage.backend.states().pending == 0)

    stage.listeners.append(ask)
    with pytest.raises(StoppedByPerson, match="ended by SIGTERM") as caught:
        stage.run()
    assert silent == [True]
    assert "--resume" in str(caught.value)
    assert (end(stage).status, end(stage).why) == ("aborted", "ended by SIGTERM")
    ends = [event for event in stage.log.events if isinstance(event, TrialEnd)]
    assert [(e.trial, e.status, e.started) for e in ends[-1:]] == [(3, "interrupted", True)]


@pytest.mark.parametrize("kind", ["trial-start", "stimulus", "response", "trial-end", "block-start", "pause"])
def test_an_abort_at_any_event_ends_the_session_as_aborted(stage: Stage, kind: str) -> None:
    stage.script.press_after_s = (0.3,)
    stage.listeners.append(lambda e: stage.interrupts.request_abort() if e.event == kind else None)
    with pytest.raises(StoppedByPerson):
        stage.run()
    assert end(stage).status == "aborted"
    now_ns = np.array([stage.backend.time_pair().device_ns])
    assert stage.backend.emitted_amplitude(now_ns) == [0.0]
    open_trials = len(stage.of("trial-start")) - len(stage.of("trial-end"))
    assert open_trials == 0


def test_an_abort_before_the_start_command_emits_nothing_and_is_not_charged(stage: Stage) -> None:
    stage.listeners.append(lambda e: stage.interrupts.request_abort() if e.event == "trial-start" else None)
    with pytest.raises(StoppedByPerson):
        stage.run()
    ends = [event for event in stage.log.events if isinstance(event, TrialEnd)]
    assert [e.started for e in ends] == [False]
    assert stage.backend.emissions == []


def test_what_an_abort_makes_fail_is_no_fault_of_a_device(stage: Stage) -> None:
    """The stop thread's halt makes the main thread's call fail; nobody is asked to mend it."""

    def halt_and_lose(event: Event) -> None:
        if isinstance(event, StimulusStart):
            stage.interrupts.request_abort("the terminal was closed")
            stage.backend.faults.lost_devices = 1

    stage.listeners.append(halt_and_lose)
    stage.operator.go_on = 5
    with pytest.raises(StoppedByPerson):
        stage.run()
    assert (end(stage).status, end(stage).why) == ("aborted", "the terminal was closed")
    assert stage.of("pause") == []


def test_devices_lost_in_a_long_burst_are_noticed_within_0_3_s(stage: Stage) -> None:
    timing = stage.protocol.timing.model_copy(update={"response_window_s": LONG_S})
    stage.protocol = stage.protocol.model_copy(update={"timing": timing})
    stage.limits = Limits(
        largest_drive=1, longest_burst_s=LONG_S, largest_duty=1, session_exposure_s=99, daily_exposure_s=99
    )
    long = [
        trial.model_copy(update={"stimulus": trial.stimulus.model_copy(update={"duration_s": LONG_S})})
        for trial in stage.plan.trials
    ]
    stage.plan = stage.plan.model_copy(update={"trials": tuple(long)})
    lost_s = 3.0 + PAUSE_S + 1.0
    stage.backend.faults.lost_devices, stage.backend.faults.lost_from_s = 1, lost_s
    with pytest.raises(Exception, match="devices answer"):
        stage.run()
    interrupted = next(event for event in stage.log.events if isinstance(event, TrialEnd))
    assert lost_s <= interrupted.t_s <= lost_s + 0.3


@pytest.mark.parametrize(
    ("signals", "why"),
    [
        ((signal.SIGTERM,), "ended by SIGTERM"),
        ((signal.SIGHUP,), "the terminal was closed"),
        ((signal.SIGQUIT,), "ended by SIGQUIT"),
        ((signal.SIGINT, signal.SIGINT), "aborted by the experimenter"),
    ],
)
def test_signals_abort_while_the_main_thread_is_held_up(
    signals: tuple[signal.Signals, ...], why: str
) -> None:
    """The main thread's handlers do nothing; the array is halted in another thread, while this one waits."""
    clock = VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))
    backend = VirtualBackend(clock)
    limits = Limits(largest_drive=1, longest_burst_s=2, largest_duty=1, session_exposure_s=1000)
    units = [UnitPose("unit 1", np.eye(3), np.zeros(3))]
    array = PhasedArray(units, backend, limits, clock, speed_of_sound_m_s=343.0)
    array.open()
    interrupts = Interrupts()
    halted = threading.Event()
    by: list[str] = []

    def halt() -> None:
        array.halt()
        by.append(threading.current_thread().name)
        halted.set()

    interrupts.on_abort = halt
    with interrupts.on_signals(in_a_thread=True):
        sender = threading.Thread(target=_send, args=(signals, interrupts))
        sender.start()
        assert halted.wait(30)
        sender.join()
    assert by == ["stops"]
    assert bool(backend.halted)
    assert (interrupts.abort_requested, interrupts.why) == (True, why)
    with pytest.raises(StoppedByPerson, match=why):
        interrupts.obey()


def _send(signals: tuple[signal.Signals, ...], interrupts: Interrupts) -> None:
    for number in signals:
        os.kill(os.getpid(), number)
        while not interrupts.pause_requested:  # or two of a kind might come as one
            time.sleep(0.001)


def test_handlers_are_put_back(stage: Stage) -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT)]
    for in_a_thread in (True, False):
        with stage.interrupts.on_signals(in_a_thread=in_a_thread):
            assert signal.getsignal(signal.SIGTERM) not in before
        now = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT)]
        assert now == before
    assert signal.set_wakeup_fd(-1) == -1


def test_one_ctrl_c_only_pauses_and_an_answered_pause_is_forgotten_but_never_an_abort() -> None:
    interrupts = Interrupts()
    halts: list[int] = []
    interrupts.on_abort = lambda: halts.append(1)
    interrupts.request()
    assert (interrupts.pause_requested, interrupts.abort_requested, halts) == (True, False, [])
    interrupts.clear()
    interrupts.request()
    interrupts.request()
    assert (interrupts.abort_requested, halts) == (True, [1])
    interrupts.clear()
    assert interrupts.pause_requested
