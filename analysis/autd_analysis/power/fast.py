"""The sign-flip and the paired t test of many studies at once; the same p as those of a single study."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CHUNK = 2000
_ROUNDING = 1e-9


def sign_flip_p(differences: NDArray[np.int64], largest: int) -> Array:
    """Return the exact two-sided p of the sign-flip test of every study.

    The sum of n signed whole numbers has the characteristic function prod cos(w d). On enough evenly spaced w
    its tail is a sum over them, without going through the 2**n patterns.

    Parameters
    ----------
    differences
        Whole numbers, such as differences of counts, shape (studies, participants).
    largest
        Bound of their sizes.

    Returns
    -------
    ndarray
        Shape (studies,).
    """
    participants = differences.shape[1]
    cosines, tails = _tables(largest, participants)
    p = np.empty(len(differences))
    for start in range(0, len(differences), _CHUNK):
        part = np.abs(differences[start : start + _CHUNK])
        characteristic = cosines[part[:, 0]]
        for column in range(1, participants):
            characteristic = characteristic * cosines[part[:, column]]
        reached = np.abs(differences[start : start + _CHUNK].sum(axis=1))
        p[start : start + _CHUNK] = np.einsum("sw,sw->s", characteristic, tails[reached])
    return np.clip(p, 0.0, 1.0)


def paired_t_p(differences: NDArray[np.int64]) -> Array:
    """Return the two-sided p of the paired t test of every study; NaN where all differences are equal."""
    from scipy.special import stdtr

    n = differences.shape[1]
    mean, sd = differences.mean(axis=1), differences.std(axis=1, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(sd > 0, mean / sd * np.sqrt(n), np.nan)
    p: Array = 2 * stdtr(n - 1, -np.abs(t))
    return p


def rejected(p: Array, alpha: float) -> NDArray[np.bool_]:
    """Return whether p is at most alpha, whatever rounding made of equal values."""
    return p <= alpha + _ROUNDING


@lru_cache(maxsize=8)
def _tables(largest: int, participants: int) -> tuple[Array, Array]:
    """Return cos(w d) for each size d, and what the tail P(|sum| >= s) takes of each w, for each s.

    P(sum = x) is the mean of phi(w) cos(w x) over 2 reach + 2 frequencies around the circle; phi is even, so
    that half of them do, those between 0 and pi counting twice.
    """
    reach = largest * participants
    around = 2 * reach + 2
    w = 2 * np.pi * np.arange(reach + 2) / around
    weights = np.full(reach + 2, 2.0)
    weights[[0, -1]] = 1.0
    shares = np.cos(np.outer(np.arange(reach + 1), w)) * weights / around
    shares[1:] *= 2  # a sum and its opposite
    tails = shares[::-1].cumsum(axis=0)[::-1]
    return np.cos(np.outer(np.arange(largest + 1), w)), tails
