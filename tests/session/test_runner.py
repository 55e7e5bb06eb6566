"""The runner: order, times, pauses, faults, and that silence comes before everything else."""

from itertools import pairwise

import pytest

from autd_trials.errors import DeviceError, StoppedByPerson, UnsafeError
from autd_trials.session.events import (
    Event,
    Fault,
    Pause,
    ResponseMade,
    SessionEnd,
    StimulusStart,
    TrialEnd,
)
from autd_trials.session.runner import Done
from autd_trials.testing.stage import Stage
from tests.session.conftest import PAUSE_S, WINDOW_S


def _complete(events: list[Event]) -> list[int]:
    return [event.trial for event in events if isinstance(event, TrialEnd) and event.status == "complete"]


def _end(events: list[Event]) -> SessionEnd:
    assert isinstance(events[-1], SessionEnd)
    return events[-1]


def _silent_at(stage: Stage, host_s: float) -> bool:
    """Whether nothing that the backend keeps would be emitted at a host time."""
    device_ns = stage.backend.time_pair().device_ns_at(host_s)
    return not any(
        emission.onset_ns <= device_ns < (emission.aborted_ns or emission.ends_ns)
        for emission in stage.backend.emissions
        if emission.burst.intensity > 0
    )


def test_all_trials_run_in_the_planned_order(stage: Stage) -> None:
    events = stage.run()
    assert _complete(events) == [1, 2, 3, 4, 5, 6]
    assert _end(events).status == "success"
    assert stage.operator.asked == [stage.protocol.instructions, "block 1", "block 2"]


def test_onsets_are_where_the_plan_has_them(stage: Stage) -> None:
    events = stage.run()
    onsets = [event for event in events if isinstance(event, StimulusStart)]
    for before, after in pairwise(onsets[:3]):
        # The array rounds up to its grid of 0.25 ms.
        assert after.onset_t_s - before.onset_t_s == pytest.approx(WINDOW_S + PAUSE_S, abs=0.0003)
    for onset in onsets:
        assert 0 <= onset.onset_t_s - onset.planned_onset_t_s <= 0.00025
        assert onset.margin_s >= 0.01


def test_the_masker_plays_two_seconds_before_the_first_trial(stage: Stage) -> None:
    timing = stage.protocol.timing.model_copy(update={"lead_in_s": 0.0})
    stage.protocol = stage.protocol.model_copy(update={"timing": timing})
    events = stage.run()
    first = next(event for event in events if isinstance(event, StimulusStart))
    assert first.onset_t_s == pytest.approx(2.0 + PAUSE_S, abs=0.001)


def test_a_catch_trial_does_everything_and_emits_nothing(stage: Stage) -> None:
    events = stage.run()
    assert len([event for event in events if isinstance(event, StimulusStart)]) == 6
    assert [emission.burst.intensity for emission in stage.backend.emissions] == [255, 0, 255, 255, 0, 255]


@pytest.mark.parametrize(
    ("after_s", "phase", "response"),
    [
        (-0.01, "before_onset", "not_felt"),
        (0.3, "window", "felt"),
        (WINDOW_S, "window", "felt"),
        (WINDOW_S + 0.5, "late", "not_felt"),
    ],
)
def test_a_press_is_kept_with_its_phase_and_response_time(
    stage: Stage, after_s: float, phase: str, response: str
) -> None:
    stage.script.press_after_s = (after_s,)
    events = stage.run()
    presses = [event for event in events if isinstance(event, ResponseMade)]
    assert [press.phase for press in presses[:5]] == [phase] * 5
    assert presses[0].response_time_s == pytest.approx(after_s, abs=1e-5)
    assert {event.response for event in events if isinstance(event, TrialEnd)} == {response}


def test_repeated_presses_are_all_kept_and_the_first_counts(stage: Stage) -> None:
    stage.script.press_after_s = (0.4, 0.5, 0.6)
    events = stage.run()
    assert len([event for event in events if isinstance(event, ResponseMade)]) == 18
    ends = [event for event in events if isinstance(event, TrialEnd)]
    assert all(end.response_time_s == pytest.approx(0.4, abs=1e-5) for end in ends)


def test_a_pause_comes_between_trials_and_the_session_goes_on(stage: Stage) -> None:
    stage.operator.go_on = 1
    stage.operator.notes = ("the participant sneezed",)

    def ask(event: Event) -> None:
        if isinstance(event, StimulusStart) and event.trial == 2:
            stage.interrupts.request()

    stage.listeners.append(ask)
    events = stage.run()
    assert _complete(events) == [1, 2, 3, 4, 5, 6]
    kinds = [event.event for event in events]
    at = kinds.index("pause")
    assert kinds[at - 1 : at + 3] == ["trial-end", "pause", "note", "resume"]


def test_stopping_in_a_pause_aborts_and_says_so(stage: Stage) -> None:
    stage.listeners.append(
        lambda event: stage.interrupts.request_pause() if event.event == "stimulus" else None
    )
    with pytest.raises(StoppedByPerson):
        stage.run()
    assert _end(stage.log.events).status == "aborted"
    assert _complete(stage.log.events) == [1]


