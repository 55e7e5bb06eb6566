"""What the fields of one part of a protocol must be to each other, each fault at the field to be mended."""

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from pydantic_core import InitErrorDetails, PydanticCustomError

from autd_trials.protocol.conditions import Location, level_text
from autd_trials.yamlfile import did_you_mean

if TYPE_CHECKING:
    from autd_trials.protocol.schema import Factor, Masking, Order, StimulusSpec, Timing

RESERVED_NAMES = frozenset(
    {
        "attempt",
        "block",
        "button",
        "channel",
        "duration",
        "ear_level",
        "emitting_after",
        "emulated",
        "exposure_s",
        "hed",
        "masking",
        "onset",
        "onset_lateness",
        "participant",
        "participant_id",
        "pause_before_s",
        "place",
        "presses_before_onset",
        "presses_in_window",
        "presses_late",
        "response",
        "response_time",
        "run",
        "sample",
        "seed",
        "session",
        "silent_before",
        "simulated",
        "start_margin",
        "stim_file",
        "trial",
        "trial_status",
        "trial_type",
        "underruns",
        "value",
    }
)
"""Columns of the plan's and the records' tables, and what BIDS gives a meaning of its own."""
_MISSING_WORDS = frozenset({"NA", "NaN", "nan", "None", "NULL", "Null", "null", "Inf", "inf"})
ROUNDING = 1 + 1e-9
"""Sums of decimal fractions may come out this much larger than they are."""


def fault(location: Location, message: str) -> InitErrorDetails:
    """Return a fault for `pydantic.ValidationError.from_exception_data`."""
    error = PydanticCustomError("protocol", "{message}", {"message": message})
    return InitErrorDetails(type=error, loc=location, input=None)


def not_missing(word: str) -> str:
    """Refuse a word that programs read from a table as a missing value or a number."""
    if word in _MISSING_WORDS:
        raise ValueError(
            f"{word!r} would be read from a table as a missing value or a number; use another word"
        )
    return word


def stimulus_faults(stimulus: "StimulusSpec") -> Iterator[InitErrorDetails]:
    """Yield ramps that overlap and a burst of less than one period."""
    duration_s, ramp_s, modulation_hz = stimulus.duration_s, stimulus.ramp_s, stimulus.modulation_hz
    if 2 * ramp_s > duration_s:
        yield fault(("ramp_s",), f"two ramps of {ramp_s:g} s do not fit into a burst of {duration_s:g} s")
    if stimulus.waveform != "constant" and duration_s * modulation_hz * ROUNDING < 1:
        message = f"a burst of {duration_s:g} s does not hold one period of {modulation_hz:g} Hz"
        yield fault(("modulation_hz",), message)


def factor_faults(factor: "Factor") -> Iterator[InitErrorDetails]:
    """Yield levels given twice or of two kinds, and sentences about no level."""
    levels = factor.levels
    for index, level in enumerate(levels):
        if level in levels[:index]:
            yield fault(("levels", index), f"the level {level_text(level)} is given twice")
        if isinstance(level, str) != isinstance(levels[0], str):
            yield fault(("levels", index), "numbers and words do not mix in one factor")
    spelled = [level_text(level) for level in levels]
    for key in factor.describe:
        if key not in spelled:
            yield fault(("describe", key), unknown("level", key, spelled))


def factor_name_faults(
    within_block: Mapping[str, "Factor"], between_blocks: Mapping[str, "Factor"], stimulus_fields: set[str]
) -> Iterator[InitErrorDetails]:
    """Yield factors that are both, that nothing would vary or that would clash with a table's column."""
    for place, factors in (("within_block", within_block), ("between_blocks", between_blocks)):
        for name in factors:
            if name in RESERVED_NAMES:
                yield fault(
                    (place, name), f"{name!r} is a column of the tables already; name the factor otherwise"
                )
    for name in within_block:
        if name in between_blocks:
            yield fault(("between_blocks", name), f"{name!r} cannot vary both within and between blocks")
        if name not in stimulus_fields:
            message = (
                f"nothing can vary {name!r} from trial to trial: within a block only the stimulus changes"
            )
            allowed = f"; allowed: {', '.join(sorted(stimulus_fields))}"
            yield fault(("within_block", name), message + allowed + did_you_mean(name, stimulus_fields))


def order_faults(order: "Order") -> Iterator[InitErrorDetails]:
    """Yield settings of the run length that could have no effect."""
    if order.max_run_of is not None and order.max_run_length is None:
        yield fault(("max_run_of",), "max_run_of needs max_run_length")
    if order.max_run_length is not None and order.trials == "fixed":
        yield fault(
            ("max_run_length",), "a fixed order has no choice; max_run_length needs 'trials: shuffled'"
        )


def timing_faults(timing: "Timing") -> Iterator[InitErrorDetails]:
    """Yield pauses the wrong way round."""
    shortest_s, longest_s = timing.pause_min_s, timing.pause_max_s
    if shortest_s > longest_s:
        message = f"pause_max_s ({longest_s:g}) is less than pause_min_s ({shortest_s:g})"
        yield fault(("pause_max_s",), message)


def masking_faults(masking: "Masking") -> Iterator[InitErrorDetails]:
    """Yield a level too many or too few."""
    if (masking.level_dbfs is None) == (masking.level_dba is None):
        yield fault((), "give exactly one of level_dbfs and level_dba")


def unknown(kind: str, word: str, allowed: Iterable[str]) -> str:
    """Return the message about a word that names nothing."""
    known = list(allowed)
    return f"there is no {kind} {word!r}; allowed: {', '.join(known) or 'none'}{did_you_mean(word, known)}"
