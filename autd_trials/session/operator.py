"""The experimenter, as the runner sees them."""

from dataclasses import dataclass, field
from typing import Protocol

from autd_trials.protocol.plan import PlannedBlock
from autd_trials.session.events import ConfirmedBy


@dataclass(frozen=True)
class Decision:
    """What the experimenter wants after a pause, and what was noted meanwhile."""

    go_on: bool
    notes: tuple[str, ...] = field(default=())


class Operator(Protocol):
    """Confirms what only a person can confirm. Methods wait for the person and may raise StoppedByPerson."""

    @property
    def confirmed_by(self) -> ConfirmedBy:
        """Who confirms: a person, or nobody (an unattended run)."""

    def read_out(self, instructions: str) -> None:
        """Return when the instructions were read out to the participant."""

    def confirm_block(self, block: PlannedBlock) -> None:
        """Return when the block's conditions (clothing, say) are as they must be."""

    def confirm_known(self, summary: str) -> None:
        """Return when an id that is in the study already was confirmed to be the same person's."""

    def confirm_resume(self, summary: str) -> None:
        """Return when an interrupted session may go on."""

    def decide_after_pause(self, reason: str) -> Decision:
        """Return what to do after the session paused."""


class Unattended:
    """Confirms everything at once and ends the session where a person would have to decide."""

    confirmed_by: ConfirmedBy = "unattended"

    def read_out(self, instructions: str) -> None:
        """Nobody reads."""

    def confirm_block(self, block: PlannedBlock) -> None:
        """Nobody wears anything."""

    def confirm_known(self, summary: str) -> None:
        """Nobody knows who it is."""

    def confirm_resume(self, summary: str) -> None:
        """Go on."""

    def decide_after_pause(self, reason: str) -> Decision:  # noqa: ARG002 - the interface's signature
        """Stop: what made the session pause needs a person."""
        return Decision(go_on=False)
