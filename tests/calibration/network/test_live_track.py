"""The track that guides the hand: whatever a node's clock says and does, its times are the master's."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.calibration.network.live_track import LiveTrack
from autd_trials.calibration.network.recording import Sample

CLOCKS_S = st.floats(-1e6, 1e6)


def samples(numbers: range, clock_s: float, *, run: int = 1, seen: bool = True) -> list[Sample]:
    """Ten a second by the master's clock; x is the sample's number; the node's clock is ahead."""
    x_mm = [float(number) if seen else math.nan for number in numbers]
    return [
        Sample(number / 10 + clock_s, number / 10 + 0.01, run, number, x, 0.0, 1000.0, 1.0)
        for number, x in zip(numbers, x_mm, strict=True)
    ]


def in_parts(track: LiveTrack, taken: list[Sample], offset_s: float, first_offset: int) -> None:
    """Give samples one by one, and with the one of a number and every 20th after it an offset."""
    for place, each in enumerate(taken):
        due = place >= first_offset and (place - first_offset) % 20 == 0
        track.add([each], [(each.arrival_s, offset_s)] if due else [])


def error_s(track: LiveTrack) -> float:
    found = track.track()
    return float(np.abs(found.time_s - found.points_mm[:, 0] / 10).max(initial=0))


@given(clock_s=CLOCKS_S, first_offset=st.integers(0, 60))
def test_sightings_wait_for_the_first_offset_and_none_is_lost(clock_s: float, first_offset: int) -> None:
    track = LiveTrack("unit 2")
    in_parts(track, samples(range(50), clock_s), -clock_s, first_offset)
    expected = 50 if first_offset < 50 else 0
    assert len(track.track().time_s) == expected
    assert error_s(track) < 1e-6


@given(clock_s=CLOCKS_S, jump_s=st.floats(-1e5, 1e5), first_offset=st.integers(0, 19))
def test_a_clock_that_jumps_begins_the_track_anew(clock_s: float, jump_s: float, first_offset: int) -> None:
    track = LiveTrack("unit 2")
    in_parts(track, samples(range(60), clock_s), -clock_s, 0)
    in_parts(track, samples(range(60, 120), clock_s + jump_s), -clock_s - jump_s, first_offset)
    found = track.track()
    assert len(found.time_s) >= 60 - first_offset - 1
    assert (np.diff(found.time_s) > 0).all()
    if abs(jump_s) > 0.06:
        late = found.points_mm[:, 0] >= 60
        assert late.all()
        # stamps that a jump left behind their arrival cannot be told from late ones until the next offset
        wrong = np.abs(found.time_s - found.points_mm[:, 0] / 10) > 1e-6
        assert wrong.sum() <= first_offset


@given(clock_s=CLOCKS_S, first_offset=st.integers(0, 19))
def test_a_node_that_starts_again_by_the_same_clock_loses_nothing(clock_s: float, first_offset: int) -> None:
    track = LiveTrack("unit 2")
    in_parts(track, samples(range(60), clock_s), -clock_s, 0)
    in_parts(track, samples(range(60, 120), clock_s, run=2), -clock_s, first_offset)
    assert len(track.track().time_s) == 120
    assert error_s(track) < 1e-6


def test_frames_without_the_target_are_no_sightings() -> None:
    track = LiveTrack("unit 2")
    track.add(samples(range(5), 0.0, seen=False), [(0.0, 0.0)])
    assert len(track.track().time_s) == 0
