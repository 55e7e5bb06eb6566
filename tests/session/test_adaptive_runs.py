"""Which level each trial of an adaptive session gets."""

from autd_trials.adaptive.answers import Answer
from autd_trials.protocol.method import Range, Staircase
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Factor, Factors
from autd_trials.session.adaptive_runs import AdaptiveRuns, possible_stimuli
from autd_trials.session.events import StimulusStart, TrialStart
from autd_trials.session.runner import Done
from autd_trials.testing.stage import Stage

METHOD = Staircase(
    kind="staircase", varies="drive", range=Range(smallest=0.125, largest=1.0, levels=4), start=1.0
)


def adaptive(stage: Stage) -> Stage:
    factors = Factors(
        within_block={"modulation_hz": Factor(levels=(50.0, 100.0))},
        between_blocks={"clothing": Factor(levels=("inner", "inner_outer"))},
    )
    changes = {"method": METHOD, "factors": factors, "repetitions": 4}
    stage.protocol = stage.protocol.model_copy(update=changes)
    stage.plan = make_plan(stage.protocol, place=1, session=1, seed=1)
    return stage


def drives(stage: Stage) -> dict[tuple[int, object], list[float]]:
    """Return the drives in each block at each frequency, in order."""
    starts = {event.trial: event for event in stage.log.events if isinstance(event, TrialStart)}
    found: dict[tuple[int, object], list[float]] = {}
    for event in stage.log.events:
        if isinstance(event, StimulusStart) and starts[event.trial].trial_type == "stimulus":
            start = starts[event.trial]
            assert start.conditions["drive"] == event.drive
            found.setdefault((start.block, start.conditions["modulation_hz"]), []).append(event.drive)
    return found


def test_every_condition_of_every_block_has_a_track_of_its_own(stage: Stage) -> None:
    adaptive(stage).script.press_after_s = (0.3,)  # felt every time
    stage.run()
    assert drives(stage) == {(block, hz): [1.0, 0.5, 0.25, 0.125] for block in (1, 2) for hz in (50.0, 100.0)}


def test_what_is_not_felt_leads_up_and_catch_trials_lead_nowhere(stage: Stage) -> None:
    adaptive(stage).run()
    assert set(map(tuple, drives(stage).values())) == {(1.0, 1.0, 1.0, 1.0)}
    catches = [e for e in stage.log.events if isinstance(e, TrialStart) and e.trial_type == "catch"]
    assert [event.conditions["drive"] for event in catches] == [None, None]


def test_the_exposure_is_that_of_the_level(stage: Stage) -> None:
    adaptive(stage).script.press_after_s = (0.3,)
    stage.run()
    exposures = [e for e in stage.log.events if isinstance(e, StimulusStart)]
    assert all(event.exposure_s == event.drive**2 * event.duration_s for event in exposures)


def test_a_resumed_session_goes_on_from_the_recorded_levels(stage: Stage) -> None:
    plan = adaptive(stage).plan
    runs = AdaptiveRuns(METHOD, plan, {})
    first = [trial for trial in plan.trials if trial.block == 1 and trial.trial_type == "stimulus"]
    answers = {}
    for trial in first[:5]:
        at = runs.at_its_level(trial)
        answers[trial.trial] = Answer(at.stimulus.drive, felt=True)
        runs.take_in(at, felt=True)
    resumed = AdaptiveRuns(METHOD, plan, answers)
    assert resumed.at_its_level(first[5]) == runs.at_its_level(first[5])

    done = frozenset(t.trial for t in plan.trials if t.trial < first[5].trial)
    stage.run(Done(complete=done, answers=answers))
    event = next(e for e in stage.log.events if isinstance(e, StimulusStart))
    assert event.trial == first[5].trial
    assert event.drive == runs.at_its_level(first[5]).stimulus.drive


def test_constant_stimuli_stay_as_planned(stage: Stage) -> None:
    runs = AdaptiveRuns(None, stage.plan, {})
    for trial in stage.plan.trials:
        assert runs.at_its_level(trial) == trial
        runs.take_in(trial, felt=True)
    assert list(possible_stimuli(stage.protocol, stage.plan.trials)) == []


def test_all_levels_are_judged_before_the_first_trial(stage: Stage) -> None:
    adaptive(stage)
    judged = {stimulus.drive for stimulus in possible_stimuli(stage.protocol, stage.plan.trials)}
    assert judged == set(METHOD.levels)
