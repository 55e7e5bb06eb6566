"""Track and wand files: each mistake has its own message."""

from pathlib import Path

import numpy as np
import pytest

from autd_trials.calibration.track import read_track, read_wand
from autd_trials.errors import UsageError

HEADER = "t_s,x_mm,y_mm,z_mm"
LINES = [f"{0.1 * n:.1f},{n},0,1000" for n in range(12)]


def write(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "unit1.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_track_is_read(tmp_path: Path) -> None:
    track = read_track(write(tmp_path, HEADER + ",quality", *(line + ",0.9" for line in LINES)), "unit 1")
    assert track.name == "unit 1"
    assert track.time_s[3] == pytest.approx(0.3)
    assert track.points_mm[3] == pytest.approx([3, 0, 1000])


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["t,x,y,z", *LINES], r"unit1\.csv:1: the columns t_s, x_mm, y_mm, z_mm are missing; there are t, x"),
        ([], r"unit1\.csv:1: the track is empty"),
        ([HEADER, *LINES[:4], "0.4,nan,0,1000", *LINES[5:]], r"unit1\.csv:6: x_mm is 'nan'"),
        ([HEADER, *LINES[:4], "0.4,4,0", *LINES[5:]], r"unit1\.csv:6: 3 cells under 4 column names"),
        ([HEADER, *LINES[:6], LINES[4], *LINES[7:]], r"unit1\.csv:8: t_s is 0.4 after 0.5"),
        ([HEADER, LINES[0], *LINES], r"unit1\.csv:3: t_s is 0.0 after 0.0, but must rise"),
        ([HEADER], "unit 1 saw the target 0 times"),
        ([HEADER, *(line.replace("1000", "1") for line in LINES)], "looks like metres"),
        ([HEADER, *(line.replace("1000", "1e6") for line in LINES)], "looks like micrometres"),
    ],
)
def test_a_bad_track_is_told_with_its_line(tmp_path: Path, lines: list[str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        read_track(write(tmp_path, *lines), "unit 1")


def test_a_missing_track_and_one_that_is_no_text(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="the track cannot be read"):
        read_track(tmp_path / "none.csv", "unit 1")
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="the track cannot be read"):
        read_track(binary, "unit 1")


WAND_HEADER = "ax_mm,ay_mm,az_mm,bx_mm,by_mm,bz_mm"


def wand_lines(lengths_mm: list[float]) -> list[str]:
    return [f"{-length / 2},0,1000,{length / 2},0,1000" for length in lengths_mm]


def test_wrong_lengths_of_a_wand_are_left_out(tmp_path: Path) -> None:
    generator = np.random.default_rng(1)
    lengths = [*generator.normal(300, 1, 40), 900.0]
    wand = read_wand(write(tmp_path, WAND_HEADER, *wand_lines(lengths)), 300)
    found = np.linalg.norm(wand.first_mm - wand.second_mm, axis=1)
    assert 38 <= len(found) <= 40
    assert found.max() < 310


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (wand_lines([300.0] * 5), "the wand was seen 5 times"),
        (wand_lines([250.0] * 20), None),
        (wand_lines([150.0] * 20), "the markers are 150 mm apart, the wand is 300 mm long"),
    ],
)
def test_a_bad_wand_file_is_told(tmp_path: Path, lines: list[str], message: str | None) -> None:
    path = write(tmp_path, WAND_HEADER, *lines)
    if message is None:
        assert len(read_wand(path, 300).first_mm) == len(lines)
        return
    with pytest.raises(UsageError, match=message):
        read_wand(path, 300)
