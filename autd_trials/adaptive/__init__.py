"""Which level comes next: adaptive methods, as functions of the answers so far and of nothing else."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.adaptive.answers import Answer, Estimate
    from autd_trials.adaptive.quest_plus import QuestPlus, QuestPlusRule
    from autd_trials.adaptive.rule import Rule, rule_of
    from autd_trials.adaptive.staircase import StaircaseRule

__all__ = ["Answer", "Estimate", "QuestPlus", "QuestPlusRule", "Rule", "StaircaseRule", "rule_of"]

__getattr__ = lazy(
    __name__,
    {
        "Answer": "answers",
        "Estimate": "answers",
        "QuestPlus": "quest_plus",
        "QuestPlusRule": "quest_plus",
        "Rule": "rule",
        "StaircaseRule": "staircase",
        "rule_of": "rule",
    },
)
