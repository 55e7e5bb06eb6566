"""Limits and records that hold whatever is done between sessions: resume, another rig, another run."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from autd_trials.records.history import participant_lock, used_before
from tests.commands.conftest import Run, WriteProtocol, WriteRig, events, of, start
from tests.commands.test_run import of_or_none, wait_for

Data = dict[str, Any]


def logs(data: Path) -> list[Path]:
    return sorted(data.glob("*/sourcedata/sub-*/ses-*/*_log.jsonl"))


def interrupted(run: Run, protocol: Path, data: Path, *more: object) -> None:
    """Leave a session that was killed in its third trial."""
    assert run("run", protocol, "--simulate", 1, "--data", data, *more).code == 0
    (log,) = logs(data)
    lines = log.read_bytes().splitlines(keepends=True)
    third = [n for n, line in enumerate(lines) if b'"event":"trial-start"' in line][2]
    log.write_bytes(b"".join(lines[: third + 1]))


def test_refusals_leave_no_session(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig
) -> None:
    def change(rig: Data, _calibration: Data) -> None:
        rig["array"]["limits"]["largest_duty"] = 0.15

    arguments = ("run", write_protocol(), "--rig", write_rig(change), "--simulate", 1)
    refused = run(*arguments, "--data", tmp_path / "data")
    assert refused.code == 5
    assert "share of on-time in 60 s would be" in refused.err
    assert logs(tmp_path / "data") == []
    assert run("check", *arguments[1:4]).code == 5


def test_a_session_charges_what_it_began_also_where_the_kill_came_before_the_line(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    data = tmp_path / "data"
    interrupted(run, write_protocol(), data)
    assert len(of("stimulus", data)) == 2
    used = used_before(data / "short", "sim01", datetime.now(UTC), "01")
    assert used.session_s == pytest.approx(3 * 0.2)
    assert used.today_s == used.session_s


def test_resume_under_looser_limits_is_refused_and_another_rig_is_recorded(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig
) -> None:
    data, protocol = tmp_path / "data", write_protocol()

    def rig(limit_s: float, air_c: float) -> Path:
        def change(rig: Data, _calibration: Data) -> None:
            rig["array"]["limits"]["session_exposure_s"] = limit_s
            rig["array"]["air_temperature_c"] = air_c

        return write_rig(change)

    interrupted(run, protocol, data, "--rig", rig(3.0, 20.0))
    before = events(data)
    again = ("run", protocol, "--simulate", 1, "--resume", "--data", data)
    refused = run(*again, "--rig", rig(1e4, 20.0))
    assert refused.code == 5
    assert "session_exposure_s from 3 to 10" in refused.err
    assert events(data) == before
    assert run(*again, "--rig", rig(2.5, 45.0)).code == 0
    (resume,) = of("resume", data)[:1]
    assert resume["rig"]["array"]["air_temperature_c"] == 45.0
    assert resume["limits"]["session_exposure_s"] == 2.5
    assert resume["devices"]["array"]["driver"] == "virtual"
    texts = [note["text"] for note in of("note", data)]
    assert "deviation: rig.array.air_temperature_c: 20.0 -> 45.0" in texts
    assert "deviation: rig.array.limits.session_exposure_s: 3.0 -> 2.5" in texts


def test_resume_with_another_kind_of_array_is_refused(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    data, protocol = tmp_path / "data", write_protocol()
    interrupted(run, protocol, data)
    (log,) = logs(data)
    text = log.read_text().replace('"link":"emulator"', '"link":{"interface":"eth0"}', 1)
    log.write_text(text)
    refused = run("run", protocol, "--simulate", 1, "--resume", "--data", data)
    assert refused.code == 2
    assert "begun on a real array, and would go on with an emulated array" in refused.err


def test_the_daily_limit_holds_over_all_sessions_of_a_participant(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol, write_rig: WriteRig
) -> None:
    data = tmp_path / "data"

    def change(rig: Data, _calibration: Data) -> None:
        rig["array"]["limits"]["daily_exposure_s"] = 2.5

    arguments = ("run", write_protocol(), "--rig", write_rig(change), "--simulate", 1, "--data", data)
    assert [run(*arguments, "--participant", "p").code for _ in range(2)] == [0, 0]
    third = run(*arguments, "--participant", "p")
    assert third.code == 5
    assert "the participant's exposure in 24 h" in third.err
    assert len(logs(data)) == 2
    assert run(*arguments, "--participant", "q").code == 0
    starts = [json.loads(log.read_text().splitlines()[0]) for log in logs(data)]
    assert [s["exposure_today_s"] for s in starts] == pytest.approx([0.0, 1.2, 0.0])


def test_two_sessions_of_one_participant_at_once_are_refused(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    protocol = write_protocol()
    assert run("run", protocol, "--simulate", 1, "--data", tmp_path / "data").code == 0
    with participant_lock(tmp_path / "data" / "short", "sim01"):
        refused = run("run", protocol, "--simulate", 1, "--data", tmp_path / "data")
        assert refused.code == 2
        assert "has a session with participant sim01" in refused.err
        others = ("--participant", "b", "--data", tmp_path / "data")
        assert run("run", protocol, "--simulate", 1, *others).code == 0


def test_an_interrupted_session_is_named_at_every_start(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    data, protocol = tmp_path / "data", write_protocol()
    interrupted(run, protocol, data)
    other = run("run", protocol, "--simulate", 1, "--participant", "b", "--data", data)
    assert "session 01 of participant sim01 is not finished (interrupted, 2 of 6 trials)" in other.err
    assert "--resume --participant sim01 --session 01" in other.err
    assert run("run", protocol, "--simulate", 1, "--resume", "--data", data).code == 0
    assert "is not finished" not in run("run", protocol, "--simulate", 1, "--data", data).err


@pytest.mark.parametrize("ending", ["aborted", "failed"])
def test_every_ending_but_success_resumes_without_ids(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol, ending: str
) -> None:
    from autd_trials.records.log import EventLog
    from autd_trials.records.sessions import find_session
    from autd_trials.session.events import SessionEnd

    data, protocol = tmp_path / "data", write_protocol()
    interrupted(run, protocol, data)
    last = events(data)[-1]
    end = SessionEnd(t_s=last["t_s"], utc=last["utc"], status=ending, why="because")  # type: ignore[arg-type]
    with EventLog.reopen(logs(data)[0]) as log:
        log.append(end)
    assert find_session(data / "short").standing.status == ending
    assert run("run", protocol, "--simulate", 1, "--resume", "--data", data).code == 0
    assert events(data)[-1]["status"] == "success"


def test_a_bad_time_in_the_last_line_is_a_damaged_line(
    run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    data, protocol = tmp_path / "data", write_protocol()
    interrupted(run, protocol, data)
    (log,) = logs(data)
    lines = log.read_text().splitlines()
    last = json.loads(lines[-1])
    for utc in ("yesterday", "", "0001-01-01T00:00:00+23:59", "9999-12-31T23:59:59-23:59"):
        log.write_text("\n".join([*lines[:-1], json.dumps(last | {"utc": utc})]) + "\n")
        done = run("run", protocol, "--simulate", 1, "--resume", "--data", data)
        assert done.code == 0, done.err


@pytest.mark.emulator
@pytest.mark.slow
@pytest.mark.parametrize(
    ("signal_name", "why"), [("SIGTERM", "ended by SIGTERM"), ("SIGHUP", "the terminal was closed")]
)
def test_signals_abort_an_unattended_session_at_once(
    tmp_path: Path, write_protocol: WriteProtocol, signal_name: str, why: str
) -> None:
    import signal

    process = start(write_protocol(), "--simulate", 1, "--real-time", "--data", tmp_path)
    wait_for(lambda: process.poll() is not None or of_or_none("stimulus", tmp_path))
    assert process.poll() is None, process.communicate()[1]
    process.send_signal(getattr(signal, signal_name))
    _, err = process.communicate(timeout=30)
    assert process.returncode == 3, err
    assert "--resume" in err
    assert (events(tmp_path)[-1]["status"], events(tmp_path)[-1]["why"]) == ("aborted", why)
