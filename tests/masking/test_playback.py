"""Whatever blocks a sound card asks for, it gets the loop, ramped in and out."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from autd_trials.masking.noise import raised_cosine
from autd_trials.masking.playback import Playback

LOOP = np.random.default_rng(1).normal(size=500).astype(np.float32)
LEAD = 150
RAMP = 100
blocks = st.lists(st.integers(1, 400), min_size=1, max_size=20)


def _play(playback: Playback, sizes: list[int]) -> NDArray[np.float32]:
    played = []
    for size in sizes:
        block = np.full((size, 2), np.nan, dtype=np.float32)
        playback.fill(block)
        played.append(block)
    return np.concatenate(played)


def _endless(samples: int) -> NDArray[np.float32]:
    """What is played without an end, made in one piece."""
    noise = np.tile(LOOP, samples // len(LOOP) + 1)
    noise[:RAMP] *= raised_cosine(RAMP)
    return np.concatenate([np.zeros(LEAD, dtype=np.float32), noise])[:samples]


@given(blocks)
def test_blocks_join_into_the_loop_on_both_channels(sizes: list[int]) -> None:
    played = _play(Playback(LOOP, lead_samples=LEAD, ramp_samples=RAMP), sizes)
    expected = _endless(sum(sizes))
    assert np.array_equal(played[:, 0], expected)
    assert np.array_equal(played[:, 1], expected)


@given(before=blocks, after=st.lists(st.integers(1, 400), max_size=20))
def test_stop_ramps_out_and_then_is_silent(before: list[int], after: list[int]) -> None:
    playback = Playback(LOOP, lead_samples=LEAD, ramp_samples=RAMP)
    _play(playback, before)
    playback.stop()
    assert not playback.ended
    faded = _play(playback, [*after, RAMP, 50])[:, 0]

    endless = _endless(sum(before) + len(faded))[sum(before) :]
    assert np.allclose(faded[:RAMP], endless[:RAMP] * raised_cosine(RAMP)[::-1], atol=1e-6)
    assert not faded[RAMP:].any()
    assert playback.ended


def test_ended_only_when_the_whole_ramp_was_handed_out() -> None:
    playback = Playback(LOOP, lead_samples=LEAD, ramp_samples=RAMP)
    playback.stop()
    _play(playback, [RAMP - 1])
    assert not playback.ended
    _play(playback, [1])
    assert playback.ended


def test_blocks_longer_than_the_loop_wrap() -> None:
    played = _play(Playback(LOOP, lead_samples=LEAD, ramp_samples=RAMP), [3 * len(LOOP) + 7])
    assert np.array_equal(played[:, 0], _endless(3 * len(LOOP) + 7))
