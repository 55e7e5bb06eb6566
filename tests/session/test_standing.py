from pathlib import Path

import pytest

from autd_trials.records.log import LogContents
from autd_trials.records.progress import Progress, progress_of
from tests.records.conftest import SessionScript


def progress(script: SessionScript) -> Progress:
    return progress_of(LogContents(Path("log.jsonl"), tuple(script.events)))


def test_a_session_that_only_started_has_everything_to_do() -> None:
    script = SessionScript()
    standing = progress(script)
    assert not standing.finished
    assert standing.complete == frozenset()
    assert standing.remaining == script.plan.trials
    assert standing.open_trial is None
    assert standing.exposure_s == 0


def test_a_crash_in_a_trial_leaves_it_open_and_to_do() -> None:
    script = SessionScript().block(1).trials([1, 2]).begin(3).stimulate(3)
    standing = progress(script)
    assert standing.status == "interrupted"
    assert standing.complete == {1, 2}
    assert standing.open_trial == (3, 1)
    assert standing.attempts == {1: 1, 2: 1, 3: 1}
    assert [trial.trial for trial in standing.remaining] == list(range(3, 15))
    assert standing.exposure_s == 3.0
    assert standing.last_t_s == script.events[-1].t_s
    assert standing.last_utc == script.events[-1].utc


def test_attempts_go_on_counting_after_a_resume() -> None:
    script = (
        SessionScript().begin(1).stimulate(1).interrupt(1).resume().begin(1, 2).interrupt(1, 2).trial(1, 3)
    )
    standing = progress(script)
    assert standing.attempts == {1: 3}
    assert standing.attempts_interrupted == 2
    assert standing.complete == {1}
    assert standing.open_trial is None


def test_a_catch_trial_uses_no_exposure() -> None:
    script = SessionScript()
    catch = next(trial.trial for trial in script.plan.trials if trial.trial_type == "catch")
    assert progress(script.trial(catch)).exposure_s == 0


@pytest.mark.parametrize("status", ["success", "aborted", "failed"])
def test_the_end_says_how_it_ended(status: str) -> None:
    standing = progress(SessionScript().trial(1).end(status, "because"))
    assert standing.finished
    assert (standing.status, standing.why) == (status, "because")


def test_a_failed_session_that_was_taken_up_again_is_not_finished() -> None:
    script = SessionScript().trial(1).end("failed", "array lost").resume().trial(2)
    assert not progress(script).finished
    assert progress(script.end()).status == "success"


def test_lost_lines_do_not_make_an_attempt_count_twice() -> None:
    script = SessionScript().begin(1).stimulate(1).interrupt(1).trial(1, 2)
    del script.events[1]
    standing = progress(script)
    assert standing.attempts == {1: 2}
    assert standing.complete == {1}
