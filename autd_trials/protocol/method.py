"""Adaptive methods: the level of one quantity is chosen anew before each trial, from the answers before.

Every method chooses among the same declared levels, so that each stimulus that may come is known, and was
checked, before the first trial. How a method chooses is in `autd_trials.adaptive`.
"""

from typing import Annotated, Literal

from pydantic import Field

from autd_trials.model import Model

Varied = Literal["drive", "depth", "duration_s", "modulation_hz"]
Steps = Annotated[int, Field(ge=1, le=50)]
Rate = Annotated[float, Field(ge=0.001, le=0.5)]
"""Never 0: one slip would rule out what is true."""

_DIGITS = 6


class Range(Model):
    """The levels: evenly spaced on a logarithmic scale, both ends included."""

    smallest: float = Field(gt=0, description="Smallest level.")
    largest: float = Field(gt=0, description="Largest level; every limit is checked with it.")
    levels: int = Field(ge=3, le=50, description="How many levels, the ends included.")

    @property
    def values(self) -> tuple[float, ...]:
        """The levels in rising order, to six digits, so that tables and logs have them exactly."""
        ratio = self.largest / self.smallest
        inner = (self.smallest * ratio ** (step / (self.levels - 1)) for step in range(1, self.levels - 1))
        return (self.smallest, *(float(f"{value:.{_DIGITS}g}") for value in inner), self.largest)

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest level."""
        return self.smallest, self.largest


class _Method(Model):
    """What all methods say."""

    varies: Varied = Field(description="The field of the stimulus whose level is chosen.")
    range: Range = Field(description="The levels to choose among.")

    @property
    def levels(self) -> tuple[float, ...]:
        """The levels in rising order."""
        return self.range.values


class Staircase(_Method):
    """A staircase: down after some trials felt in a row, up after one not felt.

    With equal steps it is a 1-up-n-down staircase (H. Levitt, 1971, J. Acoust. Soc. Am. 49, 467-477), with
    unequal ones a weighted one (C. Kaernbach, 1991, Percept. Psychophys. 49, 227-229).
    """

    kind: Literal["staircase"] = Field(description="A staircase, plain or weighted.")
    start: float = Field(gt=0, description="Where to begin; the nearest level is taken.")
    felt_to_go_down: int = Field(1, ge=1, le=10, description="n of 1-up-n-down.")
    step_up: Steps = Field(1, description="How many levels up after a trial not felt.")
    step_down: Steps = Field(1, description="How many levels down.")
    step_factors: tuple[Steps, ...] = Field(
        (1,),
        min_length=1,
        max_length=10,
        description="Both steps are multiplied by these, the next with each reversal; the last stays.",
    )

    @property
    def converges_to(self) -> float:
        """The rate of "felt" at which steps up and down are in balance; unequal ones settle near it."""
        return float((self.step_up / (self.step_up + self.step_down)) ** (1 / self.felt_to_go_down))


class QuestPlusMethod(_Method):
    """QUEST+: the level that is expected to tell most about a Weibull function.

    A. B. Watson (2017), J. Vis. 17(3):10. The threshold may lie at the levels, or beyond either end by half
    of their range; all combinations with these slopes and rates are equally likely beforehand.
    """

    kind: Literal["quest_plus"] = Field(description="QUEST+ with a Weibull function.")
    slopes: tuple[Annotated[float, Field(gt=0, le=50)], ...] = Field(
        (1.0, 2.0, 3.0, 4.0, 6.0, 8.0), min_length=1, max_length=30, description="Weibull slopes (beta)."
    )
    guess_rates: tuple[Rate, ...] = Field(
        (0.01, 0.05, 0.1), min_length=1, max_length=20, description="Rates of felt without a stimulus."
    )
    lapse_rates: tuple[Rate, ...] = Field(
        (0.02,), min_length=1, max_length=20, description="Rates of not felt however strong the stimulus."
    )


Method = Annotated[Staircase | QuestPlusMethod, Field(discriminator="kind")]
