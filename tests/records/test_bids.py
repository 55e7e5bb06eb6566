import json
import shutil
import subprocess
import tempfile
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.errors import DeviceError, UsageError
from autd_trials.protocol.schema import Factor, Factors
from autd_trials.records.bids import export_study
from autd_trials.records.log import EventLog
from autd_trials.session.events import SessionStart
from autd_trials.testing.script import START, SessionScript
from autd_trials.testing.studies import make_protocol
from tests.conftest import program
from tests.records.conftest import largest_file

LATER = START + timedelta(days=1)


def problems(study: Path) -> list[Any]:
    """What the official BIDS validator has to say."""
    command = [program("bids-validator-deno"), str(study), "--format", "json_pp"]
    report = subprocess.run(command, capture_output=True, text=True, check=False)
    issues: list[Any] = json.loads(report.stdout)["issues"]["issues"]
    return issues if issues or report.returncode == 0 else [report.stderr]


def contents(study: Path) -> dict[str, bytes]:
    return {str(path.relative_to(study)): path.read_bytes() for path in study.rglob("*") if path.is_file()}


def table(path: Path) -> list[dict[str, str]]:
    header, *lines = [line.split("\t") for line in path.read_text().splitlines()]
    return [dict(zip(header, line, strict=True)) for line in lines]


def eventful_study(study: Path) -> None:
    """Everything that can happen to sessions, in one study."""
    SessionScript("01").all_trials().save(study)
    aborted = SessionScript("01", "02", start=LATER).block(1).pause().resume(after_crash=False)
    aborted.trials([1, 2]).begin(3).stimulate(3).interrupt(3).fault().note("a\nnote\twith 日本")
    aborted.end("aborted", "the participant\nwanted to stop").save(study)
    resumed = SessionScript("02", place=2).block(1).trials([1]).begin(2).stimulate(2)
    path = resumed.save(study)
    path.write_bytes(path.read_bytes()[:-7])
    with EventLog.reopen(path) as log:
        for event in SessionScript("02", place=2, t_s=50.0).resume().trial(2, 2).trial(3).end().events[1:]:
            log.append(event)
    SessionScript("03", "pre", place=3).save(study)
    SessionScript("04", place=4).block(1).end("failed", "the array was lost").save(study)
    never = SessionScript("05", place=5).save(study)
    never.write_bytes(never.read_bytes()[:50])


def test_a_study_with_everything_that_can_happen_is_a_valid_data_set(study: Path) -> None:
    eventful_study(study)
    files = export_study(study).files
    assert problems(study) == []
    assert all(path.is_file() for path in files)
    assert files == sorted(files)


def test_the_simplest_study_is_a_valid_data_set(study: Path) -> None:
    SessionScript(simulated=False).save(study)
    export_study(study)
    assert problems(study) == []
    assert not list(study.rglob("*_events.tsv"))


def test_a_study_without_factors_or_masking_is_a_valid_data_set(study: Path) -> None:
    SessionScript(protocol=make_protocol("a-b-c", masking=None, catch_trials_per_block=0)).all_trials().save(
        study
    )
    export_study(study)
    assert problems(study) == []
    assert (study / "task-abc_events.json").is_file()


