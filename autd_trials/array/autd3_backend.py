"""The backend over the official AUTD SDK: its firmware emulator, or devices behind a network interface.

The SDK is asynchronous; it runs in an event loop of its own thread. Every call is bounded in time.
"""

import contextlib
from collections.abc import Coroutine, Sequence
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from threading import Lock
from typing import Any, TypeVar

from autd3 import Autd3Error, FirmwareVersion

from autd_trials.array.autd3_client import ArrayClient, open_client
from autd_trials.array.autd3_errors import device_error
from autd_trials.array.backend import Burst, DeviceStates, Latch, Reading, TimePair
from autd_trials.array.background import BackgroundLoop
from autd_trials.array.commands import command_to_start, commands_to_load, commands_to_open
from autd_trials.array.driver import ArrayInfo
from autd_trials.array.geometry import TRANSDUCERS_PER_DEVICE, DevicePose
from autd_trials.array.link import HeldLink, Link
from autd_trials.clock import Clock
from autd_trials.errors import DeviceError

T = TypeVar("T")

_OPEN_S = 8.0
_CALL_S = 1.0
_SILENCE_S = 0.9
_HALT_S = 1.3  # what is being sent meanwhile is waited for


@dataclass(frozen=True)
class _Opened:
    client: ArrayClient
    loop: BackgroundLoop
    link: HeldLink
    release: contextlib.ExitStack

    @property
    def where(self) -> str:
        return self.link.description


@dataclass(frozen=True)
class _Reading:
    future: Future[DeviceStates]
    where: str

    def done(self) -> bool:
        return self.future.done()

    def result(self) -> DeviceStates:
        return _result(self.future, self.where, _CALL_S)


