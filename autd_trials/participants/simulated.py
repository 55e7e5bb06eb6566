"""A simulated participant that answers like a response device; its model is an assumption, not data."""

import heapq
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.participants.traits import (
    FULL_DRIVE_FORCE_MN,
    PREDICTED_FORCE_MN,
    Layer,
    ParticipantTraits,
)
from autd_trials.protocol.plan import Plan
from autd_trials.responses.responder import Presentation, Press, ResponderInfo

if TYPE_CHECKING:
    from numpy.random import Generator

CLOTHING_LAYERS: Mapping[str, tuple[Layer, ...]] = {"inner": ("inner",), "inner_outer": ("inner", "outer")}
"""What a participant wears at each level of the shipped protocols' clothing factor."""

BUTTON = "simulated"

_AS_A_GOOD_FOCUS: Mapping[str, float] = MappingProxyType({})

# First words of the spawn keys: they keep the streams apart from each other and from the plan's.
_TRAITS_STREAM, _ANSWER_STREAM = 0x70617274, 0x616E7377


class SimulatedParticipant:
    """Feels what it is presented with, and presses a reaction time after the onset.

    The model (`traits`) is a tuned assumption. Every draw depends on nothing but (seed, place) for who the
    participant is, and on (seed, place, session, trial, attempt) for an answer. So a resumed session has the
    answers of an uninterrupted one; only a trial that is run again, being another attempt, is answered anew.

    Parameters
    ----------
    clock
        Waited on in `read`; real or virtual.
    seed
        The study's seed, not negative.
    place
        The participant's place in the roster.
    session
        The session's number.
    traits
        Who the participant is; drawn from (seed, place) if None.
    clothing_factor
        The factor that says what the participant wears; a presentation without it reaches bare skin.
    layers
        What is worn at each level of that factor. Other levels are felt as bare skin, and `remarks` says so.
    predicted_force_mn
        The force of the field at each target at full drive, as linear theory predicts it where the units
        really stand, in mN. At other targets it is taken for that of a good focus.
    """

    def __init__(
        self,
        clock: Clock,
        *,
        seed: int,
        place: int,
        session: int,
        traits: ParticipantTraits | None = None,
        clothing_factor: str = "clothing",
        layers: Mapping[str, tuple[Layer, ...]] = CLOTHING_LAYERS,
        predicted_force_mn: Mapping[str, float] = _AS_A_GOOD_FOCUS,
    ) -> None:
        self.traits = traits or ParticipantTraits.draw(_generator(seed, _TRAITS_STREAM, place))
        self._clock = clock
        self._seed = seed
        self._place = place
        self._session = session
        self._clothing_factor = clothing_factor
        self._layers = layers
        self._predicted_force_mn = predicted_force_mn
        self._open = False
        self._due: list[tuple[float, int, Press]] = []
        self._presses_made = 0

    def remarks(self, plan: Plan) -> list[str]:
        """Return what the experimenter should know of a plan: clothing that is not in `layers`."""
        worn = {trial.conditions.get(self._clothing_factor) for trial in plan.trials} - {None}
        return [
            f"it is not known how much {self._clothing_factor} {level} lets through; the simulated "
            "participant feels as if nothing were worn"
            for level in sorted(str(level) for level in worn if level not in self._layers)
        ]

    def open(self) -> ResponderInfo:
        """Begin anew, without any press outstanding."""
        self._due.clear()
        self._open = True
        return ResponderInfo(
            kind="simulated",
            device=f"simulated participant (assumed model, no data), seed {self._seed}, place {self._place}"
            + "".join(f", {self._full_drive_mn(t):.1f} mN at {t}" for t in self._predicted_force_mn),
            time_uncertainty_s=0.0,
        )

    def present(self, presentation: Presentation) -> None:
        """Decide whether the stimulus is felt; if so, a press falls due a reaction time after the onset."""
        force_mn = self.traits.force_mn(
            presentation.drive,
            self._worn(presentation.conditions),
            full_drive_mn=self._full_drive_mn(presentation.target),
        )
        generator = _generator(
            self._seed, _ANSWER_STREAM, self._place, self._session, presentation.trial, presentation.attempt
        )
        reaction_time_s = self.traits.answer(force_mn, presentation.modulation_hz, generator)
        if reaction_time_s is not None:
            press = Press(presentation.onset_s + reaction_time_s, BUTTON)
            self._presses_made += 1
            heapq.heappush(self._due, (press.time_s, self._presses_made, press))

    def read(self, until_s: float) -> list[Press]:
        """Wait until `until_s` or the next press; see `Responder.read`."""
        if not self._open:
            raise DeviceError("the simulated participant is not open", where="responder", do="open it first")
        self._clock.sleep_until(min([until_s, *(time_s for time_s, _, _ in self._due[:1])]))
        now_s = self._clock.now_s()
        presses = []
        while self._due and self._due[0][0] <= now_s:
            presses.append(heapq.heappop(self._due)[2])
        return presses

    def close(self) -> None:
        """Forget what was presented."""
        self._due.clear()
        self._open = False

    def _full_drive_mn(self, target: str) -> float:
        predicted_mn = self._predicted_force_mn.get(target, PREDICTED_FORCE_MN)
        return FULL_DRIVE_FORCE_MN * predicted_mn / PREDICTED_FORCE_MN

    def _worn(self, conditions: Mapping[str, float | str | None]) -> tuple[Layer, ...]:
        level = conditions.get(self._clothing_factor)
        return self._layers.get(str(level), ())  # no clothing in this protocol, a catch trial, or not known


def _generator(seed: int, *key: int) -> "Generator":
    from numpy.random import SeedSequence, default_rng

    return default_rng(SeedSequence(seed, spawn_key=key))
