"""The rule of a protocol's method.

What comes next depends on the complete trials alone. So nothing needs to be kept but the log, and a session
that is resumed goes on as if it had not been interrupted.
"""

from collections.abc import Sequence
from typing import Protocol

from autd_trials.adaptive.answers import Answer, Estimate
from autd_trials.adaptive.quest_plus import QuestPlusRule
from autd_trials.adaptive.staircase import StaircaseRule
from autd_trials.protocol.method import Method, Staircase


class Rule(Protocol):
    """How a method chooses the levels of an adaptive run: of the trials of one condition in one block."""

    def next_level(self, answers: Sequence[Answer]) -> float:
        """Return the level of the next trial, from the run's answers in the order in which they came."""

    def estimate(self, answers: Sequence[Answer]) -> Estimate:
        """Return the threshold that the answers tell."""


def rule_of(method: Method) -> Rule:
    """Return a method's rule."""
    return StaircaseRule(method) if isinstance(method, Staircase) else QuestPlusRule(method)
