"""Balanced Latin squares: in which order each participant goes through the blocks."""


def balanced_rows(conditions: int) -> list[list[int]]:
    """Return the orders for one participant after another; after the last one they begin anew.

    Every condition comes equally often at every position, and equally often right after every other one
    (E. J. Williams, 1949, Australian Journal of Scientific Research A 2, 149-168). For an odd number of
    conditions that takes two squares, the second being the first with its rows reversed.

    Positions go first in the balance of a part of the participants: after any number of them, how often a
    condition came at a position differs by at most one between conditions. For even numbers the same holds
    for how often one condition came after another.

    Parameters
    ----------
    conditions
        How many there are, at least 1.

    Returns
    -------
    list[list[int]]
        As many orders as there are conditions, twice as many if their number is odd and more than 1.
    """
    zigzag = [
        (-(position // 2) if position % 2 == 0 else position // 2 + 1) for position in range(conditions)
    ]
    square = [[(start + step) % conditions for step in zigzag] for start in range(conditions)]
    if conditions % 2 == 0 or conditions == 1:
        return square
    return square + [row[::-1] for row in square]
