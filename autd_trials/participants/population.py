"""Many simulated people at once: how likely each answers "felt", for planning studies.

The same assumed model as a single `ParticipantTraits`, drawn as arrays, with the jitter of a trial integrated
out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.participants import traits
from autd_trials.participants.traits import FULL_DRIVE_FORCE_MN, Layer, median_threshold_mn

Array = NDArray[np.float64]

_JITTER_NODES = 7


@dataclass(frozen=True)
class Presented:
    """What is presented in a condition, and through what."""

    drive: float
    modulation_hz: float
    layers: tuple[Layer, ...]


def detection_probabilities(
    presented: Sequence[Presented], people: tuple[int, ...], generator: np.random.Generator
) -> Array:
    """Draw people and return how likely each answers "felt" in each condition.

    Parameters
    ----------
    presented
        The conditions.
    people
        How many people, of any shape.
    generator
        Where they come from.

    Returns
    -------
    ndarray
        Shape (*people, conditions).
    """
    from scipy.special import ndtr

    threshold_db = generator.normal(0.0, traits.THRESHOLD_SD_DB, people)
    losses_db = {
        layer: np.minimum(generator.normal(mean, sd, people), traits.SMALLEST_LAYER_LOSS_DB)
        for layer, (mean, sd) in traits.LAYER_LOSS_DB.items()
    }
    criterion = generator.normal(traits.CRITERION_MEAN, traits.CRITERION_SD, people)
    jitter_db, weights = np.polynomial.hermite_e.hermegauss(_JITTER_NODES)
    jitter = 10 ** (-traits.TRIAL_JITTER_SD_DB * jitter_db / 20)
    weights = weights / weights.sum()
    probabilities = np.empty((*people, len(presented)))
    for column, each in enumerate(presented):
        loss_db = sum((losses_db[layer] for layer in each.layers), np.zeros(people))
        force_mn = FULL_DRIVE_FORCE_MN * each.drive**2 * 10 ** (loss_db / 10)
        threshold_mn = median_threshold_mn(each.modulation_hz) * 10 ** (threshold_db / 20)
        d_prime = traits.SENSITIVITY * force_mn / threshold_mn
        felt = sum(w * ndtr(d_prime * j - criterion) for w, j in zip(weights, jitter, strict=True))
        probabilities[..., column] = traits.LAPSE + (1 - 2 * traits.LAPSE) * felt
    return probabilities
