"""Every condition's logit with Firth's penalty, answers taken as independent; separation stated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_analysis.data.design import Condition
from autd_analysis.rates.numbers import ConditionRate
from autd_analysis.sensitivity.firth import FirthEffect, firth_effect


@dataclass(frozen=True)
class ConditionLogit:
    """A condition's penalised logit.

    Attributes
    ----------
    condition
        The factors' levels.
    participants, felt, trials
        Counts over all participants.
    separated
        Whether all or none were felt: the logit without penalty is infinite. None without trials.
    effect
        The penalised logit with its profile interval; None without trials.
    """

    condition: Condition
    participants: int
    felt: int
    trials: int
    separated: bool | None
    effect: FirthEffect | None

    @property
    def probability(self) -> float | None:
        """What the logit means: (felt + 1/2) / (trials + 1)."""
        return (self.felt + 0.5) / (self.trials + 1) if self.trials else None


def condition_logits(rates: Sequence[ConditionRate]) -> tuple[ConditionLogit, ...]:
    """Return every condition's penalised logit."""
    return tuple(_condition_logit(rate) for rate in rates)


def _condition_logit(rate: ConditionRate) -> ConditionLogit:
    counts = np.array([float(rate.felt)]), np.array([float(rate.n)])
    return ConditionLogit(
        condition=rate.condition,
        participants=rate.participants,
        felt=rate.felt,
        trials=rate.n,
        separated=rate.felt in (0, rate.n) if rate.n else None,
        effect=firth_effect(*counts, np.ones((1, 1)), np.ones(1)) if rate.n else None,
    )
