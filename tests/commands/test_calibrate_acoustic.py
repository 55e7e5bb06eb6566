"""`autd-trials calibrate --acoustic`, as a person types it."""

from pathlib import Path

import pytest
import yaml

from autd_trials.yamlfile.shipped import find_file
from tests.commands.conftest import Run

SHIPPED = find_file("emulated-calibration", kind="calibration", folder="rigs")


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    """The shipped calibration with unit 2 off by 20 mm in z."""
    content = yaml.safe_load(SHIPPED.read_text())
    content["units"][1]["translation_mm"][2] += 20
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.mark.parametrize("way", [[], ["--amplitude-only"]])
def test_a_simulated_microphone_mends_the_papers_error(
    run: Run, tmp_path: Path, wrong: Path, way: list[str]
) -> None:
    out = tmp_path / "refined.yaml"
    result = run(
        "calibrate",
        "--acoustic",
        f"simulated:{SHIPPED}",
        "--calibration",
        wrong,
        "--out",
        out,
        "--json",
        *way,
    )
    assert result.code == 0
    assert "SIMULATED" in result.err
    assert result.json["changes"][1]["shift_mm"] == pytest.approx(20, abs=0.5)
    assert result.json["predicted_energy"]["low"] > 0.98
    written = yaml.safe_load(out.read_text())
    assert written["made_up"] is True
    assert "refined by" in written["method"]
    true = yaml.safe_load(SHIPPED.read_text())["units"][1]["translation_mm"]
    assert written["units"][1]["translation_mm"] == pytest.approx(true, abs=0.6)


def test_a_calibration_to_start_from_is_needed(run: Run, tmp_path: Path) -> None:
    result = run("calibrate", "--acoustic", "heard.csv", "--out", tmp_path / "c.yaml")
    assert result.code == 2
    assert "give --calibration FILE" in result.err


def test_a_missing_measurement_is_told(run: Run, tmp_path: Path, wrong: Path) -> None:
    result = run(
        "calibrate", "--acoustic", tmp_path / "none.csv", "--calibration", wrong, "--out", tmp_path / "c.yaml"
    )
    assert result.code == 2
    assert "cannot be read" in result.err
