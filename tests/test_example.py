"""The committed example is what its logs make, and says everywhere that it is simulated."""

import shutil
import subprocess
from pathlib import Path

import pandas as pd
import pytest

from autd_trials.cli import main
from tests.conftest import program

EXAMPLE = Path(__file__).parent.parent / "data" / "example" / "chest-catch"
PICTURES = {".png", ".pdf"}
"""Labelled inside, where text search does not see it."""


def test_its_tables_are_made_from_its_logs(tmp_path: Path) -> None:
    copy = tmp_path / "chest-catch"
    shutil.copytree(EXAMPLE / "sourcedata", copy / "sourcedata")
    assert main(["export", str(copy)]) == 0
    made = {p.relative_to(copy): p.read_bytes() for p in copy.rglob("*") if p.is_file() and p.name != ".lock"}
    committed = {
        path.relative_to(EXAMPLE): path.read_bytes()
        for path in EXAMPLE.rglob("*")
        if path.is_file() and "derivatives" not in path.parts and path.name != ".lock"
    }
    assert made == committed


def test_its_results_are_made_from_its_tables(tmp_path: Path) -> None:
    assert main(["analyse", str(EXAMPLE), "--out", str(tmp_path)]) == 0
    committed = EXAMPLE / "derivatives" / "analysis"
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in committed.iterdir()}
    for table in committed.glob("*.tsv"):
        made, kept = (pd.read_csv(folder / table.name, sep="\t") for folder in (tmp_path, committed))
        pd.testing.assert_frame_equal(made, kept, rtol=1e-5, obj=table.name)


def test_it_is_a_valid_data_set() -> None:
    done = subprocess.run([program("bids-validator-deno"), str(EXAMPLE)], capture_output=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    "path",
    [p for p in sorted(EXAMPLE.rglob("*")) if p.is_file() and p.suffix not in PICTURES and p.name[0] != "."],
    ids=lambda path: path.name,
)
def test_every_file_that_a_person_may_open_says_that_it_is_simulated(path: Path) -> None:
    assert "simulated" in path.read_text(encoding="utf-8").lower()
