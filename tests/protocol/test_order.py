import itertools
from collections import Counter
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chisquare

from autd_trials.errors import UsageError
from autd_trials.protocol.order import number_of_orders, random_order
from autd_trials.protocol.randomness import Draws

SMALL = [
    ((2, 2), 1),
    ((3, 2), 1),
    ((3, 2), 2),
    ((4, 1), 2),
    ((2, 2, 2), 1),
    ((3, 2, 1), 2),
    ((4, 2, 1), 2),
    ((3, 3, 1), 1),
    ((2, 0, 3), 2),
    ((5,), 4),
    ((5,), 5),
]


def longest_run(order: Sequence[int]) -> int:
    return max((len(list(run)) for _, run in itertools.groupby(order)), default=0)


def all_orders(counts: Sequence[int], limit: int) -> set[tuple[int, ...]]:
    """Every order that keeps to the limit, tried out one by one."""
    trials = [kind for kind, count in enumerate(counts) for _ in range(count)]
    return {order for order in set(itertools.permutations(trials)) if longest_run(order) <= limit}


@pytest.mark.parametrize(("counts", "limit"), SMALL)
def test_orders_are_counted_right(counts: tuple[int, ...], limit: int) -> None:
    assert number_of_orders(counts, limit) == len(all_orders(counts, limit))


@given(counts=st.lists(st.integers(0, 3), min_size=1, max_size=3), limit=st.integers(1, 3))
def test_orders_are_counted_right_for_any_small_counts(counts: list[int], limit: int) -> None:
    assert number_of_orders(counts, limit) == len(all_orders(counts, limit))


@pytest.mark.parametrize(("counts", "limit"), [pair for pair in SMALL if all_orders(*pair)])
def test_every_order_that_the_limit_allows_is_equally_probable(counts: tuple[int, ...], limit: int) -> None:
    possible = all_orders(counts, limit)
    draws = Draws("uniform", *counts, limit)
    found = Counter(tuple(random_order(counts, limit, draws)) for _ in range(150 * len(possible)))
    assert set(found) == possible
    if len(possible) > 1:
        assert chisquare([found[order] for order in possible]).pvalue > 1e-4


@given(
    counts=st.lists(st.integers(0, 12), min_size=1, max_size=6),
    limit=st.none() | st.integers(1, 5),
    seed=st.integers(0, 1000),
)
def test_an_order_keeps_to_counts_and_limit_or_is_refused(
    counts: list[int], limit: int | None, seed: int
) -> None:
    others = sum(counts) - max(counts)
    if limit is not None and max(counts) > limit * (others + 1):
        with pytest.raises(UsageError, match="no order"):
            random_order(counts, limit, Draws(seed))
        return
    order = random_order(counts, limit, Draws(seed))
    assert [order.count(kind) for kind in range(len(counts))] == counts
    assert limit is None or longest_run(order) <= limit


def test_the_number_of_orders_of_a_large_block_is_that_of_dynamic_programming() -> None:
    """Against a count by states (remaining trials, last kind, run so far)."""
    limit = 2
    ways: Counter[tuple[tuple[int, ...], int, int]] = Counter({((6, 5, 4), -1, 0): 1})
    for _ in range(15):
        after: Counter[tuple[tuple[int, ...], int, int]] = Counter()
        for (left, last, run), number in ways.items():
            for kind, count in enumerate(left):
                now = run + 1 if kind == last else 1
                if count and now <= limit:
                    rest = (*left[:kind], count - 1, *left[kind + 1 :])
                    after[rest, kind, now] += number
        ways = after
    assert number_of_orders((6, 5, 4), limit) == sum(ways.values())
