"""Devices that exist in this process only, in the host clock's time; they keep what they would emit."""

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.backend import START_GRID_NS, Burst, DeviceStates, Latch, StartRefusedError, TimePair
from autd_trials.array.driver import ArrayInfo
from autd_trials.array.geometry import TRANSDUCERS_PER_DEVICE, DevicePose
from autd_trials.clock import Clock
from autd_trials.errors import DeviceError

_EPOCH_NS = 1_000_000_000  # so that device times are not mistaken for host times
_FIRMWARE_MARGIN_NS = 10_000_000
_FULL = 255.0


@dataclass(frozen=True, eq=False)
class Emission:
    """A burst that would have been emitted from `onset_ns` on, until `aborted_ns` if it was; device times."""

    onset_ns: int
    burst: Burst
    aborted_ns: int | None = None

    @property
    def ends_ns(self) -> int:
        """When the burst's last sample is reached."""
        return self.onset_ns + len(self.burst.samples) * START_GRID_NS


@dataclass
class Faults:
    """What goes wrong, from when on in host time; for tests of what follows."""

    lost_devices: int = 0
    lost_from_s: float = -math.inf
    failsafe_from_s: float = math.inf
    unanswered_from_s: float = math.inf
    stalled_s: float = 0.0
    refused_starts: int = 0
    thermal_from_s: float = math.inf
    before_start: Callable[[], None] = lambda: None
    """Called between the look at the devices and the start command; may block, as a busy computer does."""


