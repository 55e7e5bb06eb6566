"""What the master keeps: every sample, clocks that differ, gaps, a recording that was cut off."""

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.calibration.network.recording import (
    Sample,
    UnitRecording,
    clock_jumps,
    master_times,
    recorded_capture,
    recorded_units,
    silences,
    write_track,
)
from autd_trials.calibration.provenance import UNKNOWN, Capture, read_capture
from autd_trials.calibration.track import read_track
from autd_trials.errors import DeviceError, UsageError
from tests.calibration.full_disk import largest_file

CAPTURE = Capture(
    origin="measured", sensor="realsense", serial="73", taken=datetime(2026, 11, 20, tzinfo=UTC)
)


def sample(number: int, offset_s: float = 1000.0, *, seen: bool = True) -> Sample:
    place = (float(number), 2.0, 1000.0) if seen else (math.nan,) * 3
    return Sample(number / 30 + offset_s, number / 30 + 0.002, 7, number, *place, 0.9 * seen)


def recorded(folder: Path, samples: list[Sample], clock: list[tuple[float, float]]) -> None:
    recording = UnitRecording(folder, 1, CAPTURE)
    recording.add(samples)
    for each in clock:
        recording.add_clock(*each)
    recording.close()


def test_stamps_are_moved_to_the_masters_clock_as_its_offset_drifts(tmp_path: Path) -> None:
    recorded(tmp_path, [sample(n) for n in range(300)], [(0.0, -1000.0), (10.0, -1000.01)])
    rows = master_times(tmp_path, 1)
    assert len(rows) == 300
    assert rows[0, 0] == pytest.approx(0, abs=1e-4)
    assert rows[-1, 0] == pytest.approx(299 / 30 - 0.01, abs=1e-4)


def test_a_track_is_made_of_the_sightings_alone_and_can_be_made_again(tmp_path: Path) -> None:
    recorded(tmp_path, [sample(n, seen=n % 3 > 0) for n in range(60)], [(1.0, -1000.0)])
    path = write_track(tmp_path, 1)
    track = read_track(path, "unit 1")
    assert len(track.time_s) == 40
    assert track.points_mm[0] == pytest.approx([1, 2, 1000])
    assert write_track(tmp_path, 1) == path
    path.write_text("something else")
    with pytest.raises(UsageError, match="another track is there already"):
        write_track(tmp_path, 1)


def test_a_restarted_node_whose_stamps_go_back_spoils_nothing(tmp_path: Path) -> None:
    again = [Sample(s.t_raw_s, s.arrival_s + 1, 8, s.sequence, 5, 5, 900, 1) for s in map(sample, range(10))]
    recorded(tmp_path, [sample(n) for n in range(30)] + again, [(0.5, -1000.0)])
    assert (np.diff(master_times(tmp_path, 1)[:, 0]) > 0).all()


def test_gaps_over_half_a_second_are_told(tmp_path: Path) -> None:
    recorded(tmp_path, [sample(n) for n in [*range(30), *range(60, 90), *range(100, 110)]], [])
    assert silences(tmp_path, 1) == [pytest.approx((29 / 30 + 1000, 2 + 1000), abs=1e-6)]


@given(cut=st.integers(0, 4000))
def test_whatever_was_cut_off_the_rest_is_read(tmp_path_factory: pytest.TempPathFactory, cut: int) -> None:
    folder = tmp_path_factory.mktemp("recording")
    recorded(folder, [sample(n) for n in range(50)], [])
    raw = folder / "unit1-raw.csv"
    whole = raw.read_bytes()
    header = whole.index(b"\n") + 1
    kept = whole[: max(header, len(whole) - cut)]
    raw.write_bytes(kept)
    assert len(master_times(folder, 1)) == kept[header:].count(b"\n")


def test_a_recording_is_never_written_over(tmp_path: Path) -> None:
    recorded(tmp_path, [], [])
    with pytest.raises(UsageError, match="exists already"):
        UnitRecording(tmp_path, 1, CAPTURE)
    assert recorded_units(tmp_path) == 1


