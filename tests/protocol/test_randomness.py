import hashlib
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chisquare

from autd_trials.protocol.randomness import Draws


class PlainPcg64:
    """PCG64 (XSL-RR 128/64) as its author published it, in plain integers."""

    MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
    MASK = (1 << 128) - 1

    def __init__(self, state: int, increment: int) -> None:
        self.state, self.increment = state, increment

    def next_word(self) -> int:
        self.state = (self.state * self.MULTIPLIER + self.increment) & self.MASK
        folded = (self.state >> 64) ^ (self.state & (2**64 - 1))
        turn = self.state >> 122
        return ((folded >> turn) | (folded << (-turn & 63))) & (2**64 - 1)


def test_the_bits_are_those_of_an_independent_generator() -> None:
    digest = hashlib.sha256(b"trials\n1\n2").digest()
    plain = PlainPcg64(int.from_bytes(digest[:16], "big"), int.from_bytes(digest[16:], "big") | 1)
    draws = Draws("trials", 1, 2)
    assert [draws.below(2**64) for _ in range(100)] == [plain.next_word() for _ in range(100)]


def test_the_stream_never_changes() -> None:
    """Recorded plans must be made again by every later version."""
    draws = Draws("pinned", 7)
    assert [draws.below(1000) for _ in range(8)] == [954, 458, 858, 727, 884, 334, 61, 487]
    assert draws.shuffled(range(8)) == [7, 5, 0, 2, 4, 6, 1, 3]


@given(bound=st.integers(1, 2**200))
def test_numbers_stay_below_their_bound(bound: int) -> None:
    draws = Draws("bound", bound)
    assert all(0 <= draws.below(bound) < bound for _ in range(5))


@pytest.mark.parametrize("bound", [2, 3, 6, 7, 10])
def test_numbers_are_evenly_spread(bound: int) -> None:
    draws = Draws("even", bound)
    counts = Counter(draws.below(bound) for _ in range(20_000))
    assert chisquare([counts[number] for number in range(bound)]).pvalue > 1e-4


def test_choices_follow_their_weights() -> None:
    draws = Draws("weights")
    weights = [1, 0, 5, 10**30, 2 * 10**30]
    counts = Counter(draws.choice(weights) for _ in range(3000))
    assert set(counts) == {3, 4}
    assert chisquare([counts[3], counts[4]], [1000, 2000]).pvalue > 1e-4
    small = Counter(draws.choice([1, 0, 3]) for _ in range(4000))
    assert chisquare([small[0], small[2]], [1000, 3000]).pvalue > 1e-4


def test_every_permutation_is_equally_probable() -> None:
    draws = Draws("permutations")
    counts = Counter(tuple(draws.shuffled("abcd")) for _ in range(24 * 400))
    assert len(counts) == 24
    assert chisquare(list(counts.values())).pvalue > 1e-4


def test_every_subset_is_equally_probable_and_in_order() -> None:
    draws = Draws("subsets")
    counts = Counter(tuple(draws.subset("abcde", 2)) for _ in range(10 * 400))
    assert len(counts) == 10
    assert all(list(subset) == sorted(subset) for subset in counts)
    assert chisquare(list(counts.values())).pvalue > 1e-4


def test_other_keys_give_other_streams() -> None:
    streams = [Draws(*key) for key in (("a", 1), ("a", 2), ("b", 1), ("a1",), ("a", 1, 1))]
    assert len({draws.below(2**64) for draws in streams}) == len(streams)


def test_there_is_no_number_below_one() -> None:
    with pytest.raises(ValueError, match="below 0"):
        Draws("x").below(0)
