"""The conditions that a protocol's factors span, and where in the protocol each value stands."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol as Interface

from autd_trials.protocol.schema import Factor, Level, Protocol

Location = tuple[str | int, ...]
"""Keys and indices from the protocol to a value."""


class HasLevels(Interface):
    """A factor, or the ends of what an adaptive method varies."""

    @property
    def levels(self) -> Sequence[Level]:
        """What it may be."""


@dataclass(frozen=True)
class _Ends:
    levels: tuple[float, float]


def combinations(factors: Mapping[str, HasLevels]) -> Iterator[dict[str, Level]]:
    """Yield every combination of the factors' levels in declared order; one empty one without factors."""
    for levels in itertools.product(*(factor.levels for factor in factors.values())):
        yield dict(zip(factors, levels, strict=True))


def all_factors(protocol: Protocol) -> dict[str, Factor]:
    """Return all factors by name, those within blocks first."""
    return {**protocol.factors.within_block, **protocol.factors.between_blocks}


def names_varied(protocol: Protocol) -> tuple[str, ...]:
    """Return the names of all factors, and behind them what an adaptive method varies."""
    names = dict.fromkeys(all_factors(protocol))
    return (*names,) if protocol.method is None else (*(names | {protocol.method.varies: None}),)


def fields_varied(protocol: Protocol) -> dict[str, HasLevels]:
    """Return all factors and, of what an adaptive method varies, the ends: as they are, so is all between."""
    factors: dict[str, HasLevels] = {**all_factors(protocol)}
    method = protocol.method
    return factors if method is None else {method.varies: _Ends(method.range.ends), **factors}


def level_location(protocol: Protocol, name: str, level: Level) -> Location:
    """Return where a level of a factor, or an end of what a method varies, is declared."""
    factor = all_factors(protocol).get(name)
    if factor is None:
        largest = protocol.method is not None and level == protocol.method.range.largest
        return ("method", "range", "largest" if largest else "smallest")
    place = "within_block" if name in protocol.factors.within_block else "between_blocks"
    return ("factors", place, name, "levels", factor.levels.index(level))


def values(protocol: Protocol, field: str) -> list[tuple[Location, Level]]:
    """Return the values that a field of the stimulus takes in the protocol, each with its place.

    Of what an adaptive method varies these are the ends. A catch trial takes what varies within blocks from
    the stimulus, but for its drive, which is 0.
    """
    varied = fields_varied(protocol).get(field)
    as_declared: list[tuple[Location, Level]] = [(("stimulus", field), getattr(protocol.stimulus, field))]
    if varied is None:
        return as_declared
    levels = [(level_location(protocol, field, level), level) for level in varied.levels]
    by_catch_trials = protocol.catch_trials_per_block > 0 and field in protocol.factors.within_block
    return [*as_declared, *levels] if by_catch_trials and field != "drive" else levels


def numbers(protocol: Protocol, field: str) -> list[tuple[Location, float]]:
    """Return the values of a field that are numbers, each with its place."""
    return [(location, level) for location, level in values(protocol, field) if not isinstance(level, str)]
