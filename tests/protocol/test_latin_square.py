import itertools
from collections import Counter

import pytest

from autd_trials.protocol.latin_square import balanced_rows

SIZES = range(1, 21)


@pytest.mark.parametrize("conditions", SIZES)
def test_every_row_has_every_condition_once(conditions: int) -> None:
    rows = balanced_rows(conditions)
    assert len(rows) == (conditions if conditions % 2 == 0 or conditions == 1 else 2 * conditions)
    assert all(sorted(row) == list(range(conditions)) for row in rows)


@pytest.mark.parametrize("conditions", SIZES)
def test_every_condition_comes_equally_often_at_every_position(conditions: int) -> None:
    rows = balanced_rows(conditions)
    for column in zip(*rows, strict=True):
        assert set(Counter(column).values()) == {len(rows) // conditions}


@pytest.mark.parametrize("conditions", SIZES)
def test_every_condition_follows_every_other_equally_often(conditions: int) -> None:
    rows = balanced_rows(conditions)
    pairs = Counter(pair for row in rows for pair in itertools.pairwise(row))
    assert len(pairs) == conditions * (conditions - 1)
    assert len(set(pairs.values())) <= 1


@pytest.mark.parametrize("conditions", SIZES)
def test_positions_are_balanced_after_any_number_of_participants(conditions: int) -> None:
    rows = balanced_rows(conditions) * 2
    for participants in range(1, len(rows) + 1):
        for column in zip(*rows[:participants], strict=True):
            counts = [column.count(condition) for condition in range(conditions)]
            assert max(counts) - min(counts) <= 1


@pytest.mark.parametrize("conditions", range(2, 21, 2))
def test_successions_are_balanced_after_any_number_of_participants(conditions: int) -> None:
    rows = balanced_rows(conditions) * 2
    pairs = Counter(dict.fromkeys(itertools.permutations(range(conditions), 2), 0))
    for row in rows:
        pairs.update(itertools.pairwise(row))
        assert max(pairs.values()) - min(pairs.values()) <= 1


def test_the_published_square_of_four() -> None:
    """The standard balanced square of order 4: 1 2 4 3 and its cyclic successors."""
    assert balanced_rows(4) == [[0, 1, 3, 2], [1, 2, 0, 3], [2, 3, 1, 0], [3, 0, 2, 1]]
