"""How many blocks and trials there may be, and whether the trials can be ordered as asked."""

import math
from collections.abc import Iterator, Mapping

from pydantic_core import InitErrorDetails

from autd_trials.protocol.rules.fault import fault, unknown
from autd_trials.protocol.schema import Factor, Protocol

MOST_TRIALS_PER_BLOCK = 500
MOST_BLOCKS = 20
MOST_FACTORS = 20
MOST_COMPARISONS = 200


def count_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield lists that are too long for all else about them to be said."""
    for place in ("within_block", "between_blocks"):
        factors = getattr(protocol.factors, place)
        if len(factors) > MOST_FACTORS:
            message = f"these are {len(factors)} factors; allowed: at most {MOST_FACTORS}"
            yield fault(("factors", place), message)
        for name, factor in list(factors.items())[:MOST_FACTORS]:
            sentences, levels = len(factor.describe), len(factor.levels)
            if sentences > levels:
                message = f"these are {sentences} sentences about {levels} levels"
                yield fault(("factors", place, name, "describe"), message)
    if len(protocol.comparisons) > MOST_COMPARISONS:
        message = f"these are {len(protocol.comparisons)} comparisons; allowed: at most {MOST_COMPARISONS}"
        yield fault(("comparisons",), message)


def size_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield too many blocks, and too many trials in one."""
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


def run_length_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield a limit on runs that counts no factor, or that no order keeps to."""
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


def _number_of_combinations(factors: Mapping[str, Factor]) -> int:
    return math.prod(len(factor.levels) for factor in factors.values())


def _sizes_of_run_groups(protocol: Protocol) -> list[int]:
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
