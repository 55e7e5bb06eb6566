"""What the master keeps: every sample, clocks that differ, gaps, a recording that was cut off."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.calibration.network.recording import (
    Sample,
    UnitRecording,
    master_times,
    recorded_units,
    silences,
    write_track,
)
from autd_trials.calibration.track import read_track
from autd_trials.errors import UsageError


def sample(number: int, offset_s: float = 1000.0, *, seen: bool = True) -> Sample:
    place = (float(number), 2.0, 1000.0) if seen else (math.nan,) * 3
    return Sample(number / 30 + offset_s, number / 30 + 0.002, 7, number, *place, 0.9 * seen)


def recorded(folder: Path, samples: list[Sample], clock: list[tuple[float, float]]) -> None:
    recording = UnitRecording(folder, 1)
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
        UnitRecording(tmp_path, 1)
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
