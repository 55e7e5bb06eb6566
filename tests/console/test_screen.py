"""What the experimenter sees, and what must stay hidden."""

import io
from datetime import UTC, datetime

import pytest
from rich.console import Console

from autd_trials.cli import main
from autd_trials.clock import VirtualClock
from autd_trials.console.lines import Lines
from autd_trials.console.screen import Screen, render
from autd_trials.console.status import Status, fold
from autd_trials.protocol.plan import Plan
from autd_trials.records.log import read_log
from autd_trials.session.events import (
    Event,
    Fault,
    Pause,
    ResponseMade,
    SessionStart,
    StimulusStart,
    TrialEnd,
)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> tuple[Event, ...]:
    """The events of a simulated session with catch trials."""
    data = tmp_path_factory.mktemp("data")
    assert main(["run", "chest-catch", "--simulate", "1", "--data", str(data)]) == 0
    return read_log(next(data.glob("*/sourcedata/*/*/*.jsonl"))).events


def until(log: tuple[Event, ...], kind: type[Event], count: int = 1) -> Status:
    """Return the status after the n-th event of a kind."""
    status = Status()
    for event in log:
        status = fold(status, event)
        count -= isinstance(event, kind)
        if count == 0:
            return status
    raise AssertionError("there are not so many")


def shown(status: Status, t_s: float, *, unblind: bool = False) -> str:
    console = Console(file=io.StringIO(), width=110, record=True)
    console.print(render(status, t_s, unblind=unblind))
    return console.export_text()


def onset_t_s(status: Status) -> float:
    assert status.onset_t_s is not None
    return status.onset_t_s


def test_before_the_start_it_says_what_it_waits_for() -> None:
    assert "opening devices" in shown(Status(), 0.0)


def test_the_banner_says_that_nothing_is_emitted_or_that_it_is(log: tuple[Event, ...]) -> None:
    status = until(log, StimulusStart)
    assert "EMULATED: no ultrasound is emitted" in shown(status, 1.0)
    start = log[0]
    assert isinstance(start, SessionStart)
    real = {**start.devices, "array": {**start.devices["array"], "emulated": False}}
    live = fold(Status(), start.model_copy(update={"devices": real}))
    assert "LIVE: ultrasound is emitted" in shown(live, 1.0)


def test_the_frequency_is_hidden_unless_asked_for(log: tuple[Event, ...]) -> None:
    for number in range(1, 20):
        status = until(log, StimulusStart, number)
        text = shown(status, onset_t_s(status) + 0.1)
        assert "hidden (--unblind shows it)" in text
        assert " Hz" not in text
        assert "modulation_hz" not in text
        assert "catch:" not in text
        assert "stimulus:" not in text
        assert f"{status.trial_type}:" in shown(status, onset_t_s(status) + 0.1, unblind=True)


def test_phases_follow_the_hardware_onset(log: tuple[Event, ...]) -> None:
    status = until(log, StimulusStart)
    onset = onset_t_s(status)
    phases = [status.phase_at(onset + after_s) for after_s in (-0.01, 0.5, 1.5, 3.0)]
    assert phases == ["ready", "stimulus", "response window", "pause between"]
    assert " stimulus " in shown(status, onset + 0.5)


def test_within_a_block_the_exposure_does_not_tell_what_was_presented(log: tuple[Event, ...]) -> None:
    statuses = [until(log, StimulusStart, count) for count in (3, 12)]
    assert statuses[1].exposure_s > statuses[0].exposure_s > 0
    for status in statuses:
        assert "0.0 of" in shown(status, onset_t_s(status))
        assert f"{status.exposure_s:.1f} of" in shown(status, onset_t_s(status), unblind=True)
    ended = until(log, TrialEnd, 36)
    assert ended.block_ended
    assert f"{ended.exposure_s:.1f} of" in shown(ended, 0.0)


