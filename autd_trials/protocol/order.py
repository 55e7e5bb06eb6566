"""Orders of a block's trials: one of all orders that the constraints allow, every one equally probable.

Without a limit on runs that is a shuffle. With one, the orders are counted, never tried out. An order is
built kind by kind. Each kind's trials form runs; the runs of the kinds placed so far make up a sequence in
which runs of one kind may still touch, and each such contact must be filled by a later kind. How many ways
there are to go on from there follows from inclusion and exclusion over touching runs (Carlitz, Scoville and
Vaughan, 1976: words without equal neighbours): let u_k be the generating function of kind k with the runs of
length 1 to L, R = t + ... + t^L, replaced by R / (1 + R), and u the sum over the kinds still to come. A
sequence of N runs with b contacts then is completed in as many ways as the coefficient in u^b / (1 - u)^(N+1)
says, because each contact takes a non-empty word and each other gap any word of the later kinds.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import comb

from autd_trials.errors import UsageError
from autd_trials.protocol.randomness import Draws

Polynomial = list[int]


def random_order(counts: Sequence[int], longest_run: int | None, draws: Draws) -> list[int]:
    """Return the kinds of a block's trials in order.

    Parameters
    ----------
    counts
        Number of trials of each kind.
    longest_run
        How many trials of one kind may follow each other; any number if None.
    draws
        Where the choices come from.

    Returns
    -------
    list[int]
        Indices of kinds. All orders that the limit allows are equally probable.

    Raises
    ------
    UsageError
        No order keeps to the limit.
    """
    if longest_run is None or longest_run >= max(counts, default=0):
        return draws.shuffled(kind for kind, count in enumerate(counts) for _ in range(count))
    if number_of_orders(counts, longest_run) == 0:
        raise UsageError(
            f"no order of {' + '.join(map(str, counts))} trials keeps to runs of {longest_run}",
            do="allow longer runs or change the numbers of trials",
        )
    runs = _arranged_runs(counts, longest_run, draws)
    lengths = [
        iter(_run_lengths(count, runs.count(kind), longest_run, draws)) for kind, count in enumerate(counts)
    ]
    return [kind for kind in runs for _ in range(next(lengths[kind]))]


def number_of_orders(counts: Sequence[int], longest_run: int) -> int:
    """Return how many orders have no run longer than `longest_run`; trials of one kind look alike."""
    return _completions(0, 0, _words(tuple(counts), longest_run)[0])


def _arranged_runs(counts: Sequence[int], longest_run: int, draws: Draws) -> list[int]:
    """Return the kinds of the runs in order; no two neighbours are equal."""
    later_words = _words(tuple(counts), longest_run)
    runs: list[int] = []
    for kind, count in enumerate(counts):
        if count:
            contacts = _contacts(runs)
            parts = _number_of_runs(
                count, longest_run, len(runs), len(contacts), later_words[kind + 1], draws
            )
            runs = _with_kind(runs, contacts, kind, parts, later_words[kind + 1], draws)
    return runs


def _contacts(runs: Sequence[int]) -> list[int]:
    """Return the gaps between equal runs; gap g stands before run g, and the last behind all."""
    return [gap for gap in range(1, len(runs)) if runs[gap - 1] == runs[gap]]


def _number_of_runs(
    count: int, longest_run: int, runs: int, contacts: int, later: Polynomial, draws: Draws
) -> int:
    """Return how many runs a kind forms, given the runs placed so far."""
    together = [
        _completions(runs, contacts, _joined(later, [0] * pieces + [1])) for pieces in range(count + 1)
    ]
    weights = [
        _compositions(count, parts, longest_run)
        * sum(_pieces(parts, pieces) * together[pieces] for pieces in range(1, parts + 1))
        for parts in range(1, count + 1)
    ]
    return 1 + draws.choice(weights)


def _with_kind(
    runs: Sequence[int], contacts: Sequence[int], kind: int, parts: int, later: Polynomial, draws: Draws
) -> list[int]:
    """Return the runs with a further kind's runs placed in gaps, several to a gap where need be."""
    free = sorted(set(range(len(runs) + 1)) - set(contacts))
    choices = [
        (filled, gaps - filled)
        for gaps in range(1, parts + 1)
        for filled in range(max(0, gaps - len(free)), min(gaps, len(contacts)) + 1)
    ]
    after = len(runs) + parts
    ways = {
        left: _completions(after, left, later)
        for left in {len(contacts) - filled + parts - filled - opened for filled, opened in choices}
    }
    weights = [
        comb(len(contacts), filled)
        * comb(len(free), opened)
        * comb(parts - 1, filled + opened - 1)
        * ways[len(contacts) - filled + parts - filled - opened]
        for filled, opened in choices
    ]
    filled, opened = choices[draws.choice(weights)]
    gaps = sorted(draws.subset(contacts, filled) + draws.subset(free, opened))
    cuts = [0, *draws.subset(range(1, parts), len(gaps) - 1), parts]
    in_gap = {gap: after - before for gap, before, after in zip(gaps, cuts[:-1], cuts[1:], strict=True)}
    placed: list[int] = []
    for gap in range(len(runs) + 1):
        placed += [kind] * in_gap.get(gap, 0) + list(runs[gap : gap + 1])
    return placed


