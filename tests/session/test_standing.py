"""One fold over the events, whoever asks: what is done, what was charged, how it ended."""

from datetime import datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.adaptive.answers import Answer
from autd_trials.protocol.method import Range, Staircase
from autd_trials.session.events import Event, StimulusStart, TrialEnd, TrialStart
from autd_trials.session.standing import Standing, standing
from autd_trials.stimulus import total_exposure_s
from autd_trials.testing.script import SessionScript
from autd_trials.testing.studies import make_protocol


def where(script: SessionScript) -> Standing:
    return standing(script.events)


def test_a_session_that_only_started_has_everything_to_do() -> None:
    script = SessionScript()
    found = where(script)
    assert not found.finished
    assert found.complete == set()
    assert found.remaining == script.plan.trials
    assert found.open_trial is None
    assert found.exposure_s == 0


def test_a_crash_in_a_trial_leaves_it_open_and_to_do() -> None:
    script = SessionScript().block(1).trials([1, 2]).begin(3).stimulate(3)
    found = where(script)
    assert found.status == "interrupted"
    assert found.complete == {1, 2}
    assert found.open_trial == (3, 1)
    assert found.attempts == {1: 1, 2: 1, 3: 1}
    assert [trial.trial for trial in found.remaining] == list(range(3, 15))
    assert found.exposure_s == 3.0
    assert found.last_t_s == script.events[-1].t_s
    assert found.last_utc == script.events[-1].utc


def test_attempts_go_on_counting_after_a_resume() -> None:
    script = (
        SessionScript().begin(1).stimulate(1).interrupt(1).resume().begin(1, 2).interrupt(1, 2).trial(1, 3)
    )
    found = where(script)
    assert found.attempts == {1: 3}
    assert found.attempts_interrupted == 2
    assert found.complete == {1}
    assert found.open_trial is None


def test_a_catch_trial_uses_no_exposure() -> None:
    script = SessionScript()
    catch = next(trial.trial for trial in script.plan.trials if trial.trial_type == "catch")
    assert where(script.trial(catch)).exposure_s == 0


@pytest.mark.parametrize("status", ["success", "aborted", "failed"])
def test_the_end_says_how_it_ended(status: str) -> None:
    found = where(SessionScript().trial(1).end(status, "because"))
    assert found.finished
    assert (found.status, found.why) == (status, "because")


def test_a_failed_session_that_was_taken_up_again_is_not_finished() -> None:
    script = SessionScript().trial(1).end("failed", "array lost").resume().trial(2)
    assert not where(script).finished
    assert where(script.end()).status == "success"


def test_lost_lines_do_not_make_an_attempt_count_twice() -> None:
    script = SessionScript().begin(1).stimulate(1).interrupt(1).trial(1, 2)
    del script.events[1]
    found = where(script)
    assert found.attempts == {1: 2}
    assert found.complete == {1}


def test_an_end_that_was_taken_up_again_and_crashed_is_an_interruption() -> None:
    script = SessionScript().block(1).trial(1).end("aborted", "stopped").resume(after_crash=False)
    assert where(script).status == "interrupted"
    assert where(script.trial(2).begin(3)).status == "interrupted"


def test_a_trial_that_began_is_charged_in_full_also_where_its_stimulus_was_never_logged() -> None:
    assert where(SessionScript().begin(1)).exposure_s == 1.0
    assert where(SessionScript().begin(1).stimulate(1)).exposure_s == 1.0
    assert where(SessionScript().stimulate(1)).exposure_s == 1.0, "its first line is damaged"


def test_only_an_attempt_without_a_start_command_is_not_charged() -> None:
    script = SessionScript().begin(1)
    ended = TrialEnd(
        t_s=script.t_s,
        utc=script.events[-1].utc,
        trial=1,
        attempt=1,
        status="interrupted",
        response=None,
        response_time_s=None,
        started=False,
    )
    assert standing([*script.events, ended]).exposure_s == 0
    assert standing([*script.events, ended]).charges == {}
    for started in (True, None):
        assert standing([*script.events, ended.model_copy(update={"started": started})]).exposure_s == 1.0


def _made_up(event: Event) -> Event:
    """Return the event with numbers that nobody should trust."""
    if isinstance(event, StimulusStart):
        return event.model_copy(update={"exposure_s": -100.0, "drive": 0.0, "duration_s": 0.001})
    if isinstance(event, TrialStart):
        return event.model_copy(update={"conditions": {**event.conditions, "drive": -5.0, "duration_s": 0.0}})
    return event


@given(st.lists(st.sampled_from(range(1, 15)), max_size=20), st.integers(0, 2**32))
def test_the_exposure_is_that_of_the_plan_whatever_the_lines_say(trials: list[int], seed: int) -> None:
    script = SessionScript().block(1)
    for number in trials:
        attempt = where(script).attempts.get(number, 0) + 1
        script.begin(number, attempt)
        if (seed := seed * 7 % 31) % 3:
            script.stimulate(number, attempt)
        script.finish(number, attempt)
    stimuli = [script.plan.trials[number - 1].stimulus for number in trials]
    for events in (script.events, list(map(_made_up, script.events))):
        assert standing(events).exposure_s == pytest.approx(total_exposure_s(stimuli))


def test_an_adaptive_level_is_charged_and_an_unknown_one_is_charged_as_the_largest() -> None:
    method = Staircase(
        kind="staircase", varies="drive", range=Range(smallest=0.25, largest=0.5, levels=3), start=0.5
    )
    script = SessionScript(protocol=make_protocol(method=method))
    script.plan = script.plan.model_copy(
        update={
            "trials": tuple(
                trial.model_copy(
                    update={
                        "conditions": {**trial.conditions, "drive": None},
                        "stimulus": trial.stimulus.model_copy(update={"drive": 0.5}),
                    }
                )
                for trial in script.plan.trials
            )
        }
    )
    script.events[0] = script.events[0].model_copy(update={"plan": script.plan})
    script.trial(1)
    start = next(event for event in script.events if isinstance(event, TrialStart))
    at = script.events.index(start)
    for level, exposure_s in ((0.25, 0.0625), (0.5, 0.25), (-0.25, 0.25), (0.1, 0.25), (None, 0.25)):
        conditions = {**start.conditions, "drive": level}
        script.events[at] = start.model_copy(update={"conditions": conditions})
        assert where(script).exposure_s == exposure_s
        if level == 0.25:
            assert where(script).answers == {1: Answer(0.25, felt=True)}


def test_bursts_are_known_by_the_wall_clock_and_an_unlogged_one_as_late_as_it_may_have_been() -> None:
    script = SessionScript().begin(1).stimulate(1)
    start = next(e for e in script.events if isinstance(e, StimulusStart))
    charge = where(script).charges[1, 1]
    assert charge.onset == datetime.fromisoformat(start.utc) + timedelta(seconds=0.035)
    assert charge.end - charge.onset == timedelta(seconds=1)
    unlogged = where(SessionScript().begin(1)).charges[1, 1]
    assert unlogged.onset > datetime.fromisoformat(script.events[1].utc) + timedelta(seconds=1)


def test_the_limits_of_version_1_are_the_stricter_of_rig_and_protocol() -> None:
    script = SessionScript()
    assert where(script).limits.session_exposure_s == 100.0
    rig = {"array": {"limits": {"session_exposure_s": 5.0, "largest_duty": 0.9, "largest_ear_level_db": 110}}}
    script.events[0] = script.events[0].model_copy(update={"rig": rig, "limits": None})
    assert where(script).limits.session_exposure_s == 5.0
    assert where(script).limits.largest_duty == 0.5
