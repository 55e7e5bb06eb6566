from pathlib import Path

import pytest

from autd_trials.errors import DeviceError, UsageError
from autd_trials.records.log import EventLog
from autd_trials.records.roster import next_participant, next_session, place_of
from autd_trials.records.sessions import (
    find_session,
    never_begun,
    new_session,
    study_lock,
    study_sessions,
    take_up,
)
from autd_trials.testing.script import SessionScript

TASK = "chestcatch"


def test_an_empty_study_gives_the_first_numbers(study: Path) -> None:
    new = new_session(study, TASK, "07", simulated=True)
    assert (new.paths.session, new.place, new.number) == ("01", 1, 1)
    assert next_participant(study) == "01"
    assert study_sessions(study) == []
    assert not study.exists()


def test_places_are_given_in_order_of_first_appearance_and_kept(study: Path) -> None:
    for place, participant in enumerate(["zoe", "adam", "07"], start=1):
        assert place_of(study, participant, simulated=True) == place
        SessionScript(participant=participant, place=place).begin(1).save(study)
    assert [place_of(study, participant, simulated=True) for participant in ("zoe", "adam", "07", "new")] == [
        1,
        2,
        3,
        4,
    ]
    assert next_participant(study) == "08"


def test_session_numbers_go_on_and_are_not_used_twice(study: Path) -> None:
    SessionScript(session="02").trial(1).save(study)
    SessionScript(session="pre").trial(1).save(study)
    assert next_session(study, "01") == "03"
    assert next_session(study, "02") == "01"
    assert new_session(study, TASK, "01", simulated=True).number == 3
    assert new_session(study, TASK, "01", "post", simulated=True).number == 3


def test_a_recorded_session_cannot_be_new(study: Path) -> None:
    SessionScript().save(study)
    with pytest.raises(UsageError, match="has been recorded already"):
        new_session(study, TASK, "01", "01", simulated=True)


def test_ids_of_a_new_session_are_checked(study: Path) -> None:
    SessionScript(participant="ab", session="pre").save(study)
    for participant, session in [("../x", "01"), ("01", "a b"), ("AB", "01"), ("ab", "Pre")]:
        with pytest.raises(UsageError):
            new_session(study, TASK, participant, session, simulated=True)


def test_a_session_that_never_began_has_no_place_but_keeps_its_number(study: Path) -> None:
    path = SessionScript(participant="02", place=1).save(study)
    path.write_bytes(path.read_bytes()[:100])
    assert never_begun(study) == [path]
    assert study_sessions(study) == []
    assert place_of(study, "03", simulated=True) == 1
    assert next_session(study, "02") == "02"


def test_a_damaged_start_does_not_give_a_place_twice(study: Path) -> None:
    SessionScript(participant="01", place=1).save(study)
    path = SessionScript(participant="02", place=2).note("later").save(study)
    path.write_bytes(b"{" + path.read_bytes())
    with pytest.raises(UsageError, match="not the start of a session"):
        place_of(study, "03", simulated=True)


def test_damage_further_down_does_not_hide_a_place(study: Path) -> None:
    path = SessionScript(participant="02", place=2).trial(1).save(study)
    path.write_bytes(path.read_bytes() + b"\xff\n{")
    assert place_of(study, "02", simulated=True) == 2
    assert place_of(study, "03", simulated=True) == 3


def test_a_log_in_the_wrong_folder_is_refused(study: Path) -> None:
    path = SessionScript(participant="01").save(study)
    elsewhere = path.parent.parent.parent / "sub-02" / "ses-01" / path.name
    elsewhere.parent.mkdir(parents=True)
    path.rename(elsewhere)
    with pytest.raises(UsageError, match="lies where it does not belong") as refusal:
        study_sessions(study)
    assert str(path) in str(refusal.value)


def test_sessions_are_listed_in_order(study: Path) -> None:
    for participant, session in [("02", "01"), ("01", "02"), ("01", "01")]:
        SessionScript(participant=participant, session=session).save(study)
    listed = [(found.paths.participant, found.paths.session) for found in study_sessions(study)]
    assert listed == [("01", "01"), ("01", "02"), ("02", "01")]


def test_without_ids_the_only_interrupted_session_is_found(study: Path) -> None:
    SessionScript(participant="01").all_trials().save(study)
    SessionScript(participant="02").trial(1).save(study)
    found = find_session(study)
    assert found.paths.participant == "02"
    assert found.standing.complete == {1}
    assert find_session(study, "02", "01") == found
    assert find_session(study, "01", "01").standing.finished


def test_several_interrupted_sessions_have_to_be_named(study: Path) -> None:
    SessionScript(participant="01").trial(1).save(study)
    SessionScript(participant="02").all_trials().save(study)
    SessionScript(participant="03").save(study)
    with pytest.raises(UsageError, match="several sessions") as refusal:
        find_session(study)
    message = str(refusal.value)
    assert "participant 01, session 01: interrupted, 1 of 14 trials" in message
    assert "participant 02" not in message
    assert "--participant" in message


def test_no_session_to_go_on_with_says_what_there_is(study: Path) -> None:
    with pytest.raises(UsageError, match="no session to go on with"):
        find_session(study)
    SessionScript(participant="01").all_trials().save(study)
    with pytest.raises(UsageError, match="participant 01, session 01: success, 14 of 14 trials"):
        find_session(study)
    with pytest.raises(UsageError, match="no session"):
        find_session(study, "02")


def test_a_found_session_is_gone_on_with_only_as_it_was_read(study: Path) -> None:
    script = SessionScript().trial(1)
    path = script.save(study)
    path.write_bytes(path.read_bytes() + b'{"torn')
    found, stale = find_session(study), find_session(study)
    with take_up(found) as log:
        with pytest.raises(UsageError, match="another run is writing"):
            take_up(stale)
        log.append(script.resume().events[-1])
    with pytest.raises(UsageError, match="went on with this session meanwhile"):
        take_up(stale)
    with take_up(find_session(study)) as log:
        log.append(script.trial(2).events[-1])


def test_a_study_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DeviceError, match="choose another folder"), study_lock(tmp_path / "file" / "chest"):
        raise AssertionError("the lock was given without a folder")
    with pytest.raises(DeviceError, match="disk: "):
        EventLog.create(tmp_path / "file" / "log.jsonl")


def test_two_runs_cannot_begin_a_session_at_once(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autd_trials.records.sessions._PATIENCE_S", 0.0)
    with study_lock(study):
        new = new_session(study, TASK, "01", simulated=True)
        with pytest.raises(UsageError, match="just beginning"), study_lock(study):
            raise AssertionError("the lock was given twice")
        log = EventLog.create(new.paths.log)
        log.append(SessionScript(place=new.place).events[0])
    with study_lock(study), log:
        assert place_of(study, "02", simulated=True) == 2
