"""Places and orders are given by the sessions that came to a trial, of the same kind."""

from pathlib import Path

import pytest

from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import HeldFile
from autd_trials.records.layout import source_folder
from autd_trials.records.log import EventLog
from autd_trials.records.roster import known_participant, next_participant, place_of
from autd_trials.records.sessions import find_session, new_session, study_lock, take_up
from autd_trials.testing.script import SessionScript

TASK = "chestcatch"


def script(participant: str, place: int, session: str = "01", *, simulated: bool = False) -> SessionScript:
    return SessionScript(participant=participant, session=session, place=place, simulated=simulated)


def test_a_session_without_a_trial_takes_no_place_and_turns_no_order(study: Path) -> None:
    script("01", 1).block(1).end("aborted", "the participant was not ready").save(study)
    again = new_session(study, TASK, "01")
    assert (again.paths.session, again.place, again.number) == ("02", 1, 1)
    assert new_session(study, TASK, "02").place == 1
    script("01", 1, "02").trial(1).end("aborted", "stopped").save(study)
    third = new_session(study, TASK, "01")
    assert (third.paths.session, third.place, third.number) == ("03", 1, 2)
    assert new_session(study, TASK, "01", "05").number == 4
    assert new_session(study, TASK, "02").place == 2


def test_a_session_that_runs_keeps_its_place_before_its_first_trial(study: Path) -> None:
    path = script("01", 1).save(study)
    with EventLog.reopen(path):
        assert place_of(study, "02", simulated=False) == 2
        assert place_of(study, "01", simulated=False) == 1
    assert place_of(study, "02", simulated=False) == 1


def test_simulated_sessions_and_those_of_people_have_rosters_of_their_own(study: Path) -> None:
    for number in (1, 2, 3):
        script(f"sim{number:02d}", number, simulated=True).trial(1).save(study)
    assert new_session(study, TASK, "01").place == 1
    script("01", 1).trial(1).save(study)
    assert new_session(study, TASK, "sim04", simulated=True).place == 4
    assert new_session(study, TASK, "sim02", "02", simulated=True).place == 2
    assert new_session(study, TASK, "02").place == 2
    assert next_participant(study) == "02"


def test_the_place_of_a_drop_out_can_be_filled(study: Path) -> None:
    script("01", 1).all_trials().save(study)
    script("02", 2).trial(1).end("aborted", "felt unwell").save(study)
    script("03", 3).all_trials().save(study)
    assert new_session(study, TASK, "04").place == 4
    assert new_session(study, TASK, "04", place=2).place == 2
    assert new_session(study, TASK, "04", place=7).place == 7
    for place, words in ((1, "has a complete session"), (0, "count from 1")):
        with pytest.raises(UsageError, match=words):
            new_session(study, TASK, "04", place=place)
    with pytest.raises(UsageError, match="has place 3, not 2"):
        new_session(study, TASK, "03", place=2)
    script("04", 2).all_trials().save(study)
    assert place_of(study, "04", simulated=False) == 2
    assert place_of(study, "05", simulated=False) == 4


def test_a_place_that_was_given_away_meanwhile_is_not_taken_up_again(study: Path) -> None:
    script("01", 1).block(1).save(study)
    found = find_session(study)
    take_up(found).close()
    script("02", 1).trial(1).save(study)
    with pytest.raises(UsageError, match="its place 1 was given to participant 02"):
        take_up(found)


def test_what_was_ended_before_its_first_trial_does_not_wait_to_be_gone_on_with(study: Path) -> None:
    script("01", 1).block(1).end("aborted", "no").save(study)
    script("02", 1).trial(1).end("failed", "OSError").save(study)
    assert find_session(study).paths.participant == "02"
    assert find_session(study, "01", "01").paths.participant == "01"


def test_a_known_participant_is_described(study: Path) -> None:
    assert known_participant(study, "01") is None
    script("01", 1).all_trials().save(study)
    script("01", 1, "02").trial(1).save(study)
    known = known_participant(study, "01")
    assert known is not None
    assert "2 session(s)" in known
    assert "session 01, begun 2026-11-22 09:00: success, 14 of 14 trials" in known
    assert "session 02, begun 2026-11-22 09:00: interrupted, 1 of 14 trials" in known
    assert known_participant(study, "02") is None


def test_a_lock_that_is_taken_away_is_noticed(study: Path) -> None:
    def take_it_away() -> None:
        with study_lock(study):
            (source_folder(study) / ".lock").unlink()

    with pytest.raises(DeviceError, match="lock was removed or replaced"):
        take_it_away()
    with study_lock(study):
        assert place_of(study, "01", simulated=False) == 1


def test_a_held_file_that_was_removed_is_not_held_any_more(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    held = HeldFile(path)
    before = held.intact
    path.unlink()
    assert (before, held.intact) == (True, False)
    other = HeldFile(path)
    assert other.intact
    other.release()
    held.release()