def test_an_abort_in_mid_stimulus_silences_before_it_logs(stage: Stage) -> None:
    silent_when_logged: list[bool] = []

    def ask(event: Event) -> None:
        if isinstance(event, StimulusStart):
            stage.interrupts.request()
        if event.event in ("trial-end", "session-end"):
            silent_when_logged.append(_silent_at(stage, stage.clock.now_s()))

    # A press half-way makes the watch look again in mid-stimulus, and there is the second Ctrl-C.
    stage.script.press_after_s = (0.5,)
    stage.listeners.append(ask)
    stage.log.on_append = lambda event: stage.interrupts.request() if event.event == "response" else None
    with pytest.raises(StoppedByPerson):
        stage.run()
    assert silent_when_logged == [True, True]
    emission = stage.backend.emissions[-1]
    assert emission.aborted_ns is not None
    assert emission.aborted_ns < emission.onset_ns + 600_000_000
    assert _end(stage.log.events).status == "aborted"


def test_a_lost_responder_pauses_and_the_trial_runs_again(stage: Stage) -> None:
    stage.operator.go_on = 1
    stage.script.lost_at_s = 3.0 + PAUSE_S + 0.5
    events = stage.run()
    assert _complete(events) == [1, 2, 3, 4, 5, 6]
    first = [event for event in events if isinstance(event, TrialEnd) and event.trial == 1]
    assert [(end.attempt, end.status) for end in first] == [(1, "interrupted"), (2, "complete")]
    assert [event.device for event in events if isinstance(event, Fault)] == ["responder"]


def test_a_lost_device_that_nobody_mends_fails_the_session(stage: Stage) -> None:
    stage.backend.faults.lost_devices = 1
    stage.backend.faults.lost_from_s = 3.0 + PAUSE_S + 0.5
    with pytest.raises(DeviceError):
        stage.run()
    assert _end(stage.log.events).status == "failed"
    assert _complete(stage.log.events) == []
    assert any(isinstance(event, Pause) for event in stage.log.events)


def test_a_latched_failsafe_ends_the_trial(stage: Stage) -> None:
    stage.backend.faults.failsafe_from_s = 3.0 + PAUSE_S + 0.5
    with pytest.raises(DeviceError):
        stage.run()
    ends = [event for event in stage.log.events if isinstance(event, TrialEnd)]
    assert [end.status for end in ends] == ["interrupted"]


def test_lost_sound_pauses_and_an_underrun_is_only_logged(stage: Stage) -> None:
    stage.operator.go_on = 1

    def harm(event: Event) -> None:
        if isinstance(event, StimulusStart) and event.attempt == 1:
            if event.trial == 2:
                stage.masker.inject("underrun", "a gap")
            if event.trial == 4:
                stage.masker.inject("lost", "unplugged")

    stage.listeners.append(harm)
    events = stage.run()
    assert _complete(events) == [1, 2, 3, 4, 5, 6]
    assert [event.device for event in events if isinstance(event, Fault)] == ["masker", "masker"]
    underruns = {e.trial: e.underruns for e in events if isinstance(e, TrialEnd) and e.status == "complete"}
    assert underruns == {1: 0, 2: 1, 3: 0, 4: 0, 5: 0, 6: 0}


def test_a_full_disk_silences_the_array_and_stops(stage: Stage) -> None:
    stage.log.full_after = 5
    with pytest.raises(DeviceError, match="no space left"):
        stage.run()
    assert all(e.aborted_ns is not None or e.ends_ns for e in stage.backend.emissions)
    assert _silent_at(stage, stage.clock.now_s())


def test_a_resumed_session_runs_only_what_is_left(stage: Stage) -> None:
    events = stage.run(Done(complete=frozenset({1, 2, 3, 4}), attempts={5: 1}))
    assert _complete(events) == [5, 6]
    assert [event.attempt for event in events if isinstance(event, TrialEnd)] == [2, 1]
    assert stage.operator.asked[1:] == ["block 2"]


def test_what_the_limits_forbid_is_refused_before_anything_is_asked_or_recorded(stage: Stage) -> None:
    long = [
        trial.model_copy(update={"stimulus": trial.stimulus.model_copy(update={"duration_s": 3.0})})
        for trial in stage.plan.trials
    ]
    stage.plan = stage.plan.model_copy(update={"trials": tuple(long)})
    with pytest.raises(UnsafeError):
        stage.run()
    assert stage.backend.emissions == []
    assert stage.log.events == []
    assert stage.operator.asked == []


def test_a_broken_listener_is_dropped_and_the_session_goes_on(stage: Stage) -> None:
    def broken(_event: Event) -> None:
        raise RuntimeError("the screen is gone")

    stage.listeners.append(broken)
    events = stage.run()
    assert _complete(events) == [1, 2, 3, 4, 5, 6]
    assert [event.device for event in events if isinstance(event, Fault)] == ["listener"]


def test_times_never_go_back(stage: Stage) -> None:
    stage.script.press_after_s = (0.3, 2.7)
    times = [event.t_s for event in stage.run()]
    assert times == sorted(times)