def test_a_folder_without_recording_and_a_spoilt_one_are_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"unit1-raw\.csv is missing"):
        recorded_units(tmp_path)
    recorded(tmp_path, [sample(1)], [])
    raw = tmp_path / "unit1-raw.csv"
    raw.write_text(raw.read_text() + "1,2,x,4,5,6,7,8\n")
    with pytest.raises(UsageError, match=r"unit1-raw\.csv:3: run is 'x', which is not a finite number"):
        master_times(tmp_path, 1)
    raw.write_text("a,b\n")
    with pytest.raises(UsageError, match=r"unit1-raw\.csv:1: the columns t_raw_s, .* are missing"):
        silences(tmp_path, 1)


def test_a_track_says_which_sensor_took_it_and_when(tmp_path: Path) -> None:
    recorded(tmp_path, [sample(n) for n in range(30)], [(1.0, -1000.0)])
    assert recorded_capture(tmp_path, 1) == CAPTURE
    assert read_capture(write_track(tmp_path, 1)) == CAPTURE


def test_a_recording_of_version_1_is_of_unknown_origin(tmp_path: Path) -> None:
    recorded(tmp_path, [sample(n) for n in range(30)], [(1.0, -1000.0)])
    (tmp_path / "unit1-sensor.json").unlink()
    assert read_capture(write_track(tmp_path, 1)) == UNKNOWN


@pytest.mark.parametrize("text", ["", "{}", "[", '{"origin": "real", "sensor": "x"}'])
def test_a_damaged_note_of_the_sensor_is_told(tmp_path: Path, text: str) -> None:
    recorded(tmp_path, [sample(n) for n in range(30)], [])
    (tmp_path / "unit1-sensor.json").write_text(text)
    with pytest.raises(UsageError, match=r"unit1-sensor\.json: this does not say what was recorded"):
        write_track(tmp_path, 1)


@given(jump_s=st.floats(-1e4, 1e4).filter(lambda jump_s: abs(jump_s) > 0.06))
def test_what_was_seen_while_a_clock_jumped_is_left_out_and_the_rest_is_right(
    tmp_path_factory: pytest.TempPathFactory, jump_s: float
) -> None:
    folder = tmp_path_factory.mktemp("recording")
    before, after = range(150), range(150, 300)  # the clock is set after 5 s, and compared every 2 s
    samples = [*(sample(n) for n in before), *(sample(n, 1000 + jump_s) for n in after)]
    offsets = [(t, -1000.0 if t < 5 else -1000 - jump_s) for t in (0.0, 2.0, 4.0, 6.0, 8.0)]
    recorded(folder, samples, offsets)
    ((start_s, end_s),) = clock_jumps(folder, 1)
    assert (start_s, end_s) == (4.0, 6.0)
    rows = master_times(folder, 1)
    true_s = rows[:, 1] / 30  # x is the sample's number
    assert np.abs(rows[:, 0] - true_s).max() < 1e-6
    assert len(rows) == 300 - 60


def test_a_full_disk_is_told_with_what_is_safe(tmp_path: Path) -> None:
    recording = UnitRecording(tmp_path, 1, CAPTURE)
    recording.add([sample(n) for n in range(20)])
    with largest_file(4096), pytest.raises(DeviceError, match=r"the disk does not take this") as caught:
        recording.add([sample(n) for n in range(20, 200)])
    recording.close()
    assert caught.value.where == str(tmp_path)
    assert "what came before is safe" in str(caught.value.do)
    assert len(master_times(tmp_path, 1)) > 20


def test_a_recording_that_is_moved_away_is_not_written_on(tmp_path: Path) -> None:
    recording = UnitRecording(tmp_path / "r", 1, CAPTURE)
    recording.add([sample(0)])
    (tmp_path / "r").rename(tmp_path / "elsewhere")
    moved = "moved, removed or replaced while it was written"
    with pytest.raises(DeviceError, match=moved) as caught:
        recording.add([sample(1)])
    with pytest.raises(DeviceError, match=moved):
        recording.add_clock(0.0, 0.0)
    recording.close()
    assert caught.value.where == str(tmp_path / "r" / "unit1-raw.csv")
    assert len(master_times(tmp_path / "elsewhere", 1)) == 2, "what came in is in the file that was moved"


@pytest.mark.parametrize("name", ["taken/recording", "r" * 300])
def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path, name: str) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(UsageError, match="cannot be made"):
        UnitRecording(tmp_path / name, 1, CAPTURE)