@pytest.mark.parametrize("stopped_after", [20, 60])
def test_a_session_taken_up_again_is_shown_as_it_stands(log: tuple[Event, ...], stopped_after: int) -> None:
    clock = VirtualClock(datetime(2026, 11, 22, 9, 0, tzinfo=UTC))
    console = Console(file=io.StringIO(), width=110)
    screen = Screen(console, clock, unblind=False)
    screen.catch_up(log[:stopped_after])
    for event in log[stopped_after:-1]:
        screen(event)
    whole = Status()
    for event in log[:-1]:
        whole = fold(whole, event)
    assert screen._status == whole
    output = io.StringIO()
    lines = Lines(output, blocks=False)
    lines.catch_up(log[:stopped_after])
    assert output.getvalue() == ""
    for event in log[stopped_after:]:
        lines(event)
    before = sum(isinstance(event, TrialEnd) for event in log[:stopped_after])
    assert f"success, {72 - before} of {72 - before} trials in this run" in output.getvalue()


def test_block_trial_time_left_exposure_and_health_are_shown(log: tuple[Event, ...]) -> None:
    status = until(log, TrialEnd, 10)
    text = shown(status, onset_t_s(status) + 4.0)
    assert "1 of 2  inner" in text
    assert "10 of 72 complete" in text
    assert "time left  0:0" in text
    assert f"of {status.exposure_budget_s:g} s at full drive" in text
    assert "18 of 18 ready, seen " in text
    assert "0 underruns" in text
    assert "ms" in text


def test_a_response_is_shown_with_its_time(log: tuple[Event, ...]) -> None:
    status = until(log, ResponseMade)
    assert "felt, 0." in shown(status, onset_t_s(status) + 1)


def test_rates_stay_hidden_until_the_block_ends(log: tuple[Event, ...]) -> None:
    assert "block's result" not in shown(until(log, TrialEnd, 35), 0.0)
    stimuli = {t.trial for t in _plan(log).trials[:36] if t.trial_type == "stimulus"}
    felt = sum(isinstance(e, TrialEnd) and e.response == "felt" and e.trial in stimuli for e in log)
    assert f"felt {felt} of {len(stimuli)}" in shown(until(log, TrialEnd, 36), 0.0)


def test_false_alarms_are_counted_over_catch_trials(log: tuple[Event, ...]) -> None:
    catch = {t.trial for t in _plan(log).trials if t.trial_type == "catch"}
    expected = sum(isinstance(e, TrialEnd) and e.response == "felt" and e.trial in catch for e in log)
    assert until(log, TrialEnd, 72).false_alarms == expected


def test_faults_and_pauses_are_shown(log: tuple[Event, ...]) -> None:
    status = until(log, TrialEnd)
    lost = Fault(t_s=9, utc="", device="masker", what="lost: unplugged", happened_t_s=9)
    text = shown(fold(fold(status, lost), Pause(t_s=9, utc="", reason="[the] masker")), 9.0)
    assert "lost: unplugged" in text
    assert "[the] masker" in text


def test_the_screen_takes_every_event_and_leaves_what_was_asked(log: tuple[Event, ...]) -> None:
    """A question that was shown while the screen was hidden is still there afterwards."""
    output = io.StringIO()
    console = Console(file=output, width=110, height=50, force_terminal=True)
    screen = Screen(console, VirtualClock(datetime(2026, 11, 24, tzinfo=UTC)), unblind=False)
    with screen.shown():
        for event in log[:5]:
            screen(event)
        with screen.hidden():
            before = len(output.getvalue())
            console.print("Is everything as it says?")
        after = output.getvalue()[before:]
    assert "\x1b[1A" not in after.split("EMULATED")[0], (
        "nothing above is erased before the screen is drawn anew"
    )


def test_lines_tell_sessions_without_a_terminal(log: tuple[Event, ...]) -> None:
    stream = io.StringIO()
    lines = Lines(stream, blocks=True)
    for event in log:
        lines(event)
    text = stream.getvalue()
    assert "block 1" in text
    assert "72 of 72 trials" in text


def test_a_simulated_participant_is_called_so(log: tuple[Event, ...]) -> None:
    assert "SIMULATED PARTICIPANT" in shown(until(log, SessionStart), 0.0)


def _plan(log: tuple[Event, ...]) -> Plan:
    start = log[0]
    assert isinstance(start, SessionStart)
    return start.plan
