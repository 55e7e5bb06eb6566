"""The conditions that a protocol's factors span, and where in the protocol each value stands."""

import itertools
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from autd_trials.protocol.schema import Factor, Level, Protocol

Location = tuple[str | int, ...]
"""Keys and indices from the protocol to a value."""


def level_text(level: "Level") -> str:
    """Return a level as tables and YAML keys spell it: whole numbers without a decimal point.

    >>> level_text(25.0), level_text(0.5), level_text("inner")
    ('25', '0.5', 'inner')
    """
    return str(int(level)) if isinstance(level, float) and level.is_integer() else str(level)


def combinations(factors: Mapping[str, "Factor"]) -> Iterator[dict[str, "Level"]]:
    """Yield every combination of the factors' levels in declared order; one empty one without factors."""
    for levels in itertools.product(*(factor.levels for factor in factors.values())):
        yield dict(zip(factors, levels, strict=True))


def all_factors(protocol: "Protocol") -> dict[str, "Factor"]:
    """Return all factors by name, those within blocks first."""
    return {**protocol.factors.within_block, **protocol.factors.between_blocks}


def factor_location(protocol: "Protocol", name: str) -> Location:
    """Return where a factor is declared."""
    place = "within_block" if name in protocol.factors.within_block else "between_blocks"
    return ("factors", place, name)


def values(protocol: "Protocol", field: str) -> list[tuple[Location, "Level"]]:
    """Return the values that a field of the stimulus takes in the protocol, each with its place."""
    factor = all_factors(protocol).get(field)
    if factor is None:
        return [(("stimulus", field), getattr(protocol.stimulus, field))]
    location = factor_location(protocol, field)
    return [((*location, "levels", index), level) for index, level in enumerate(factor.levels)]


def numbers(protocol: "Protocol", field: str) -> list[tuple[Location, float]]:
    """Return the values of a field that are numbers, each with its place."""
    return [(location, level) for location, level in values(protocol, field) if not isinstance(level, str)]
