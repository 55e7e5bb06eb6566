"""What a response device offers; every one of them, real or simulated, passes one contract test suite."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

from autd_trials.model import Model

Meaning = Literal["felt", "not_felt", "undeclared"]
"""What a button stands for; undeclared: the rig does not say, so that a press of it is no answer."""


Repeat = Literal["no", "perhaps", "yes"]
"""Whether a press only says that a button is still held down; perhaps, if what comes next must tell."""


@dataclass(frozen=True)
class Press:
    """One press.

    `time_s` is on the host's monotonic clock; `device_time_s` is the device's own stamp where it sends one.
    `repeat` says whether the button was held down since an earlier press.
    """

    time_s: float
    button: str
    device_time_s: float | None = None
    means: Meaning = "felt"
    repeat: Repeat = "no"


@dataclass(frozen=True)
class Unreadable:
    """Something came that is no press that the device's description knows; it may have been meant as one."""

    time_s: float
    what: str


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

    def read(self, until_s: float) -> list[Press]:
        """Return the presses that came since, oldest first; wait for one until the clock shows `until_s`.

        Raises
        ------
        DeviceError
            The device is not open, or was lost and every press from before was returned.
        """

    def unreadable(self) -> list[Unreadable]:
        """Return what else came since the last call, oldest first; never waits, never raises."""

    def close(self) -> None:
        """Release the device; never raises."""
