"""Every trial of a session, in order, from a seed."""

from typing import Literal

from pydantic import BaseModel, ConfigDict

from autd_trials.protocol.schema import Level, Protocol, StimulusSpec

TrialType = Literal["stimulus", "catch"]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PlannedTrial(_Frozen):
    """One trial.

    `conditions` holds every factor by name; a within-block factor is None on a catch trial. A catch trial's
    `stimulus` has drive 0, so that the host does exactly the same for it.
    """

    trial: int
    block: int
    trial_type: TrialType
    conditions: dict[str, Level | None]
    stimulus: StimulusSpec
    pause_before_s: float


class PlannedBlock(_Frozen):
    """One block: the levels of the factors between blocks, and their descriptions."""

    block: int
    conditions: dict[str, Level]
    descriptions: tuple[str, ...]


class Plan(_Frozen):
    """A session's plan. `trials` are numbered from 1 over the whole session, `blocks` from 1."""

    protocol: str
    place: int
    session: int
    seed: int
    blocks: tuple[PlannedBlock, ...]
    trials: tuple[PlannedTrial, ...]


def make_plan(protocol: Protocol, *, place: int, session: int, seed: int) -> Plan:
    """Plan a session."""
    raise NotImplementedError
