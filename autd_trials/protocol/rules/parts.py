"""What the fields of one part of a protocol must be to each other."""

from collections.abc import Iterator

from pydantic_core import InitErrorDetails

from autd_trials.protocol.conditions import all_factors
from autd_trials.protocol.method import Method, QuestPlusMethod, Range, Staircase
from autd_trials.protocol.rules.fault import fault, repeated
from autd_trials.protocol.rules.names import SMALLEST_LEVEL
from autd_trials.protocol.schema import Masking, Order, Protocol, Timing

MOST_PARAMETERS = 20_000
"""Combinations of threshold, slope, guess and lapse rate that QUEST+ can weigh before each trial."""


def part_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield what is wrong within the parts of a protocol."""
    yield from _order_faults(protocol.order)
    yield from _timing_faults(protocol.timing)
    if protocol.masking is not None:
        yield from _masking_faults(protocol.masking)
    if protocol.method is not None:
        yield from _method_faults(protocol.method)
        if protocol.method.varies in all_factors(protocol):
            message = f"{protocol.method.varies!r} is a factor already; only one can choose its level"
            yield fault(("method", "varies"), message)


def _order_faults(order: Order) -> Iterator[InitErrorDetails]:
    """Yield settings of the run length that could have no effect."""
    if order.max_run_of is not None and order.max_run_length is None:
        yield fault(("order", "max_run_of"), "max_run_of needs max_run_length")
    if order.max_run_length is not None and order.trials == "fixed":
        message = "a fixed order has no choice; max_run_length needs 'trials: shuffled'"
        yield fault(("order", "max_run_length"), message)


def _timing_faults(timing: Timing) -> Iterator[InitErrorDetails]:
    shortest_s, longest_s = timing.pause_min_s, timing.pause_max_s
    if shortest_s > longest_s:
        message = f"pause_max_s ({longest_s:g}) is less than pause_min_s ({shortest_s:g})"
        yield fault(("timing", "pause_max_s"), message)


def _masking_faults(masking: Masking) -> Iterator[InitErrorDetails]:
    if (masking.level_dbfs is None) == (masking.level_dba is None):
        yield fault(("masking",), "give exactly one of level_dbfs and level_dba")


def _method_faults(method: Method) -> Iterator[InitErrorDetails]:
    yield from _range_faults(method.range)
    if isinstance(method, Staircase):
        yield from _staircase_faults(method)
    else:
        yield from _quest_plus_faults(method)


def _range_faults(levels: Range) -> Iterator[InitErrorDetails]:
    if levels.smallest >= levels.largest:
        message = f"largest ({levels.largest:g}) is not over smallest ({levels.smallest:g})"
        yield fault(("method", "range", "largest"), message)
    if levels.smallest < SMALLEST_LEVEL:
        message = f"smallest ({levels.smallest:g}) is less than {SMALLEST_LEVEL:g}"
        yield fault(("method", "range", "smallest"), message)


def _staircase_faults(method: Staircase) -> Iterator[InitErrorDetails]:
    smallest, largest = method.range.ends
    if not smallest <= method.start <= largest:
        message = f"start ({method.start:g}) is not within {smallest:g} to {largest:g}"
        yield fault(("method", "start"), message)


def _quest_plus_faults(method: QuestPlusMethod) -> Iterator[InitErrorDetails]:
    """Yield rates that leave nothing to the stimulus, values given twice, and too many combinations."""
    if max(method.guess_rates) + max(method.lapse_rates) >= 1:
        yield fault(("method", "lapse_rates"), "the largest guess and lapse rates sum up to 1 or more")
    for key in ("slopes", "guess_rates", "lapse_rates"):
        values = getattr(method, key)
        for index in repeated(values):
            yield fault(("method", key, index), f"{values[index]:g} is given twice")
    rates = len(method.guess_rates) * len(method.lapse_rates)
    combinations = len(method.slopes) * rates * 2 * method.range.levels
    if combinations > MOST_PARAMETERS:
        message = f"{combinations} combinations of threshold, slope, guess and lapse rate"
        yield fault(("method",), f"{message}; allowed: at most {MOST_PARAMETERS}")
