"""Adjusting a family of p values for their number.

None marks a test that could not be made. Such tests are left out before adjusting, so that they do not count.
"""

import itertools
from collections.abc import Sequence
from typing import Literal

Method = Literal["bonferroni", "holm", "hochberg", "benjamini_hochberg"]

METHODS: dict[Method, str] = {
    "bonferroni": "each p times the number of tests; controls the chance of any false finding",
    "holm": "step-down (S. Holm, 1979, Scand. J. Stat. 6, 65-70); controls the same and finds more",
    "hochberg": "step-up (Y. Hochberg, 1988, Biometrika 75, 800-802); needs independent or positively "
    "dependent tests",
    "benjamini_hochberg": "Y. Benjamini and Y. Hochberg (1995), J. R. Stat. Soc. B 57, 289-300; controls the "
    "expected share of false ones among the findings, which is less",
}
"""The methods, and what each controls."""


def holm(p_values: Sequence[float | None]) -> list[float | None]:
    """Adjust by Holm's method: that of the planned comparisons."""
    return adjusted(p_values, "holm")


def adjusted(p_values: Sequence[float | None], method: Method) -> list[float | None]:
    """Adjust a family of p values.

    Parameters
    ----------
    p_values
        The family; None for a test that could not be made.
    method
        One of `METHODS`.

    Returns
    -------
    list of float or None
        Adjusted p values in the order given, at most 1.
    """
    made = sorted((p, place) for place, p in enumerate(p_values) if p is not None)
    raised = [p * _factor(method, rank, len(made)) for rank, (p, _) in enumerate(made)]
    if method == "holm":
        raised = list(itertools.accumulate(raised, max))
    elif method != "bonferroni":
        raised = list(itertools.accumulate(reversed(raised), min))[::-1]
    result: list[float | None] = [None] * len(p_values)
    for value, (_, place) in zip(raised, made, strict=True):
        result[place] = min(1.0, value)
    return result


def _factor(method: Method, rank: int, count: int) -> float:
    """Return what the p of a rank (from 0, the smallest) is multiplied by."""
    if method == "bonferroni":
        return count
    return count / (rank + 1) if method == "benjamini_hochberg" else count - rank