class VirtualBackend:
    """Virtual devices; implements `Backend`.

    Parameters
    ----------
    clock
        The host's clock; the devices' runs with it.

    Attributes
    ----------
    emissions
        What would have been emitted, in order.
    faults
        What goes wrong; nothing at first.
    """

    def __init__(self, clock: Clock) -> None:
        self.emissions: list[Emission] = []
        self.faults = Faults()
        self._clock = clock
        self._devices = 0
        self._loaded: Burst | None = None
        self._current: Emission | None = None
        self._halted = Latch()
        self._device = Lock()  # devices take one command at a time

    def open(self, devices: Sequence[DevicePose]) -> ArrayInfo:
        """Make so many devices."""
        self._halted.clear()
        self._devices = len(devices)
        return ArrayInfo(
            driver="virtual",
            link="in process",
            emulated=True,
            devices=self._devices,
            transducers=self._devices * TRANSDUCERS_PER_DEVICE,
            firmware=("virtual",) * self._devices,
        )

    def load(self, burst: Burst) -> None:
        """Silence the devices and preload a burst."""
        self._require_open()
        self._halted.refuse()
        self.silence()
        self._loaded = burst

    def start(self, device_ns: int) -> None:
        """Start the burst at a device time on the grid; StartRefusedError if less than 10 ms ahead."""
        if self._loaded is None or device_ns % START_GRID_NS:
            raise RuntimeError("start: nothing is loaded, or the time is off the grid")
        refused = self.faults.refused_starts > 0
        self.faults.refused_starts -= refused
        if refused or device_ns - self._now_ns() < _FIRMWARE_MARGIN_NS:
            raise StartRefusedError("the start is too close")
        self.faults.before_start()
        with self._device:
            self._halted.refuse()
            self._current = Emission(device_ns, self._loaded)
            self.emissions.append(self._current)

    def time_pair(self) -> TimePair:
        """Pair the host's clock with the devices'."""
        return TimePair(self._clock.now_s(), self._now_ns())

    def states(self) -> DeviceStates:
        """Return the devices' states."""
        self._require_open()
        return self._states_at(self._now_ns())

    def reading(self) -> "_Reading":
        """Return the states, or none as long as the devices do not answer."""
        asked_ns = self._now_ns()
        return _Reading(lambda: self._states_at(asked_ns), lambda: not self._silent_at(self._now_ns()))

    def reading_after(self, device_ns: int) -> "_Reading":
        """Return the states right after a device time."""
        return _Reading(lambda: self._states_at(device_ns), lambda: True)

    def stalled_s(self) -> float:
        """Return how long this process is said to have stood still."""
        return self.faults.stalled_s

    def silence(self, *, confirmed: bool = True) -> None:
        """Cancel a pending start and end a playing burst; lost devices cannot confirm it."""
        now_ns = self._now_ns()
        if self._lost_at(now_ns) or self._silent_at(now_ns):
            if not confirmed:
                return
            raise DeviceError("the devices did not confirm that they are silent", do="switch them off")
        with self._device:
            if self._current and now_ns < self._current.ends_ns:
                self.emissions.pop()
                if self._current.onset_ns < now_ns:
                    self.emissions.append(replace(self._current, aborted_ns=now_ns))
            self._loaded = self._current = None

    def halt(self) -> None:
        """Silence the devices and have every later `load` and `start` raise StoppedByPerson, until `open`."""
        self._halted.set()
        with contextlib.suppress(DeviceError):
            self.silence()

    @property
    def halted(self) -> Latch:
        """Set by `halt`, cleared by `open`."""
        return self._halted

    def close(self) -> None:
        """Silence the devices; lost ones end their burst by themselves."""
        with contextlib.suppress(DeviceError):
            self.silence()
        self._devices = 0

    def emitted_amplitude(self, device_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the pressure amplitude, 0 to 1 of the array's largest, at device times in ns (any shape)."""
        emitted = sum(
            (_amplitude(emission, device_ns) for emission in self.emissions), np.zeros(device_ns.shape)
        )
        muted = device_ns >= self._device_ns(self.faults.failsafe_from_s)
        return np.where(muted, 0.0, emitted)

    def _require_open(self) -> None:
        if not self._devices:
            raise RuntimeError("the array is not open")

    def _states_at(self, device_ns: int) -> DeviceStates:
        host_s = (device_ns - _EPOCH_NS) / 1e9
        lost = self._lost_at(device_ns)
        started = self._current is not None and device_ns >= self._current.onset_ns
        ended = self._current is not None and device_ns >= self._current.ends_ns
        answering = 0 if lost else self._devices  # as of the SDK: with one lost, none reports
        return DeviceStates(
            requested_s=host_s,
            received_s=host_s,
            devices=self._devices,
            ready=self._devices - lost,
            failsafe=device_ns >= self._device_ns(self.faults.failsafe_from_s),
            thermal=device_ns >= self._device_ns(self.faults.thermal_from_s),
            pending=answering if self._current and not started else 0,
            on_burst=answering if started else 0,
            ended=answering if ended else 0,
        )

    def _silent_at(self, device_ns: int) -> bool:
        return device_ns >= self._device_ns(self.faults.unanswered_from_s)

    def _lost_at(self, device_ns: int) -> int:
        return self.faults.lost_devices if device_ns >= self._device_ns(self.faults.lost_from_s) else 0

    def _now_ns(self) -> int:
        return round(self._device_ns(self._clock.now_s()))

    @staticmethod
    def _device_ns(host_s: float) -> float:
        return host_s * 1e9 + _EPOCH_NS


@dataclass(frozen=True)
class _Reading:
    result: Callable[[], DeviceStates]
    done: Callable[[], bool]


def _amplitude(emission: Emission, device_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Follow the silencer: straight lines from sample to sample, and to silence after an abort."""
    burst = emission.burst
    since_onset_ns = device_ns - emission.onset_ns
    knots_ns = np.arange(len(burst.samples) + 1) * START_GRID_NS
    levels = np.concatenate(([0], burst.samples)) / _FULL * (burst.intensity / _FULL)
    playing = np.interp(since_onset_ns, knots_ns, levels, left=0.0, right=0.0)
    if emission.aborted_ns is None:
        return playing
    since_abort_ns = device_ns - emission.aborted_ns
    at_abort = np.interp(emission.aborted_ns - emission.onset_ns, knots_ns, levels)
    dying = at_abort * np.clip(1 - since_abort_ns / START_GRID_NS, 0, 1)
    return np.where(since_abort_ns > 0, dying, playing)