def test_changed_protocols_are_exported_together_and_told(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    factors = Factors(between_blocks={"posture": Factor(levels=("sitting", "standing"))})
    changed = SessionScript("02", place=2, protocol_sha256="ef" * 32, start=LATER)
    start = changed.events[0]
    assert isinstance(start, SessionStart)
    changed.events[0] = start.model_copy(update={"protocol": make_protocol(factors=factors)})
    changed.all_trials().save(study)
    export_study(study)
    assert problems(study) == []
    readme = (study / "README.md").read_text()
    assert "its sessions used 2 versions" in readme
    assert "ef" * 32 in readme
    header = (
        (study / "sub-01/ses-01/beh/sub-01_ses-01_task-chestcatch_run-1_events.tsv")
        .read_text()
        .split("\n")[0]
    )
    assert {"clothing", "modulation_hz", "posture"} <= set(header.split("\t"))


def test_the_same_logs_give_the_same_bytes_wherever_they_are(study: Path, tmp_path: Path) -> None:
    eventful_study(study)
    logs = contents(study)
    export_study(study)
    first = contents(study)
    assert logs.items() <= first.items(), "the logs were touched"
    assert export_study(study).files
    assert contents(study) == first
    copy = tmp_path / "elsewhere" / study.name
    shutil.copytree(study / "sourcedata", copy / "sourcedata")
    export_study(copy)
    assert contents(copy) == first
    assert str(tmp_path) not in str(first.values())


def test_the_tables_say_what_the_logs_say(study: Path) -> None:
    eventful_study(study)
    export_study(study)
    people = table(study / "participants.tsv")
    assert [(p["participant_id"], p["place"], p["simulated"], p["sessions"]) for p in people] == [
        ("sub-01", "1", "yes", "2"),
        ("sub-02", "2", "yes", "1"),
        ("sub-03", "3", "yes", "1"),
        ("sub-04", "4", "yes", "1"),
    ]
    first, second = table(study / "sub-01/sub-01_sessions.tsv")
    assert (first["status"], first["trials_complete"], first["acq_time"]) == (
        "success",
        "14",
        "2026-11-22T09:00:00.000000Z",
    )
    assert (second["status"], second["attempts_interrupted"], second["pauses"]) == ("aborted", "1", "1")
    assert (second["faults"], second["notes"]) == ("1", "1")
    (resumed,) = table(study / "sub-02/sub-02_sessions.tsv")
    assert (resumed["status"], resumed["crashes"], resumed["damaged_lines"]) == ("success", "1", "1")
    events = table(study / "sub-02/ses-01/beh/sub-02_ses-01_task-chestcatch_run-1_events.tsv")
    assert [event["trial"] for event in events if event["trial_status"] == "complete"] == ["1", "2", "3"]
    assert "nan" not in str(events).lower()


def test_simulated_data_are_called_so_everywhere(study: Path) -> None:
    SessionScript().all_trials().save(study)
    export_study(study)
    readme = (study / "README.md").read_text()
    assert readme.startswith("**Simulated data: no person took part")
    assert "Made up: nobody measured where the units stood" in readme
    assert json.loads((study / "dataset_description.json").read_text())["Name"].endswith("(simulated)")
    assert table(study / "sub-01/sub-01_sessions.tsv")[0]["simulated"] == "yes"


def test_a_person_at_an_emulated_array_is_not_passed_off_as_a_measurement(study: Path) -> None:
    SessionScript(simulated=False).all_trials().save(study)
    export_study(study)
    first_line = (study / "README.md").read_text().split("\n")[0]
    assert "emulated" in first_line
    assert "simulated" not in json.loads((study / "dataset_description.json").read_text())["Name"]


def test_a_mixed_study_says_which_is_which(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    SessionScript("01", "02", simulated=False).save(study)
    export_study(study)
    assert (study / "README.md").read_text().startswith("**Partly simulated data")
    assert table(study / "participants.tsv")[0]["simulated"] == "partly"
    assert [row["simulated"] for row in table(study / "sub-01/sub-01_sessions.tsv")] == ["yes", "no"]


def test_the_readme_tells_what_went_wrong(study: Path) -> None:
    eventful_study(study)
    export_study(study)
    readme = (study / "README.md").read_text()
    assert "sub-01 ses-02: aborted (the participant wanted to stop), 2 of 14 trials complete" in readme
    assert "sub-02 ses-01: taken up again after 1 crash(es); 1 interrupted attempts; unreadable" in readme
    assert "unreadable lines in the log: 7" in readme
    assert "1 fault(s)" in readme
    assert (
        "sub-05_ses-01_task-chestcatch_run-1_log.jsonl: the session was cut short before it began" in readme
    )


def test_an_export_leaves_no_half_files(study: Path) -> None:
    eventful_study(study)
    export_study(study)
    assert not list(study.rglob("*.part"))


@settings(max_examples=20, deadline=None)
@given(cut=st.floats(0, 1), gap=st.floats(0, 1))
def test_whatever_is_lost_of_a_log_its_table_stays_in_order(cut: float, gap: float) -> None:
    script = (
        SessionScript().trial(1).begin(2).stimulate(2).interrupt(2).trial(2, 2).begin(3).resume().trial(3, 2)
    )
    with tempfile.TemporaryDirectory() as folder:
        study = Path(folder)
        path = script.save(study)
        start, rest = path.read_bytes().split(b"\n", 1)
        kept = rest[: int(cut * len(rest))]
        hole = int(gap * len(kept))
        path.write_bytes(start + b"\n" + kept[:hole] + b"\xff" + kept[hole + 1 :])
        export_study(study)
        rows = [row for events in study.rglob("*_events.tsv") for row in table(events)]
    onsets = [float(row["onset"]) for row in rows]
    assert onsets == sorted(onsets)
    complete = [row["trial"] for row in rows if row["trial_status"] == "complete"]
    assert len(complete) == len(set(complete))


def test_a_full_disk_leaves_the_old_files(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    export_study(study)
    SessionScript("02", place=2).all_trials().save(study)
    before = contents(study)
    with largest_file(10), pytest.raises(DeviceError, match="the logs are safe"):
        export_study(study)
    assert contents(study) == before


def test_without_logs_there_is_nothing_to_export(study: Path) -> None:
    with pytest.raises(UsageError, match="no recorded session"):
        export_study(study)
    assert not study.exists()


def test_a_table_whose_log_is_gone_is_neither_deleted_nor_ignored(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    log = SessionScript("02", place=2).all_trials().save(study)
    export_study(study)
    log.unlink()
    before = contents(study)
    with pytest.raises(UsageError, match="raw log of this table") as refusal:
        export_study(study)
    assert "sub-02_ses-01" in str(refusal.value)
    assert contents(study) == before


def test_logs_of_two_protocols_do_not_mix(study: Path) -> None:
    SessionScript("01").save(study)
    SessionScript("02", protocol=make_protocol("other")).save(study)
    with pytest.raises(UsageError, match="another protocol"):
        export_study(study)


def test_a_running_session_can_be_exported(study: Path) -> None:
    with EventLog.reopen(SessionScript().save(study)) as log:
        for event in SessionScript().trial(1).trial(2).events[1:]:
            log.append(event)
            export_study(study)
    (row,) = table(study / "sub-01/sub-01_sessions.tsv")
    assert (row["status"], row["trials_complete"]) == ("interrupted", "2")


def test_text_of_others_is_neutral_wherever_a_person_opens_it(study: Path) -> None:
    protocol = make_protocol("chest", description="See <script>alert(1)</script> and p < .05.")
    script = SessionScript("01", protocol=protocol).all_trials().note("=HYPERLINK(A1)").note("\x1b[31mred")
    script.save(study)
    export_study(study)
    people = study / "participants.tsv"
    header, row = people.read_text().splitlines()
    people.write_text(f"{header}\tremark\tage\n{row}\t@SUM(A1)\t-5\n")
    export_study(study)
    readme = (study / "README.md").read_text(encoding="utf-8")
    assert "<script" not in readme
    assert "p < .05" in readme
    (log,) = study.glob("sub-*/ses-*/beh/*_acq-log_*beh.tsv")
    assert "\t'=HYPERLINK(A1)\t" in log.read_text(encoding="utf-8")
    assert "\x1b" not in log.read_text(encoding="utf-8") + readme
    assert table(people)[0]["remark"] == "'@SUM(A1)"
    assert table(people)[0]["age"] == "-5"
