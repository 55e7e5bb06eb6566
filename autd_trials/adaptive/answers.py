"""What the rules of adaptive methods take and give."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Answer:
    """The answer to a complete trial: at which level, and whether it was felt."""

    level: float
    felt: bool


@dataclass(frozen=True)
class Estimate:
    """A threshold as the method itself estimates it.

    Attributes
    ----------
    threshold
        The level that is felt at `rate`; None if the answers do not tell.
    rate
        The rate of "felt" that the threshold is for.
    spread_db
        Standard deviation in dB (20 log10 of the level), of the posterior or over the reversals; None where
        undefined.
    beyond
        1 or -1 where there is no threshold because it lies (or seems to lie) over the largest or under the
        smallest level, else 0.
    note
        Why there is no threshold, or what to know about it.
    """

    threshold: float | None
    rate: float
    spread_db: float | None
    beyond: int = 0
    note: str | None = None
