"""What the experimenter sees, and what must stay hidden."""

import io
from datetime import UTC, datetime

import pytest
from rich.console import Console

from autd_trials.cli import main
from autd_trials.clock import VirtualClock
from autd_trials.console.controls import controls_line
from autd_trials.console.lines import Lines
from autd_trials.console.phase import phase_at
from autd_trials.console.screen import Screen, render
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
from autd_trials.session.standing import Standing, standing

UTC_TEXT = "2026-11-22T09:00:00+00:00"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> tuple[Event, ...]:
    """The events of a simulated session with catch trials."""
    data = tmp_path_factory.mktemp("data")
    assert main(["run", "chest-catch", "--simulate", "1", "--data", str(data)]) == 0
    return read_log(next(data.glob("*/sourcedata/*/*/*.jsonl"))).events


def until(log: tuple[Event, ...], kind: type[Event], count: int = 1) -> Standing:
    """Return where the session stands after the n-th event of a kind."""
    for number, event in enumerate(log, start=1):
        count -= isinstance(event, kind)
        if count == 0:
            return standing(log[:number])
    raise AssertionError("there are not so many")


def shown(now: Standing, t_s: float, *, unblind: bool = False) -> str:
    console = Console(file=io.StringIO(), width=110, record=True)
    console.print(render(now, t_s, unblind=unblind, footer="a: ABORT"))
    return console.export_text()


def onset_t_s(now: Standing) -> float:
    assert now.trial is not None
    assert now.trial.onset_t_s is not None
    return now.trial.onset_t_s


def test_before_the_start_it_says_what_it_waits_for() -> None:
    console = Console(file=io.StringIO(), width=110, record=True)
    screen = Screen(console, VirtualClock(datetime(2026, 11, 22, tzinfo=UTC)), unblind=False, footer="")
    console.print(screen._render())
    assert "opening devices" in console.export_text()


def test_the_banner_says_that_nothing_is_emitted_or_that_it_is(log: tuple[Event, ...]) -> None:
    now = until(log, StimulusStart)
    assert "EMULATED: no ultrasound is emitted" in shown(now, 1.0)
    start = log[0]
    assert isinstance(start, SessionStart)
    array = start.devices.array.model_copy(update={"emulated": False})
    real = start.devices.model_copy(update={"array": array})
    live = standing([start.model_copy(update={"devices": real})])
    assert "LIVE: ultrasound is emitted" in shown(live, 1.0)


def test_the_frequency_is_hidden_unless_asked_for(log: tuple[Event, ...]) -> None:
    for number in range(1, 20):
        now = until(log, StimulusStart, number)
        text = shown(now, onset_t_s(now) + 0.1)
        assert "hidden (--unblind shows it)" in text
        assert " Hz" not in text
        assert "modulation_hz" not in text
        assert "catch:" not in text
        assert "stimulus:" not in text
        assert now.trial is not None
        assert f"{now.trial.trial_type}:" in shown(now, onset_t_s(now) + 0.1, unblind=True)


def test_phases_follow_the_hardware_onset(log: tuple[Event, ...]) -> None:
    now = until(log, StimulusStart)
    onset = onset_t_s(now)
    phases = [phase_at(now, onset + after_s) for after_s in (-0.01, 0.5, 1.5, 3.0)]
    assert phases == ["ready", "stimulus", "response window", "pause between"]
    assert " stimulus " in shown(now, onset + 0.5)


def test_within_a_block_the_exposure_does_not_tell_what_was_presented(log: tuple[Event, ...]) -> None:
    stands = [until(log, StimulusStart, count) for count in (3, 12)]
    assert stands[1].exposure_s > stands[0].exposure_s > 0
    for now in stands:
        assert "0.0 of" in shown(now, onset_t_s(now))
        assert f"{now.exposure_s:.1f} of" in shown(now, onset_t_s(now), unblind=True)
    ended = until(log, TrialEnd, 36)
    assert ended.block is not None
    assert ended.block.ended
    assert f"{ended.exposure_s:.1f} of" in shown(ended, 0.0)


