"""Whether a protocol keeps to the safety limits that it states itself."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pydantic_core import InitErrorDetails

from autd_trials.protocol.checks import ROUNDING, fault
from autd_trials.protocol.conditions import all_factors, combinations, numbers
from autd_trials.stimulus import duty_of_equal_bursts, total_exposure_s

if TYPE_CHECKING:
    from autd_trials.protocol.schema import Protocol


def session_exposure_s(protocol: "Protocol") -> float:
    """Return the sum of drive^2 x duration over a session's stimuli, in s at full drive."""
    stimuli = (protocol.stimulus_for(conditions) for conditions in combinations(all_factors(protocol)))
    return protocol.repetitions * total_exposure_s(stimuli)


def safety_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    """Yield stimuli and sums of stimuli that would pass the protocol's own limits.

    All levels must be ones that the stimulus allows.
    """
    yield from _drive_faults(protocol)
    yield from _duration_faults(protocol)
    yield from _duty_faults(protocol)
    exposure_s, limit_s = session_exposure_s(protocol), protocol.safety.session_exposure_s
    if exposure_s > limit_s * ROUNDING:
        message = f"the session's stimuli sum up to {exposure_s:g} s at full drive, which is over {limit_s:g}"
        yield fault(("safety", "session_exposure_s"), f"{message}; plan fewer stimuli or raise the limit")


def _drive_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    largest = protocol.safety.largest_drive
    for location, drive in numbers(protocol, "drive"):
        if drive > largest:
            message = f"the drive {drive:g} is over safety.largest_drive ({largest:g})"
            yield fault(location, f"{message}; lower the one or raise the other")
        if drive == 0:
            message = "a stimulus of drive 0 is a catch trial"
            yield fault(location, f"{message}; ask for catch trials by catch_trials_per_block")


def _duration_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    longest_s, window_s = protocol.safety.longest_burst_s, protocol.timing.response_window_s
    for location, duration_s in numbers(protocol, "duration_s"):
        if duration_s > longest_s:
            message = f"the burst of {duration_s:g} s is over safety.longest_burst_s ({longest_s:g})"
            yield fault(location, f"{message}; shorten the one or raise the other")
        if duration_s > window_s:
            message = f"the burst of {duration_s:g} s outlasts timing.response_window_s ({window_s:g})"
            yield fault(location, f"{message}; shorten the one or lengthen the other")


def _duty_faults(protocol: "Protocol") -> Iterator[InitErrorDetails]:
    timing, limit = protocol.timing, protocol.safety.largest_duty
    burst_s = max(duration_s for _, duration_s in numbers(protocol, "duration_s"))
    share = duty_of_equal_bursts(burst_s, max(burst_s, timing.response_window_s) + timing.pause_min_s)
    if share > limit * ROUNDING:
        message = (
            f"bursts of {burst_s:g} s, windows of {timing.response_window_s:g} s and pauses of"
            f" {timing.pause_min_s:g} s make a duty of {share:.3g}, which is over {limit:g}"
        )
        yield fault(("safety", "largest_duty"), f"{message}; lengthen the pauses or raise the limit")
