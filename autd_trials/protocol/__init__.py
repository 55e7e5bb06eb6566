"""What is to be done: the YAML's schema, loading with line-numbered errors, the plan."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.protocol.load import find_protocol, load_protocol
    from autd_trials.protocol.plan import Plan, PlannedBlock, PlannedTrial, make_plan
    from autd_trials.protocol.schema import Protocol

__all__ = ["Plan", "PlannedBlock", "PlannedTrial", "Protocol", "find_protocol", "load_protocol", "make_plan"]

__getattr__ = lazy(
    __name__,
    {
        "Plan": "plan",
        "PlannedBlock": "plan",
        "PlannedTrial": "plan",
        "Protocol": "schema",
        "find_protocol": "load",
        "load_protocol": "load",
        "make_plan": "plan",
    },
)