def _run_lengths(count: int, parts: int, longest_run: int, draws: Draws) -> list[int]:
    """Return the lengths of a kind's runs; all that add up to the count are equally probable."""
    lengths = []
    for left in range(parts - 1, -1, -1):
        lengths.append(
            1
            + draws.choice(
                _compositions(count - length, left, longest_run) for length in range(1, longest_run + 1)
            )
        )
        count -= lengths[-1]
    return lengths


@lru_cache(maxsize=4)  # the blocks of a session have the same counts
def _words(counts: tuple[int, ...], longest_run: int) -> list[Polynomial]:
    """Return, from each kind on, the signed numbers of words of all its and the later kinds' trials.

    Item m of a polynomial belongs to u^m: the words of m pieces, a piece being any number of touching runs.
    The last polynomial, of no kinds, is the empty word.
    """
    words: list[Polynomial] = [[1]]
    for count in reversed(counts):
        ways = [_compositions(count, parts, longest_run) for parts in range(count + 1)]
        pieces = [
            sum(ways[parts] * _pieces(parts, number) for parts in range(number, count + 1) if ways[parts])
            for number in range(count + 1)
        ]
        words.insert(0, _joined(words[0], pieces))
    return words


def _joined(one: Polynomial, other: Polynomial) -> Polynomial:
    """Return the words made by mixing words of two sets of kinds piece by piece."""
    joined = [0] * (len(one) + len(other) - 1)
    for first, ways in enumerate(one):
        for second, more in enumerate(other):
            if ways and more:
                joined[first + second] += comb(first + second, first) * ways * more
    return joined


def _completions(runs: int, contacts: int, later: Polynomial) -> int:
    """Return in how many ways later kinds complete a sequence: the coefficient in u^b / (1 - u)^(N+1)."""
    return sum(
        comb(runs + pieces - contacts, runs) * ways
        for pieces, ways in enumerate(later)
        if ways and pieces >= contacts
    )


def _pieces(parts: int, pieces: int) -> int:
    """Return the signed number of ways to join runs to pieces: t^parts in (t / (1 + t))^pieces."""
    if parts == 0 or pieces == 0:
        return int(parts == pieces)
    return _sign(parts - pieces) * comb(parts - 1, pieces - 1)


def _compositions(total: int, parts: int, largest: int) -> int:
    """Return in how many ways a number is a sum of so many ordered parts of 1 to `largest`."""
    if total < parts or total > parts * largest:
        return 0
    if parts == 0:
        return 1
    return sum(
        _sign(over) * comb(parts, over) * comb(total - over * largest - 1, parts - 1)
        for over in range((total - parts) // largest + 1)
    )


def _sign(power: int) -> int:
    return -1 if power % 2 else 1
