"""QUEST+: each trial where the answer is expected to tell most. A. B. Watson (2017), J. Vis. 17(3):10.

Our own, as the package of that name is under the GPL. The rule is written for any likelihoods, so that it can
be tested on the sequences of trials that the paper publishes; the protocol's method has those of a Weibull
function.
"""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from autd_trials.adaptive.answers import Answer, Estimate
from autd_trials.protocol.method import QuestPlusMethod

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RATE = 0.5
"""Thresholds are where the stimulus alone, guesses and lapses aside, is felt so often."""

SURE = 0.9
"""How probable it must be that a threshold lies beyond the levels to be said to."""

LARGEST_SHARE_OF_PRIOR = 1 / 3
"""With a larger part of the prior's spread left the threshold is undetermined."""

_BEYOND = {1: "over the largest", -1: "under the smallest"}


class QuestPlus:
    """The rule for yes/no answers.

    Parameters
    ----------
    likelihoods
        Probability of "felt" for every stimulus and every combination of parameters, shape (stimuli,
        parameters).
    prior
        Probability of each combination, shape (parameters,); all alike if None.
    """

    def __init__(self, likelihoods: "Array", prior: "Array | None" = None) -> None:
        import numpy as np

        self._felt = likelihoods
        count = likelihoods.shape[1]
        self._prior = np.full(count, 1 / count) if prior is None else prior

    def posterior(self, answers: Sequence[tuple[int, bool]]) -> "Array":
        """Return the parameters' probabilities after answers: which stimulus, and whether it was felt."""
        import numpy as np

        log = np.log(self._prior)
        with np.errstate(divide="ignore"):  # an answer may rule parameters out
            for stimulus, felt in answers:
                log = log + np.log(self._felt[stimulus] if felt else 1 - self._felt[stimulus])
        if not np.isfinite(log).any():
            return self._prior  # the answers contradict every combination: nothing is known
        weights = np.exp(log - log.max())
        posterior: Array = weights / weights.sum()
        return posterior

    def next_stimulus(self, posterior: "Array") -> int:
        """Return the place of the stimulus after which least entropy is expected; the first of equal ones."""
        import numpy as np
        from scipy.special import xlogy

        felt = self._felt * posterior
        not_felt = (1 - self._felt) * posterior
        entropy = np.zeros(len(self._felt))
        for joint in (felt, not_felt):
            total = joint.sum(axis=1)
            entropy += xlogy(total, total) - xlogy(joint, joint).sum(axis=1)
        return int(entropy.argmin())


class QuestPlusRule:
    """QUEST+ with a Weibull function of the level in dB (20 log10), as in Watson (2017)."""

    def __init__(self, method: QuestPlusMethod) -> None:
        self._method = method

    def next_level(self, answers: Sequence[Answer]) -> float:
        """Return the level of the next trial."""
        return self._method.levels[self._rule.next_stimulus(self._posterior(answers))]

    def estimate(self, answers: Sequence[Answer]) -> Estimate:
        """Return the posterior mean of the level in dB at which the stimulus alone is felt half the time."""
        if not answers:
            return Estimate(None, RATE, None, note="no answers")
        posterior, half_db = self._posterior(answers), self._half_db
        smallest_db, largest_db = _db(self._method.range.ends)
        for beyond, lies_there in ((1, half_db > largest_db), (-1, half_db < smallest_db)):
            if float(posterior[lies_there].sum()) >= SURE:
                return Estimate(None, RATE, None, beyond, f"the threshold lies {_BEYOND[beyond]} level")
        mean_db, spread_db = _moments(half_db, posterior)
        _, prior_spread_db = _moments(half_db, self._posterior([]))
        if not smallest_db <= mean_db <= largest_db or spread_db > LARGEST_SHARE_OF_PRIOR * prior_spread_db:
            return Estimate(None, RATE, None, note="the answers do not tell where the threshold lies")
        return Estimate(10 ** (mean_db / 20), RATE, spread_db)

    @property
    def _thresholds_db(self) -> "Array":
        """The levels, and as many beyond the ends: else answers could not tell that it lies there."""
        import numpy as np

        low_db, high_db = _db([self._method.range.smallest, self._method.range.largest])
        beyond_db = (high_db - low_db) / 2
        return np.linspace(low_db - beyond_db, high_db + beyond_db, 2 * self._method.range.levels - 1)

    @cached_property
    def _parameters(self) -> "Array":
        """Threshold in dB, slope, guess and lapse rate of every combination, shape (4, parameters)."""
        import numpy as np

        method = self._method
        axes = (self._thresholds_db, method.slopes, method.guess_rates, method.lapse_rates)
        return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])

    @cached_property
    def _rule(self) -> QuestPlus:
        import numpy as np

        return QuestPlus(weibull(np.asarray(_db(self._method.levels))[:, None], *self._parameters))

    @cached_property
    def _half_db(self) -> "Array":
        """Where each combination's Weibull function is one half, in dB."""
        threshold_db, slope, _, _ = self._parameters
        half_db: Array = threshold_db + 20 / slope * math.log10(math.log(2))
        return half_db

    def _posterior(self, answers: Sequence[Answer]) -> "Array":
        levels = self._method.levels
        places = [(levels.index(answer.level), answer.felt) for answer in answers]
        return self._rule.posterior(places)


def _moments(values: "Array", weights: "Array") -> tuple[float, float]:
    """Return the weighted mean and standard deviation."""
    mean = float(weights @ values)
    return mean, math.sqrt(max(0.0, float(weights @ (values - mean) ** 2)))


def weibull(
    level_db: "Array", threshold_db: "Array", slope: "Array", guess: "Array", lapse: "Array"
) -> "Array":
    """Return the probability of "felt" by the Weibull function of Watson (2017), equation 12 ff.

    Its threshold is where the stimulus alone is felt with probability 1 - 1/e. All arguments broadcast.
    """
    import numpy as np

    probability: Array = (
        1 - lapse - (1 - guess - lapse) * np.exp(-(10 ** (slope * (level_db - threshold_db) / 20)))
    )
    return probability


def _db(levels: Sequence[float]) -> "list[float]":
    return [20 * math.log10(level) for level in levels]
