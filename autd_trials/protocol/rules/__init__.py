"""The rules of a protocol: what its parts must be to each other, beyond what each field may be.

Only loading a protocol asks them. A log holds the protocol that its session was planned from, and reading it
asks no more than the schema: a rule that is tightened later must not make a study unreadable.
"""

from collections.abc import Iterator

from pydantic import ValidationError
from pydantic_core import InitErrorDetails

from autd_trials.errors import UsageError
from autd_trials.protocol.rules.comparisons import comparison_faults
from autd_trials.protocol.rules.conditions import condition_faults
from autd_trials.protocol.rules.names import name_faults
from autd_trials.protocol.rules.parts import part_faults
from autd_trials.protocol.rules.safety import safety_faults
from autd_trials.protocol.rules.sizes import count_faults, run_length_faults, size_faults
from autd_trials.protocol.schema import Protocol

__all__ = ["check_rules", "faults"]


def check_rules(protocol: Protocol) -> None:
    """Check a protocol that was made in Python; `load_protocol` has done so with those of files.

    Raises
    ------
    UsageError
        The protocol breaks a rule; the message has a line ``place: what is wrong`` for each.
    """
    if found := list(faults(protocol)):
        details = ValidationError.from_exception_data("Protocol", found).errors(include_url=False)
        lines = [f"{'.'.join(map(str, detail['loc']))}: {detail['msg']}" for detail in details]
        raise UsageError("\n".join(lines), do="change the protocol")


def faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield every rule that a protocol breaks, each located at the field to correct."""
    counts = list(count_faults(protocol))
    if counts:
        yield from counts
        return
    yield from part_faults(protocol)
    yield from name_faults(protocol)
    yield from comparison_faults(protocol)
    sizes = list(size_faults(protocol))
    yield from sizes
    if not sizes:  # the following go through all conditions, so there must not be too many
        conditions = list(condition_faults(protocol))
        yield from conditions or safety_faults(protocol)
        yield from run_length_faults(protocol)
