"""Simulated people; one is a responder like any other."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.participants.population import detection_probabilities
    from autd_trials.participants.simulated import SimulatedParticipant
    from autd_trials.participants.traits import ParticipantTraits

__all__ = ["ParticipantTraits", "SimulatedParticipant", "detection_probabilities"]

__getattr__ = lazy(
    __name__,
    {
        "ParticipantTraits": "traits",
        "SimulatedParticipant": "simulated",
        "detection_probabilities": "population",
    },
)
