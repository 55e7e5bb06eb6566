"""What the parts of a protocol must be to each other; each fault stands at the field to be mended."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from pydantic import ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails

from autd_trials.protocol.checks import fault, unknown
from autd_trials.protocol.conditions import (
    Location,
    all_factors,
    combinations,
    fields_varied,
    level_location,
    values,
)
from autd_trials.protocol.safety_checks import safety_faults
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from autd_trials.protocol.schema import Comparison, Factor, Level, Protocol

MOST_TRIALS_PER_BLOCK = 500
MOST_BLOCKS = 20


def protocol_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    """Yield what is wrong between the parts of a protocol."""
    sizes = list(_size_faults(protocol))
    yield from sizes
    if not sizes:  # the following go through all conditions, so there must not be too many
        levels = list(_condition_faults(protocol))
        yield from levels or safety_faults(protocol)
        yield from _run_length_faults(protocol)
    yield from _target_faults(protocol)
    yield from _method_faults(protocol)
    for index, comparison in enumerate(protocol.comparisons):
        if any(_is_the_same(comparison, before) for before in protocol.comparisons[:index]):
            yield fault(
                ("comparisons", index), "this comparison is planned already, perhaps the other way round"
            )
        yield from _comparison_faults(protocol, comparison, ("comparisons", index))


def _size_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    blocks = _number_of_combinations(protocol.factors.between_blocks)
    if blocks > MOST_BLOCKS:
        message = f"these factors make {blocks} blocks; allowed: at most {MOST_BLOCKS}"
        yield fault(("factors", "between_blocks"), message)
    kinds = _number_of_combinations(protocol.factors.within_block)
    trials = kinds * protocol.repetitions + protocol.catch_trials_per_block
    if trials > MOST_TRIALS_PER_BLOCK:
        message = (
            f"{kinds} kinds x {protocol.repetitions} repetitions and {protocol.catch_trials_per_block} catch"
            f" trials are {trials} trials in a block; allowed: at most {MOST_TRIALS_PER_BLOCK}"
        )
        yield fault(("repetitions",), message)


def _number_of_combinations(factors: Mapping[str, "Factor"]) -> int:
    return math.prod(len(factor.levels) for factor in factors.values())


def _target_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    for location, target in values(protocol, "target"):
        if isinstance(target, str) and target not in protocol.targets:
            yield fault(location, unknown("target", target, protocol.targets))


def _condition_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    """Yield levels, and combinations of levels, that the stimulus does not allow, each once."""
    told: set[tuple[Location, str]] = set()
    fields = type(protocol.stimulus).model_fields
    varied = {name: levels for name, levels in fields_varied(protocol).items() if name in fields}
    for conditions in combinations(varied):
        try:
            protocol.stimulus_for(conditions)
        except ValidationError as error:
            for detail in error.errors(include_url=False):
                location = _location(protocol, str(detail["loc"][0]), conditions)
                if (location, detail["msg"]) not in told:
                    told.add((location, detail["msg"]))
                    yield _moved(detail, location)


def _method_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    if protocol.method is None:
        return
    varies = protocol.method.varies
    if varies in all_factors(protocol):
        yield fault(("method", "varies"), f"{varies!r} is a factor already; only one can choose its level")


def _moved(detail: ErrorDetails, location: Location) -> InitErrorDetails:
    if detail["type"] == "protocol":
        return fault(location, detail["msg"])
    return InitErrorDetails(
        type=detail["type"], loc=location, input=detail["input"], ctx=detail.get("ctx", {})
    )


def _run_length_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    order, within = protocol.order, protocol.factors.within_block
    if order.max_run_of not in (None, "trial_type", *within):
        location = ("order", "max_run_of")
        yield fault(location, unknown("factor within blocks", str(order.max_run_of), (*within, "trial_type")))
    elif order.max_run_length is not None:
        sizes = _sizes_of_run_groups(protocol)
        others = sum(sizes) - max(sizes)
        if max(sizes) > order.max_run_length * (others + 1):
            message = (
                f"{max(sizes)} trials of one kind among {others} others cannot keep to runs of"
                f" {order.max_run_length}; allow longer runs or change the numbers of trials"
            )
            yield fault(("order", "max_run_length"), message)


def _sizes_of_run_groups(protocol: "Protocol") -> list[int]:
    """Return how many trials of a block each group has whose runs are limited."""
    within, run_of = protocol.factors.within_block, protocol.order.max_run_of
    stimuli = _number_of_combinations(within) * protocol.repetitions
    if run_of is None:
        sizes = [protocol.repetitions] * (stimuli // protocol.repetitions)
    elif run_of == "trial_type":
        sizes = [stimuli]
    else:
        levels = len(within[run_of].levels)
        sizes = [stimuli // levels] * levels
    return [*sizes, protocol.catch_trials_per_block]


def _is_the_same(one: "Comparison", other: "Comparison") -> bool:
    return (one.factor, one.at_each, {one.first, one.second}) == (
        other.factor,
        other.at_each,
        {other.first, other.second},
    )


def _comparison_faults(
    protocol: "Protocol", comparison: "Comparison", location: Location
) -> Iterator[InitErrorDetails]:
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


def _location(protocol: "Protocol", field: str, conditions: Mapping[str, "Level"]) -> Location:
    """Return where a field of the stimulus gets its value from under some conditions."""
    if field not in conditions:
        return ("stimulus", field)
    return level_location(protocol, field, conditions[field])
