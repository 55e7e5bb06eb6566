"""The planned contrast, two levels of a factor within participants, and the one expansion of a plan.

Tests, models, thresholds, interactions, power and figures all take these.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from autd_analysis.data.design import Condition, Design, conditions
from autd_trials.protocol.schema import Level


@dataclass(frozen=True)
class Contrast:
    """Two levels of a factor, of which the second is subtracted from the first.

    Attributes
    ----------
    factor, first, second
        What is compared.
    at
        The level of another factor at which it is compared; empty if over all trials.
    """

    factor: str
    first: Level
    second: Level
    at: Condition = ()

    @property
    def levels(self) -> tuple[Level, Level]:
        """The level subtracted from, and the level subtracted."""
        return self.first, self.second

    @property
    def over(self) -> str | None:
        """The other factor; None if the contrast is over all trials."""
        return self.at[0][0] if self.at else None

    @property
    def overall(self) -> "Contrast":
        """The same levels compared over all trials."""
        return replace(self, at=())

    def takes(self, condition: Condition) -> bool:
        """Return whether a condition is where the levels are compared, whatever its level."""
        return set(self.at) <= set(condition)

    def side(self, level: Level) -> frozenset[tuple[str, Level]]:
        """Return what all conditions of one side have in common."""
        return frozenset({(self.factor, level), *self.at})


def planned_contrasts(design: Design) -> tuple[Contrast, ...]:
    """Return the contrasts that a protocol plans, in its order: one for each level of the other factor."""
    return tuple(
        Contrast(comparison.factor, comparison.first, comparison.second, at)
        for comparison in design.comparisons
        for at in conditions([design.factor(comparison.at_each)] if comparison.at_each else [])
    )


def contrast_families(contrasts: Iterable[Contrast]) -> tuple[tuple[Contrast, ...], ...]:
    """Return the contrasts of the same levels at two or more levels of one other factor, together."""
    families: dict[tuple[Contrast, str], list[Contrast]] = {}
    for contrast in contrasts:
        if contrast.over is not None:
            families.setdefault((contrast.overall, contrast.over), []).append(contrast)
    return tuple(tuple(family) for family in families.values() if len(family) > 1)