@pytest.mark.parametrize("stopped_after", [20, 60])
def test_a_session_taken_up_again_is_shown_as_it_stands(log: tuple[Event, ...], stopped_after: int) -> None:
    clock = VirtualClock(datetime(2026, 11, 22, 9, 0, tzinfo=UTC))
    console = Console(file=io.StringIO(), width=110)
    screen = Screen(console, clock, unblind=False, footer="")
    screen.catch_up(log[:stopped_after])
    for event in log[stopped_after:-1]:
        screen(event)
    assert screen._standing == standing(log[:-1])
    output = io.StringIO()
    lines = Lines(output, blocks=False)
    lines.catch_up(log[:stopped_after])
    assert output.getvalue() == ""
    for event in log[stopped_after:]:
        lines(event)
    before = sum(isinstance(event, TrialEnd) for event in log[:stopped_after])
    assert f"success, {72 - before} of {72 - before} trials in this run" in output.getvalue()


def test_block_trial_time_left_exposure_and_health_are_shown(log: tuple[Event, ...]) -> None:
    now = until(log, TrialEnd, 10)
    text = shown(now, onset_t_s(now) + 4.0)
    assert "1 of 2  inner" in text
    assert "10 of 72 complete" in text
    assert "time left  0:0" in text
    assert f"of {now.limits.session_exposure_s:g} s at full drive" in text
    assert "18 of 18 ready, seen " in text
    assert "0 underruns" in text
    assert "ms" in text


def test_a_response_is_shown_with_its_time(log: tuple[Event, ...]) -> None:
    now = until(log, ResponseMade)
    assert "felt, 0." in shown(now, onset_t_s(now) + 1)


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
    now = until(log, TrialEnd)
    now.take(Fault(t_s=9, utc=UTC_TEXT, device="masker", what="lost: unplugged", happened_t_s=9))
    now.take(Pause(t_s=9, utc=UTC_TEXT, reason="[the] masker"))
    text = shown(now, 9.0)
    assert "lost: unplugged" in text
    assert "[the] masker" in text


def test_the_screen_takes_every_event_and_leaves_what_was_asked(log: tuple[Event, ...]) -> None:
    """A question that was shown while the screen was hidden is still there afterwards."""
    output = io.StringIO()
    console = Console(file=output, width=110, height=50, force_terminal=True)
    screen = Screen(console, VirtualClock(datetime(2026, 11, 24, tzinfo=UTC)), unblind=False, footer="")
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


def test_the_budget_shown_is_the_stricter_of_rig_and_protocol(log: tuple[Event, ...]) -> None:
    start = log[0]
    assert isinstance(start, SessionStart)
    assert start.limits is not None
    assert start.limits.session_exposure_s == start.protocol.safety.session_exposure_s == 75
    stricter = start.limits.model_copy(update={"session_exposure_s": 5.0})
    now = standing([start.model_copy(update={"limits": stricter})])
    assert "of 5 s at full drive" in shown(now, 0.0)


@pytest.mark.parametrize(
    ("answers", "keys", "attended", "expected", "absent"),
    [
        ("space: hand raised", True, True, ["space: hand", "p: pause", "n: pause", "a: ABORT"], ["stop"]),
        ("answers: box on COM3", True, True, ["box on COM3", "a: ABORT"], ["space"]),
        ("space: hand raised", True, False, ["p: stop after", "a: ABORT", "Ctrl-C: stop"], ["n: pause"]),
        (None, False, False, ["Ctrl-C: stop after this trial, again: ABORT"], ["a: ", "p: ", "space"]),
    ],
)
def test_no_control_is_shown_that_does_nothing(
    answers: str | None, keys: bool, attended: bool, expected: list[str], absent: list[str]
) -> None:
    text = controls_line(answers=answers, keys=keys, attended=attended)
    assert all(words in text for words in expected)
    assert not any(words in text for words in absent)
