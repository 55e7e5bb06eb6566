"""Random choices that come out the same on every machine, Python version and numpy version."""

import hashlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from numpy.random import PCG64

T = TypeVar("T")
_WORD_BITS = 64


class Draws:
    """A stream of random choices, given by words and numbers.

    The bits are the raw output of PCG64 (O'Neill 2014, XSL-RR), which numpy promises never to change
    (NEP 19); what numpy makes of them may change, so everything above the bits is done here. The generator's
    state and increment are the two halves of a SHA-256.

    Parameters
    ----------
    key
        Anything that tells one stream from another; the parts are joined by line feeds as text.
    """

    def __init__(self, *key: str | int) -> None:
        digest = hashlib.sha256("\n".join(map(str, key)).encode()).digest()
        self._bits = _pcg64(
            state=int.from_bytes(digest[:16], "big"), increment=int.from_bytes(digest[16:], "big") | 1
        )

    def below(self, bound: int) -> int:
        """Return one of 0, 1, ..., bound - 1, all equally probable; `bound` is at least 1, of any size."""
        if bound < 1:
            raise ValueError(f"there is no number from 0 to below {bound}")
        bits = (bound - 1).bit_length()
        while (number := self._number(bits)) >= bound:  # refused less than every second time
            pass
        return number

    def choice(self, weights: Iterable[int]) -> int:
        """Return an index with a probability proportional to its weight, a whole number."""
        weights = list(weights)
        remaining = self.below(sum(weights))
        for index, weight in enumerate(weights):
            remaining -= weight
            if remaining < 0:
                return index
        raise AssertionError("the weights add up to their sum")

    def shuffled(self, items: Iterable[T]) -> list[T]:
        """Return the items in one of all orders, all equally probable (Fisher-Yates)."""
        order = list(items)
        for last in range(len(order) - 1, 0, -1):
            other = self.below(last + 1)
            order[last], order[other] = order[other], order[last]
        return order

    def subset(self, items: Sequence[T], size: int) -> list[T]:
        """Return `size` of the items in their order; all such subsets are equally probable."""
        return [items[index] for index in sorted(self.shuffled(range(len(items)))[:size])]

    def _number(self, bits: int) -> int:
        """Return a number of so many random bits, the first word drawn being the most significant."""
        words = -(-bits // _WORD_BITS)
        number = 0
        for _ in range(words):
            number = number << _WORD_BITS | int(self._bits.random_raw())
        return number >> (words * _WORD_BITS - bits)


def _pcg64(state: int, increment: int) -> "PCG64":
    from numpy.random import PCG64

    bits = PCG64(0)
    bits.state = {
        "bit_generator": "PCG64",
        "state": {"state": state, "inc": increment},
        "has_uint32": 0,
        "uinteger": 0,
    }
    return bits
