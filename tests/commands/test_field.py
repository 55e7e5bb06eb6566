import json
from pathlib import Path
from typing import Any

import pytest

from autd_trials.cli import main
from autd_trials.yamlfile.shipped import find_file
from tests.calibration.full_disk import largest_file

B = "302,225,1000"
COARSE = ["--width-mm", "60", "--step-mm", "2"]


def field(tmp_path: Path, *arguments: str) -> dict[str, Any]:
    assert main(["field", "--out", str(tmp_path / "out"), *COARSE, *arguments]) == 0
    report: dict[str, Any] = json.loads((tmp_path / "out" / "field.json").read_text())
    return report


def test_the_papers_foci_are_the_default_and_have_its_sizes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = field(tmp_path)
    assert [focus["name"] for focus in report["foci"]] == ["A", "B", "C"]
    sizes_mm = {focus["name"]: max(focus["diameters_mm"].values()) for focus in report["foci"]}
    assert sizes_mm["C"] == pytest.approx(30, abs=2), "the paper's 30 mm"
    assert report["foci"][1]["diameters_mm"]["xy"] == pytest.approx(13, abs=1), "the paper's 13 mm"
    assert all(focus["shift_mm"] < 1 and focus["energy_left"] == 1 for focus in report["foci"])
    assert (tmp_path / "out" / "field.png").stat().st_size > 10_000
    assert "upper bound" in capsys.readouterr().err


def test_fringes_beside_the_focus_are_told_apart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (focus,) = field(tmp_path, "--focus", "302,225,500")["foci"]
    assert max(focus["diameters_mm"].values()) < 9
    assert {plane: len(lobes) for plane, lobes in focus["side_lobes"].items()} == {"xy": 0, "xz": 2, "yz": 2}
    assert "(beside it side lobes of up to -0." in capsys.readouterr().out


@pytest.mark.parametrize("name", ["a-file", "a-file/below", "d" * 300])
def test_a_folder_that_cannot_be_made_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (tmp_path / "a-file").write_text("of somebody")
    assert main(["field", "--focus", B, *COARSE, "--out", str(tmp_path / name)]) == 2
    assert "the folder for pictures cannot be made" in capsys.readouterr().err
    assert (tmp_path / "a-file").read_text() == "of somebody"


def test_a_full_disk_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with largest_file(5000):
        assert main(["field", "--focus", B, *COARSE, "--out", str(tmp_path / "out")]) == 4
    assert "the disk does not take this" in capsys.readouterr().err


def test_linear_theory_is_called_an_upper_bound_in_json_and_figure(tmp_path: Path) -> None:
    report = field(tmp_path, "--focus", B)
    assert "upper bound" in report["foci"][0]["warnings"][0]
    assert report["calibration_made_up"]
    faint = field(tmp_path, "--focus", B, "--drive", "0.05")
    assert faint["foci"][0]["warnings"] == []


def test_force_goes_with_drive_squared_and_the_law_of_the_modulation(tmp_path: Path) -> None:
    full, half = (field(tmp_path, "--focus", B, "--drive", drive)["foci"][0] for drive in ("1", "0.5"))
    assert half["disc_force_mn"] == pytest.approx(full["disc_force_mn"] / 4, rel=0.02)
    forces = full["modulated_force_mn"]
    relative = [forces["amplitude"][part] / full["disc_force_mn"] for part in forces["amplitude"]]
    assert relative == pytest.approx([0.375, 0.5, 0.125], abs=1e-9)
    relative = [forces["pressure"][part] / full["disc_force_mn"] for part in forces["pressure"]]
    assert relative == pytest.approx([0.5, 0.5, 0], abs=1e-9)


def test_a_pose_error_moves_the_maximum_and_costs_energy(tmp_path: Path) -> None:
    (focus,) = field(tmp_path, "--focus", B, "--pose-error", "2:0,0,20")["foci"]
    assert 15 <= focus["maximum_mm"][2] - 1000 <= 20
    assert focus["energy_left"] < 0.5
    (turned,) = field(tmp_path, "--focus", B, "--pose-error", "2:0,0,0,0,1,0")["foci"]
    assert turned["energy_left"] < 0.8


def test_an_error_budget_is_drawn_and_reported(tmp_path: Path) -> None:
    report = field(tmp_path, "--focus", B, "--error-budget", "3")
    assert {cost["kind"] for cost in report["error_budget"]} == {"position_mm", "angle_deg"}
    assert (tmp_path / "out" / "error_budget.svg").exists()


def test_a_scan_of_a_wrong_pose_shows_the_shift(tmp_path: Path) -> None:
    scan = str(tmp_path / "scan.csv")
    field(tmp_path, "--focus", B, "--pose-error", "2:0,0,20", "--scan", scan)
    report = field(tmp_path, "--focus", B, "--measured", scan)
    assert report["measured"]["shift_mm"][2] == pytest.approx(19, abs=2)
    assert (tmp_path / "out" / "scan.png").exists()


def test_json_is_one_object_on_stdout(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = field(tmp_path, "--focus", B, "--json")
    assert json.loads(capsys.readouterr().out) == report


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--focus", "302,225,10"], "out of reach of unit 1"),
        (["--drive", "0"], "--drive is 0"),
        (["--focus", B, "--pose-error", "3:0,0,20"], "there are units 1 to 2"),
        (["--focus", B, "--error-budget", "0"], "at least 1 draw"),
        (["--focus", B, "--measured", "none.csv"], "cannot be read"),
        (["--focus", B, "--calibration", "none.yaml"], "no such file"),
        (["--focus", B, "--step-mm", "0"], "positive lengths"),
        (["--focus", B, "--width-mm", "inf"], "positive lengths"),
        (["--focus", B, "--step-mm", "1e-9"], "points"),
        (["--focus", B, "--width-mm", "1e9"], "points"),
        (["--rig", "emulatd"], "did you mean"),
    ],
)
def test_bad_input_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["field", "--out", str(tmp_path), *COARSE, *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_calibration_of_other_units_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shipped = find_file("emulated", kind="rig", folder="rigs").with_name("emulated-calibration.yaml")
    other = tmp_path / "other.yaml"
    other.write_text(shipped.read_text().replace("name: unit 2", "name: unit 7"))
    assert main(["field", "--focus", B, "--out", str(tmp_path), "--calibration", str(other)]) == 2
    assert "a calibration of unit 1, unit 7; the rig's units are unit 1, unit 2" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [["--focus", "1,2"], ["--focus", "1,2,nan"], ["--pose-error", "0,0,20"], ["--pose-error", "2:1"]],
)
def test_a_malformed_argument_is_told(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["field", *arguments])
    assert caught.value.code == 2
    assert "error: argument" in capsys.readouterr().err
