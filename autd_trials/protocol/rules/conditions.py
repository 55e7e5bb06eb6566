"""What each condition makes of the stimulus: whether the devices can play it, and tell its levels apart."""

import itertools
from collections.abc import Callable, Iterator, Mapping

from pydantic import ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails

from autd_trials.protocol.conditions import (
    Location,
    all_factors,
    combinations,
    fields_varied,
    level_location,
    values,
)
from autd_trials.protocol.rules.fault import fault, unknown
from autd_trials.protocol.schema import Level, Protocol, StimulusSpec
from autd_trials.stimulus import SAMPLE_RATE_HZ, drive_step, sample_count
from autd_trials.tables import level_text

SHORTEST_BURST_S = 2 / SAMPLE_RATE_HZ
"""A sample that emits, and the last one, which is silent."""

_ROUNDING = 1 + 1e-9
_STEPS: dict[str, Callable[[float], int]] = {
    "drive": drive_step,
    "depth": drive_step,
    "duration_s": sample_count,
    "ramp_s": lambda ramp_s: round(ramp_s * SAMPLE_RATE_HZ),
}
"""What the devices make of a quantity: the drive and each sample are a byte, samples come at 4 kHz."""


def condition_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield levels, and combinations of levels, that make no stimulus, each once."""
    told: set[tuple[Location, str]] = set()
    fields = StimulusSpec.model_fields
    varied = {name: levels for name, levels in fields_varied(protocol).items() if name in fields}
    for conditions in itertools.chain(combinations(varied), _of_catch_trials(protocol)):
        for field, message, detail in _stimulus_faults(protocol, conditions):
            if field == "drive" and len(conditions) < len(varied):
                continue  # a catch trial has its own, 0
            location = _location(protocol, field, conditions)
            if (location, message) not in told:
                told.add((location, message))
                yield fault(location, message) if detail is None else _moved(detail, location)
    for location, target in values(protocol, "target"):
        if isinstance(target, str) and target not in protocol.targets:
            yield fault(location, unknown("target", target, protocol.targets))
    if not told:
        yield from _indistinct_faults(protocol)


def _of_catch_trials(protocol: Protocol) -> Iterator[dict[str, Level]]:
    """Yield the conditions under which catch trials take the stimulus as it is declared."""
    if protocol.catch_trials_per_block and protocol.factors.within_block:
        fields, between = StimulusSpec.model_fields, protocol.factors.between_blocks
        yield from combinations({name: factor for name, factor in between.items() if name in fields})


def _stimulus_faults(
    protocol: Protocol, conditions: Mapping[str, Level]
) -> Iterator[tuple[str, str, ErrorDetails | None]]:
    """Yield the field, the message and, where the schema refused it, the details."""
    try:
        stimulus = protocol.stimulus_for(conditions)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            yield str(detail["loc"][0]), detail["msg"], detail
        return
    duration_s, ramp_s, modulation_hz = stimulus.duration_s, stimulus.ramp_s, stimulus.modulation_hz
    if duration_s < SHORTEST_BURST_S:
        message = (
            f"a burst of {duration_s:g} s is too short; the devices play {SAMPLE_RATE_HZ} samples a second"
        )
        yield "duration_s", message, None
    if 2 * ramp_s > duration_s:
        yield "ramp_s", f"two ramps of {ramp_s:g} s do not fit into a burst of {duration_s:g} s", None
    if stimulus.waveform != "constant" and duration_s * modulation_hz * _ROUNDING < 1:
        message = f"a burst of {duration_s:g} s does not hold one period of {modulation_hz:g} Hz"
        yield "modulation_hz", message, None
    if stimulus.drive == 0:
        message = "a stimulus of drive 0 is a catch trial; ask for catch trials by catch_trials_per_block"
        yield "drive", message, None
    elif drive_step(stimulus.drive) == 0:
        yield "drive", f"a drive of {stimulus.drive:g} is 0 to the devices, which take it as a byte", None


def _indistinct_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield levels that differ in the protocol, but not in what the devices emit."""
    for name, step in _STEPS.items():
        if name in all_factors(protocol):
            yield from _equal_steps(protocol, name, step)
    method = protocol.method
    if method is None or method.range.smallest >= method.range.largest:
        return
    levels = method.levels
    distinct = len(set(map(_STEPS.get(method.varies, float), levels)))
    if distinct < len(levels):
        ends = f"{level_text(levels[0])} to {level_text(levels[-1])}"
        message = f"{len(levels)} levels from {ends} are only {distinct} different ones to the devices"
        yield fault(("method", "range", "levels"), f"{message}; ask for fewer")


def _equal_steps(protocol: Protocol, name: str, step: Callable[[float], int]) -> Iterator[InitErrorDetails]:
    before: dict[int, float] = {}
    for level in all_factors(protocol)[name].levels:
        if isinstance(level, str) or level in before.values():
            continue
        if step(level) in before:
            message = (
                f"{level_text(level)} and {level_text(before[step(level)])} are one level to the devices"
            )
            yield fault(level_location(protocol, name, level), f"{message}; put them further apart")
        before.setdefault(step(level), level)


def _moved(detail: ErrorDetails, location: Location) -> InitErrorDetails:
    return InitErrorDetails(
        type=detail["type"], loc=location, input=detail["input"], ctx=detail.get("ctx", {})
    )


def _location(protocol: Protocol, field: str, conditions: Mapping[str, Level]) -> Location:
    """Return where a field of the stimulus gets its value from under some conditions."""
    if field not in conditions:
        return ("stimulus", field)
    return level_location(protocol, field, conditions[field])