class Autd3Backend:
    """Devices reached through the SDK; implements `Backend`.

    Parameters
    ----------
    link
        The emulator or the network interface.
    clock
        The host's clock.
    """

    def __init__(self, link: Link, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._opened: _Opened | None = None
        self._halted = Latch()
        self._handover = Lock()  # so that `halt` never meets an event loop that has ended

    def open(self, devices: Sequence[DevicePose]) -> ArrayInfo:
        """Take exactly these devices and leave them silent."""
        self._halted.clear()
        with contextlib.ExitStack() as stack:
            link = stack.enter_context(HeldLink(self._link, len(devices)))
            loop = BackgroundLoop("autd3")
            stack.callback(loop.stop)
            opening = open_client(
                devices, link.address, emulated=link.emulated, clock=self._clock, halted=self._halted
            )
            client = _call(loop, opening, link.description, _OPEN_S)
            stack.callback(_leave, loop, client)
            firmware = _call(loop, client.firmware(), link.description)
            _refuse_other_firmware(firmware, emulated=link.emulated, where=link.description)
            _call(loop, client.send(commands_to_open()), link.description)
            self._halted.refuse()  # set while it was being opened
            self._opened = _Opened(client, loop, link, stack.pop_all())
        return ArrayInfo(
            driver="autd3",
            link=link.description,
            emulated=link.emulated,
            devices=len(devices),
            transducers=len(devices) * TRANSDUCERS_PER_DEVICE,
            firmware=tuple(_written(version) for version in firmware),
        )

    def load(self, burst: Burst) -> None:
        """Silence the devices and preload a burst."""
        self._call(self._client.send(commands_to_load(burst)))

    def start(self, device_ns: int) -> None:
        """Have all devices start the burst at a device time on the grid; StartRefusedError if too close."""
        self._require_open().link.refuse_lost_hold()
        self._call(self._client.send([command_to_start(device_ns)]))

    def time_pair(self) -> TimePair:
        """Pair the host's clock with the devices'."""
        return self._client.time_pair()

    def states(self) -> DeviceStates:
        """Read the devices' states; lost devices are counted, not raised."""
        return self._call(self._client.states())

    def reading(self) -> Reading:
        """Have the states read now, in the background."""
        return self._reading(self._client.states())

    def reading_after(self, device_ns: int) -> Reading:
        """Have the states read right after a device time, in the background."""
        return self._reading(self._client.states_after(device_ns))

    def stalled_s(self) -> float:
        """Return how long this process stood still at most, in s, in the last 2 s; 0 if it ran freely."""
        return self._require_open().loop.stalled_s()

    def silence(self, *, confirmed: bool = True) -> None:
        """Cancel a pending start and end a playing burst, now; nothing to do before it is opened."""
        if self._opened is None:
            return
        if not confirmed:
            self._opened.loop.submit(self._opened.client.silence())
            return
        what = "the devices did not confirm that they are silent"
        do = "switch off the array's power if it still sounds; a burst that runs ends by itself"
        try:
            states = self._call(self._client.silence(), _SILENCE_S)
        except DeviceError as error:
            raise DeviceError(what, where=self._opened.where, do=do) from error
        if not (states.silent or states.failsafe):
            raise DeviceError(what, where=self._opened.where, do=do)

    def halt(self) -> None:
        """Silence the devices and have every later `load` and `start` raise StoppedByPerson, until `open`.

        The event loop's own thread sends the command, whatever the thread that uses the array waits for.
        """
        self._halted.set()
        with self._handover:
            if (opened := self._opened) is None:
                return
            silencing = opened.loop.submit(opened.client.silence_for_good())
        with contextlib.suppress(DeviceError):  # of lost devices: their burst ends by itself
            _result(silencing, opened.where, _HALT_S)

    @property
    def halted(self) -> Latch:
        """Set by `halt`, cleared by `open`."""
        return self._halted

    def close(self) -> None:
        """Silence the devices and let them go; never raises."""
        with contextlib.suppress(DeviceError):  # lost devices are let go all the same
            self.silence()
        with self._handover:
            opened, self._opened = self._opened, None
        if opened:
            opened.release.close()

    @property
    def _client(self) -> ArrayClient:
        return self._require_open().client

    def _require_open(self) -> _Opened:
        if self._opened is None:
            raise RuntimeError("the array is not open")
        return self._opened

    def _reading(self, states: Coroutine[Any, Any, DeviceStates]) -> Reading:
        opened = self._require_open()
        return _Reading(opened.loop.submit(states), opened.where)

    def _call(self, coroutine: Coroutine[Any, Any, T], timeout_s: float = _CALL_S) -> T:
        opened = self._require_open()
        return _call(opened.loop, coroutine, opened.where, timeout_s)


def _call(
    loop: BackgroundLoop, coroutine: Coroutine[Any, Any, T], where: str, timeout_s: float = _CALL_S
) -> T:
    future = loop.submit(coroutine)
    try:
        return _result(future, where, timeout_s)
    finally:
        future.cancel()  # of what timed out, or was left by a Ctrl-C


def _result(future: Future[T], where: str, timeout_s: float) -> T:
    try:
        return future.result(timeout_s)
    except Autd3Error as error:
        raise device_error(error, where) from error
    except (TimeoutError, CancelledError) as error:
        raise DeviceError(
            f"the array did not answer within {timeout_s:g} s",
            where=where,
            do="check the devices' power and cables, then go on with --resume",
        ) from error


def _written(version: FirmwareVersion) -> str:
    """Return ``CPU: 0.12.0, FPGA: 0.12.0 [Emulator]``."""
    return repr(version).removeprefix("FirmwareVersion(").removesuffix(")")


def _leave(loop: BackgroundLoop, client: ArrayClient) -> None:
    with contextlib.suppress(Autd3Error, TimeoutError):  # of lost devices there is no leave to take
        loop.submit(client.close()).result(_CALL_S)


def _refuse_other_firmware(firmware: Sequence[FirmwareVersion], *, emulated: bool, where: str) -> None:
    if all(version.is_emulator() == emulated for version in firmware):
        return
    said, found = ("an emulator", "real devices") if emulated else ("real devices", "an emulator")
    raise DeviceError(
        f"the rig file says that the array is {said}, but {found} answer",
        where=where,
        do="correct the rig file",
    )
