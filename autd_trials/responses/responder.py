"""What a response device offers; every one of them, real or simulated, passes one contract test suite."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from autd_trials.model import Model


@dataclass(frozen=True)
class Press:
    """One press.

    `time_s` is on the host's monotonic clock; `device_time_s` is the device's own stamp where it sends one.
    `felt` says whether the button means felt; a press of another is recorded and does not count.
    """

    time_s: float
    button: str
    device_time_s: float | None = None
    felt: bool = True


@dataclass(frozen=True)
class Unreadable:
    """Input that is no press: of a key without a meaning, or bytes that a box's protocol does not know.

    `what` says what came; it arrived at `time_s` on the host's monotonic clock. `may_be_answer` says whether
    it may have been meant as an answer, so that without it nothing is known of the participant's.
    """

    time_s: float
    what: str
    may_be_answer: bool


Input = Press | Unreadable
"""What comes from a responder."""


@dataclass(frozen=True)
class Presentation:
    """What the participant is presented with; hardware ignores it, a simulated participant feels it."""

    trial: int
    attempt: int
    onset_s: float
    duration_s: float
    drive: float
    modulation_hz: float
    target: str
    conditions: Mapping[str, float | str | None]


class ResponderInfo(Model):
    """What the log keeps of a response device."""

    kind: str
    device: str
    time_uncertainty_s: float


class Responder(Protocol):
    """A source of presses."""

    def open(self) -> ResponderInfo:
        """Make the device ready; raises DeviceError. May be called again after `close`: the device came back.

        Presses from before are forgotten.
        """

    def present(self, presentation: Presentation) -> None:
        """Say what is presented and when (onset may lie ahead)."""

    def read(self, until_s: float) -> Sequence[Input]:
        """Return what came since, oldest first; wait for something until the clock shows `until_s`.

        Raises
        ------
        DeviceError
            The device is not open, or was lost and everything from before was returned.
        """

    def close(self) -> None:
        """Release the device; never raises."""
