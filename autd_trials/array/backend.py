"""What the phased array needs of its devices: silent preloading, a timed start, their state, silence."""

from collections.abc import Sequence
from dataclasses import dataclass
from threading import Event
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.driver import ArrayInfo
from autd_trials.array.geometry import DevicePose
from autd_trials.errors import DeviceError, StoppedByPerson

START_GRID_NS = 250_000
"""Starts lie on this grid of device time: the period of the 4 kHz modulation samples."""


@dataclass(frozen=True, eq=False)
class Burst:
    """A burst as devices play it.

    `samples` uint8 at 4 kHz, `phases` uint8 of shape (devices, 249), `intensity` 0 to 255.
    """

    samples: NDArray[np.uint8]
    phases: NDArray[np.uint8]
    intensity: int


@dataclass(frozen=True)
class DeviceStates:
    """The devices' states, read between `requested_s` and `received_s` on the host's clock.

    Of `devices` devices, `ready` are in touch; of these `pending` await a start, `on_burst` play the burst's
    bank, and `ended` of those have come to its end.
    """

    requested_s: float
    received_s: float
    devices: int
    ready: int
    failsafe: bool
    thermal: bool
    pending: int
    on_burst: int
    ended: int

    @property
    def silent(self) -> bool:
        """All devices are in touch and none plays a burst or awaits a start."""
        return self.ready == self.devices and self.pending == 0 and self.on_burst == self.ended


@dataclass(frozen=True)
class TimePair:
    """The same instant on the host's clock and on the devices'."""

    host_s: float
    device_ns: int

    def device_ns_at(self, host_s: float) -> int:
        """Return the device time at a host time."""
        return self.device_ns + round((host_s - self.host_s) * 1e9)

    def host_s_at(self, device_ns: int) -> float:
        """Return the host time at a device time."""
        return self.host_s + (device_ns - self.device_ns) / 1e9


class StartRefusedError(DeviceError):
    """The devices found a start time too close; it may be tried again later, after silence."""


class Reading(Protocol):
    """States that are read in the background."""

    def done(self) -> bool:
        """Return whether they are there, or could not be read."""

    def result(self) -> DeviceStates:
        """Wait for them, in bounded time."""


class Latch:
    """Once it is set, nothing is emitted any more until it is cleared; may be set from any thread."""

    def __init__(self) -> None:
        self._set = Event()

    def __bool__(self) -> bool:
        return self._set.is_set()

    def set(self) -> None:
        """Have `refuse` raise from now on."""
        self._set.set()

    def clear(self) -> None:
        """Forget it."""
        self._set.clear()

    def refuse(self) -> None:
        """Raise StoppedByPerson if it is set."""
        if self:
            raise StoppedByPerson("the array was halted")


class Backend(Protocol):
    """Devices that play finite bursts by their own clock; methods raise DeviceError, in bounded time.

    One thread calls them, but for `halt`.
    """

    def open(self, devices: Sequence[DevicePose]) -> ArrayInfo:
        """Take exactly these devices and leave them silent."""

    def load(self, burst: Burst) -> None:
        """Silence the devices and preload a burst."""

    def start(self, device_ns: int) -> None:
        """Have all devices start the burst at a device time on the grid; StartRefusedError if too close."""

    def time_pair(self) -> TimePair:
        """Pair the host's clock with the devices'."""

    def states(self) -> DeviceStates:
        """Read the devices' states; lost devices are counted, not raised."""

    def reading(self) -> Reading:
        """Have the states read now, in the background."""

    def reading_after(self, device_ns: int) -> Reading:
        """Have the states read right after a device time, in the background."""

    def stalled_s(self) -> float:
        """Return how long this process stood still at most, in s, in the last 2 s; 0 if it ran freely."""

    def silence(self, *, confirmed: bool = True) -> None:
        """Cancel a pending start and end a playing burst, now; also after `halt`.

        Unless `confirmed`, return as soon as the command is on its way.
        """

    def halt(self) -> None:
        """Silence the devices and have every later `load` and `start` raise StoppedByPerson, until `open`.

        From any thread, also while another call waits for the devices; never raises.
        """

    @property
    def halted(self) -> Latch:
        """Set by `halt`, cleared by `open`."""

    def close(self) -> None:
        """Silence the devices and let them go; never raises, also when they are lost or were never opened."""
