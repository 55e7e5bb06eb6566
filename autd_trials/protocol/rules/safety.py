"""What a protocol must keep of its own limits; the rig's limits are asked by whoever knows the rig."""

from collections.abc import Iterator

from pydantic_core import InitErrorDetails

from autd_trials.protocol.conditions import all_factors, combinations, numbers
from autd_trials.protocol.rules.fault import fault
from autd_trials.protocol.schema import Protocol
from autd_trials.stimulus import duty_of_equal_bursts, total_exposure_s


def session_exposure_s(protocol: Protocol) -> float:
    """Return the sum of drive^2 x duration over a session's stimuli, in s at full drive."""
    stimuli = (protocol.stimulus_for(conditions) for conditions in combinations(all_factors(protocol)))
    return protocol.repetitions * total_exposure_s(stimuli)


def safety_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield stimuli and sums of stimuli that would pass the protocol's own limits.

    All levels must be ones that the stimulus allows.
    """
    yield from _drive_faults(protocol)
    yield from _duration_faults(protocol)
    yield from _duty_faults(protocol)
    yield from _exposure_faults(protocol)


def _drive_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    for location, drive in numbers(protocol, "drive"):
        if excess := protocol.safety.excess("largest_drive", drive):
            message = f"the drive {drive:g} is over safety.largest_drive ({excess.allowed:g})"
            yield fault(location, f"{message}; lower the one or raise the other")


def _duration_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    window_s = protocol.timing.response_window_s
    for location, duration_s in numbers(protocol, "duration_s"):
        if excess := protocol.safety.excess("longest_burst_s", duration_s):
            message = f"the burst of {duration_s:g} s is over safety.longest_burst_s ({excess.allowed:g})"
            yield fault(location, f"{message}; shorten the one or raise the other")
        if duration_s > window_s:
            message = f"the burst of {duration_s:g} s outlasts timing.response_window_s ({window_s:g})"
            yield fault(location, f"{message}; shorten the one or lengthen the other")


def _duty_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    timing = protocol.timing
    burst_s = max(duration_s for _, duration_s in numbers(protocol, "duration_s"))
    pause_s = timing.pauses_us[0] / 1e6
    share = duty_of_equal_bursts(burst_s, max(burst_s, timing.response_window_s) + pause_s)
    if excess := protocol.safety.excess("largest_duty", share):
        message = (
            f"bursts of {burst_s:g} s, windows of {timing.response_window_s:g} s and pauses of"
            f" {pause_s:g} s make a duty of {share:.3g}, which is over {excess.allowed:g}"
        )
        yield fault(("safety", "largest_duty"), f"{message}; lengthen the pauses or raise the limit")


def _exposure_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    exposure_s = session_exposure_s(protocol)
    message = f"the session's stimuli sum up to {exposure_s:g} s at full drive"
    if excess := protocol.safety.excess("session_exposure_s", exposure_s):
        message += f", which is over {excess.allowed:g}; plan fewer stimuli or raise the limit"
        yield fault(("safety", "session_exposure_s"), message)
    elif excess := protocol.safety.excess("daily_exposure_s", exposure_s):
        message += f", which is over a participant's {excess.allowed:g} s in 24 h"
        yield fault(("safety", "daily_exposure_s"), f"{message}; plan fewer stimuli or raise the limit")
