"""`run-protocol` with simulated participants: from a protocol to a data set and a figure."""

import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from autd_trials.cli import run_protocol
from tests.commands.conftest import Run, WriteProtocol, WriteRig, events, of, start
from tests.conftest import program


def files(study: Path) -> dict[str, bytes]:
    """Everything of the data set but the logs' lock."""
    return {
        str(path.relative_to(study)): path.read_bytes()
        for path in sorted(study.rglob("*"))
        if path.is_file() and path.name != ".lock"
    }


def test_the_papers_study_from_protocol_to_figure(run: Run, tmp_path: Path) -> None:
    done = run("run", "chest.yaml", "--simulate", 2, "--data", tmp_path, "--json")
    assert done.code == 0
    assert "EMULATED" in done.err
    assert [session["participant"] for session in done.json["sessions"]] == ["sim01", "sim02"]
    study = tmp_path / "chest"
    tables = list(study.glob("sub-*/ses-01/beh/*_task-chest_run-1_events.tsv"))
    assert [len(table.read_text().splitlines()) for table in tables] == [61, 61]
    checked = subprocess.run([program("bids-validator-deno"), str(study)], capture_output=True, check=False)
    assert checked.returncode == 0, checked.stdout
    analysed = run("analyse", study, "--json")
    assert analysed.json["participants"] == 2
    assert (study / "derivatives" / "analysis" / "rates.png").stat().st_size > 10_000


def test_the_same_seed_gives_the_same_answers_and_another_does_not(run: Run, tmp_path: Path) -> None:
    answers = []
    for number, seed in enumerate((1, 1, 2)):
        folder = tmp_path / str(number)
        run("run", "chest", "--simulate", 1, "--seed", seed, "--data", folder)
        answers.append([(e["trial"], e["response"]) for e in of("trial-end", folder)])
    assert answers[0] == answers[1] != answers[2]


def test_export_makes_the_same_bytes_again(run: Run, tmp_path: Path) -> None:
    run("run", "chest-catch", "--simulate", 2, "--data", tmp_path)
    study = tmp_path / "chest-catch"
    before = files(study)
    for path in [*study.glob("*.*"), *study.glob("sub-*/**/*.tsv")]:
        path.unlink()
    assert run("export", study).code == 0
    assert files(study) == before


def test_a_second_session_gets_its_own_number_and_overwrites_nothing(run: Run, tmp_path: Path) -> None:
    run("run", "pilot", "--simulate", 1, "--data", tmp_path)
    before = files(tmp_path / "pilot")
    assert run("run", "pilot", "--simulate", 1, "--data", tmp_path).code == 0
    after = files(tmp_path / "pilot")
    logs = [name for name in after if name.endswith("_log.jsonl")]
    assert len(logs) == 2
    assert all(after[name] == before[name] for name in before if name.endswith("_log.jsonl"))
    refused = run("run", "pilot", "--simulate", 1, "--session", "01", "--data", tmp_path)
    assert refused.code == 2
    assert "recorded already" in refused.err


def test_resuming_what_is_complete_runs_nothing(run: Run, tmp_path: Path) -> None:
    run("run", "pilot", "--simulate", 2, "--data", tmp_path)
    before = files(tmp_path)
    again = run("run", "pilot", "--simulate", 2, "--resume", "--data", tmp_path, "--json")
    assert again.json["sessions"] == []
    assert files(tmp_path) == before


def test_a_true_pose_that_is_wrong_lowers_the_detection_rate(
    run: Run, tmp_path: Path, write_rig: WriteRig
) -> None:
    def stand_elsewhere(rig: dict[str, Any], calibration: dict[str, Any]) -> None:
        import copy

        import yaml

        true = copy.deepcopy(calibration)
        true["units"][1]["translation_mm"][2] += 40
        (tmp_path / "true.yaml").write_text(yaml.safe_dump(true))
        rig["calibration"]["true_file"] = "true.yaml"

    felt = {}
    for name, rig in (("good", "emulated"), ("wrong", write_rig(stand_elsewhere))):
        run("run", "chest", "--simulate", 2, "--rig", rig, "--data", tmp_path / name)
        tables = (tmp_path / name).glob("chest/sub-*/ses-*/beh/*_events.tsv")
        felt[name] = sum(table.read_text(encoding="utf-8").count("\tfelt\t") for table in tables)
        assert felt[name]
    assert felt["wrong"] < 0.8 * felt["good"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["chest", "--real-time"], "--real-time goes with --simulate"),
        (["chest", "--simulate", "2", "--participant", "x"], "--simulate asks for more"),
        (["chest", "--simulate", "1", "--audio", "default"], "cannot be played in virtual time"),
        (["ches", "--simulate", "1"], "did you mean 'chest'"),
        (["chest", "--rig", "emulatd", "--simulate", "1"], "did you mean 'emulated'"),
        (["chest", "--resume"], "no session"),
    ],
)
def test_contradictions_and_wrong_names_are_told(
    run: Run, tmp_path: Path, arguments: list[str], message: str
) -> None:
    refused = run("run", *arguments, "--data", tmp_path)
    assert refused.code == 2
    assert message in refused.err


