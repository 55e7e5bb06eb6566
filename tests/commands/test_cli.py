"""The programs as such: help, start-up, output, and the commands that print."""

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
import yaml

from autd_trials.cli import main
from autd_trials.protocol.load import find_protocol
from tests.commands.conftest import RUN_PROTOCOL, Run, WriteProtocol, WriteRig

COMMANDS = ["run", "check", "plan", "schema", "export", "analyse", "field", "devices"]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    assert "usage: autd-trials" in capsys.readouterr().out


def test_help_loads_no_heavy_package() -> None:
    program = (
        "import sys\n"
        "from autd_trials.cli import run_protocol\n"
        "try: run_protocol(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'matplotlib', 'numba', 'pydantic', 'autd3', 'rich', 'yaml'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "PROTOCOL" in done.stdout
    assert done.stderr.strip() == "[]"


def test_an_unknown_command_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["fly"])
    assert caught.value.code == 2
    assert "invalid choice: 'fly'" in capsys.readouterr().err


def test_a_reader_that_goes_away_causes_no_traceback() -> None:
    plan = [
        sys.executable,
        "-c",
        "import sys; from autd_trials.cli import main; sys.exit(main())",
        "plan",
        "chest",
    ]
    done = subprocess.run(
        f"{' '.join(map(repr, plan))} | head -1", shell=True, capture_output=True, text=True, check=False
    )
    assert done.stdout.startswith("place\tsession")
    assert "Traceback" not in done.stderr


def test_plan_prints_a_table_or_json(run: Run) -> None:
    table = run("plan", "chest-catch", "--place", 2, "--seed", 5)
    rows = [line.split("\t") for line in table.out.splitlines()]
    assert len({len(row) for row in rows}) == 1
    plan = run("plan", "chest-catch", "--place", 2, "--seed", 5, "--json").json
    assert len(rows) == len(plan["trials"]) + 1
    assert run("plan", "chest", "--place", 0).code == 2


def test_check_says_what_a_session_would_be(run: Run) -> None:
    done = run("check", "chest", "--json")
    assert done.code == 0
    assert done.json["trials"] == 60
    assert done.json["exposure_s"] == 60
    assert done.json["emulated"] is True
    assert 140 < done.json["ear level_db"] < 150
    assert "warning: 144 dB SPL are predicted at the ears" in done.err


def test_check_says_when_the_level_at_the_ears_is_not_known(run: Run, write_protocol: WriteProtocol) -> None:
    done = run("check", write_protocol(head=None), "--json")
    assert done.json["ear level_db"] is None
    assert "does not say where the head is" in done.err


def test_check_warns_where_nothing_is_left_for_a_trial_that_is_run_again(
    run: Run, write_protocol: WriteProtocol
) -> None:
    safety = {"longest_burst_s": 1, "largest_duty": 0.5, "session_exposure_s": 1.3}
    done = run("check", write_protocol(safety=safety))
    assert done.code == 0
    assert "the exposure limits leave 0.1 s, not enough to run a trial again" in done.err
    assert "leaves" not in run("check", "chest").err


def test_check_refuses_what_the_rig_forbids(run: Run, write_rig: WriteRig) -> None:
    loud = write_rig(lambda rig, _cal: rig["array"]["limits"].update(largest_ear_level_db=100))
    refused = run("check", "chest", "--rig", loud)
    assert refused.code == 5
    assert "over the limit of 100 dB" in refused.err
    protected = write_rig(
        lambda rig, _cal: (
            rig["array"]["limits"].update(largest_ear_level_db=100),
            rig.update(hearing_protection_db=50),
        )
    )
    assert run("check", "chest", "--rig", protected).code == 0


@pytest.mark.parametrize("kind", ["protocol", "rig"])
def test_schema_is_json_schema(run: Run, kind: str) -> None:
    schema = run("schema", kind).json
    jsonschema.Draft202012Validator.check_schema(schema)
    if kind == "protocol":
        data = json.loads(json.dumps(yaml.safe_load(find_protocol("chest").read_text())))
        jsonschema.validate(data, schema)


def test_devices_lists_without_opening(run: Run) -> None:
    found = run("devices", "--json").json
    assert "lo" in found["network_interfaces"]
    assert set(found) == {"network_interfaces", "serial_ports", "sound_devices", "sound_problem"}
    assert "serial ports (responses.port):" in run("devices").out


def test_analyse_and_export_of_nothing_are_told(run: Run, tmp_path: Path) -> None:
    assert run("analyse", tmp_path).code == 2
    refused = run("export", tmp_path / "none")
    assert refused.code == 2
    assert "record a session" in refused.err or "no " in refused.err


def test_run_protocol_is_the_run_command(tmp_path: Path) -> None:
    arguments = ["pilot", "--simulate", "1", "--data", str(tmp_path), "--json"]
    done = subprocess.run([*RUN_PROTOCOL, *arguments], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["sessions"][0]["participant"] == "sim01"
