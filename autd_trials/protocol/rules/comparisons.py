"""What planned comparisons must name."""

from collections.abc import Iterator

from pydantic_core import InitErrorDetails

from autd_trials.protocol.conditions import Location, all_factors
from autd_trials.protocol.rules.fault import fault, repeated, unknown
from autd_trials.protocol.schema import Comparison, Protocol
from autd_trials.tables import level_text


def comparison_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield comparisons planned twice, and those of factors and levels that are not there."""
    sides = [
        (each.factor, each.at_each, frozenset({each.first, each.second})) for each in protocol.comparisons
    ]
    for index in repeated(sides):
        message = "this comparison is planned already, perhaps the other way round"
        yield fault(("comparisons", index), message)
    for index, comparison in enumerate(protocol.comparisons):
        yield from _faults(protocol, comparison, ("comparisons", index))


def _faults(protocol: Protocol, comparison: Comparison, location: Location) -> Iterator[InitErrorDetails]:
    factors = all_factors(protocol)
    for key in ("factor", "at_each"):
        name = getattr(comparison, key)
        if name is not None and name not in factors:
            yield fault((*location, key), unknown("factor", name, factors))
    if comparison.at_each == comparison.factor:
        yield fault((*location, "at_each"), "a factor cannot be compared at each of its own levels")
    if comparison.first == comparison.second:
        yield fault((*location, "second"), "a level cannot be compared with itself")
    if comparison.factor in factors:
        levels = factors[comparison.factor].levels
        for key in ("first", "second"):
            level = getattr(comparison, key)
            if level not in levels:
                message = unknown(f"level of {comparison.factor}", level_text(level), map(level_text, levels))
                yield fault((*location, key), message)