@pytest.mark.parametrize("name", ["a/b", "..", "", "sub-01", "x" * 300, "ä", "a b", "-", "a\0b"])
def test_a_participant_id_that_is_no_pseudonym_is_refused(run: Run, tmp_path: Path, name: str) -> None:
    refused = run("run", "pilot", "--simulate", 1, f"--participant={name}", "--data", tmp_path / "data")
    assert refused.code == 2
    assert "cannot be a participant id" in refused.err
    assert not list((tmp_path / "data").rglob("*.jsonl"))


@pytest.mark.parametrize(
    "arguments", [["--simulate", "0"], ["--simulate", "x"], ["--seed", "-1"], ["--nope"]]
)
def test_malformed_arguments_are_told(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        run_protocol(["chest", *arguments])
    assert caught.value.code == 2
    assert "error:" in capsys.readouterr().err


def test_a_killed_simulation_is_gone_on_with_and_nothing_is_lost_or_doubled(tmp_path: Path) -> None:
    process = start("chest", "--simulate", 1, "--data", tmp_path)
    while not list(tmp_path.glob("chest/sourcedata/*/*/*.jsonl")) and process.poll() is None:
        time.sleep(0.002)
    time.sleep(0.15)
    process.kill()
    process.communicate()
    before = next(tmp_path.glob("chest/sourcedata/*/*/*.jsonl")).read_bytes()
    resumed = start("chest", "--simulate", 1, "--resume", "--data", tmp_path)
    resumed.communicate()
    assert resumed.returncode == 0
    assert next(tmp_path.glob("chest/sourcedata/*/*/*.jsonl")).read_bytes().startswith(before)
    (first, *_) = events(tmp_path)
    complete = [e["trial"] for e in of("trial-end", tmp_path) if e["status"] == "complete"]
    assert complete == [trial["trial"] for trial in first["plan"]["trials"]]


def test_a_killed_adaptive_session_goes_on_with_the_levels_of_one_that_was_not(tmp_path: Path) -> None:
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    start("chest-threshold", "--simulate", 1, "--data", whole).communicate()
    process = start("chest-threshold", "--simulate", 1, "--data", killed)
    log = killed / "chest-threshold/sourcedata/sub-sim01/ses-01"
    while not list(log.glob("*.jsonl")) or len(next(log.glob("*.jsonl")).read_bytes().splitlines()) < 150:
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    process.communicate()
    resumed = start("chest-threshold", "--simulate", 1, "--resume", "--data", killed)
    _, err = resumed.communicate()
    assert resumed.returncode == 0
    assert "sim01 session 01: success" in err, "whoever shows the session knows what was before"
    assert of("fault", killed) == []
    # A trial that the kill came in is another attempt, so its answer may differ, and what follows from it.
    interrupted = min((e["trial"] for e in of("trial-start", killed) if e["attempt"] > 1), default=None)
    levels = {e["trial"]: e["conditions"]["drive"] for e in of("trial-start", whole)}
    gone_on = {e["trial"]: e["conditions"]["drive"] for e in of("trial-start", killed)}
    assert gone_on.keys() == levels.keys()
    same = [trial for trial in levels if interrupted is None or trial <= interrupted]
    assert [gone_on[trial] for trial in same] == [levels[trial] for trial in same]
    assert len({level for level in gone_on.values() if level is not None}) > 5


def test_a_session_goes_on_only_as_it_was_begun(run: Run, tmp_path: Path) -> None:
    process = start("chest-threshold", "--simulate", 1, "--data", tmp_path)
    wait_for(lambda: len(of_or_none("trial-end", tmp_path)) > 3)
    process.kill()
    process.communicate()
    before = events(tmp_path)
    arguments = ("chest-threshold", "--resume", "--data", tmp_path)
    by_a_person = run("run", *arguments)
    assert by_a_person.code == 2
    assert (
        "begun by a simulated participant in virtual time, and would go on with a person" in by_a_person.err
    )
    in_real_time = run("run", *arguments, "--simulate", 1, "--real-time")
    assert in_real_time.code == 2
    assert "give --simulate 1 without --real-time" in in_real_time.err
    assert events(tmp_path) == before


@pytest.mark.emulator
@pytest.mark.slow
def test_a_real_time_session_killed_in_mid_trial_is_gone_on_with(
    tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    arguments = (write_protocol(), "--simulate", 1, "--real-time", "--data", tmp_path)
    process = start(*arguments)
    wait_for(lambda: len(of_or_none("stimulus", tmp_path)) == 2)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    resumed = start(*arguments, "--resume", "--yes")
    _, err = resumed.communicate(timeout=60)
    assert resumed.returncode == 0, err
    ends = of("trial-end", tmp_path)
    assert [e["status"] for e in ends].count("interrupted") == 1
    complete = [e["trial"] for e in ends if e["status"] == "complete"]
    assert complete == [1, 2, 3, 4, 5, 6]
    assert of("resume", tmp_path)[0]["after_crash"]
    assert all(e["margin_s"] > 0.01 for e in of("stimulus", tmp_path))


def of_or_none(kind: str, data: Path) -> list[dict[str, Any]]:
    """The events of one kind while the log is being written."""
    try:
        return of(kind, data)
    except ValueError:
        return []


def wait_for(condition: Any, deadline_s: float = 30.0) -> None:
    end_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < end_s, "it did not happen"
        time.sleep(0.005)
