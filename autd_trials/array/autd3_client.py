"""The SDK's client as the array needs it; asynchronous.

No send is trusted: while devices are lost, or muted by their failsafe, the SDK reports success, so the state
is read back.
"""

import asyncio
import contextlib
from collections.abc import Callable, Sequence

from autd3 import (
    Autd3Error,
    Client,
    ClientConfig,
    DeviceState,
    Duration,
    FirmwareVersion,
    Interface,
    UdpOption,
)
from autd3.commands import Command
from autd3.geometry import Autd3, Geometry

from autd_trials.array.backend import DeviceStates, Latch, TimePair
from autd_trials.array.commands import BURST_BANK, command_to_silence
from autd_trials.array.geometry import DevicePose
from autd_trials.clock import Clock

_REPORT_LAG_S = 0.1  # the devices' reports lag by up to 15 ms
_REPORT_POLL_S = 0.002
_TIME_PAIRS = 5
_SENT_S = 0.35  # a command is answered, or fails, within 0.3 s
_SENT_POLL_S = 0.001


class ArrayClient:
    """An open client; its methods raise Autd3Error.

    Parameters
    ----------
    client
        The SDK's client.
    clock
        The host's clock.
    halted
        Once it is set, nothing is sent any more but silence.
    """

    def __init__(self, client: Client, clock: Clock, halted: Latch) -> None:
        self._client = client
        self._clock = clock
        self._halted = halted
        self._sending = 0

    async def firmware(self) -> list[FirmwareVersion]:
        """Read each device's firmware version."""
        return await self._client.read_firmware_version()

    async def send(self, commands: Sequence[Command]) -> None:
        """Send commands one after the other, each to all devices; StoppedByPerson once it is halted."""
        self._sending += 1
        try:
            for command in commands:
                self._halted.refuse()
                await self._client.send(command)
        finally:
            self._sending -= 1

    def time_pair(self) -> TimePair:
        """Pair the host's clock with the devices'; the tightest of five, within 0.5 us at best."""
        tries = [self._timed_pair() for _ in range(_TIME_PAIRS)]
        return min(tries, key=lambda timed: timed[0])[1]

    async def states(self) -> DeviceStates:
        """Read the devices' states; lost devices are counted and report nothing else."""
        requested_s = self._clock.now_s()
        status = self._client.state_checker().check()
        reports = []
        if not status.any_lost:
            try:
                reports = await self._client.read_fpga_state()
            except Autd3Error:
                status = self._client.state_checker().check()
                if status.all_ready:
                    raise
        playing = [report for report in reports if report.current_mod_bank() == BURST_BANK]
        return DeviceStates(
            requested_s=requested_s,
            received_s=self._clock.now_s(),
            devices=len(status.devices),
            ready=status.devices.count(DeviceState.Ready),
            failsafe=any(report.is_failsafe_active() for report in reports),
            thermal=any(report.is_thermal_asserted() for report in reports),
            pending=sum(report.is_transition_pending() for report in reports),
            on_burst=len(playing),
            ended=sum(report.is_mod_stopped() for report in playing),
        )

    async def states_after(self, device_ns: int) -> DeviceStates:
        """Wait for a device time, then read the states until all devices play the burst, or 0.1 s is over."""
        while (wait_ns := device_ns - self._client.device_time_now().sys_time) > 0:
            await asyncio.sleep(wait_ns / 1e9)
        return await self._states_until(lambda states: states.on_burst == states.devices)

    async def silence(self) -> DeviceStates:
        """Cancel a pending start, end a playing burst, drop the pattern; return the states after it."""
        sent = self._client.send(command_to_silence()), self._client.silent_stop()
        for result in await asyncio.gather(*sent, return_exceptions=True):
            if isinstance(result, BaseException):
                raise result
        return await self._states_until(lambda states: states.silent)

    async def silence_for_good(self) -> DeviceStates:
        """Silence the devices after `halted` was set, whatever is being sent; return the states after it.

        The SDK sends commands that were given to it together in any order. So what was being sent may arrive
        after the first command to silence; once it has all been answered, a second one ends it.
        """
        if self._sending:
            with contextlib.suppress(Autd3Error):  # it is sent again
                await self._client.send(command_to_silence())
            deadline_s = self._clock.now_s() + _SENT_S
            while self._sending and self._clock.now_s() < deadline_s:
                await asyncio.sleep(_SENT_POLL_S)
        return await self.silence()

    async def close(self) -> None:
        """Leave the devices."""
        await self._client.close()

    def _timed_pair(self) -> tuple[float, TimePair]:
        before_s = self._clock.now_s()
        device_ns = self._client.device_time_now().sys_time
        after_s = self._clock.now_s()
        return after_s - before_s, TimePair((before_s + after_s) / 2, device_ns)

    async def _states_until(self, wanted: Callable[[DeviceStates], bool]) -> DeviceStates:
        """Read the states until they are as wanted, devices are lost, or the reports' lag is over."""
        deadline_s = self._clock.now_s() + _REPORT_LAG_S
        while True:
            states = await self.states()
            if wanted(states) or states.ready < states.devices or states.requested_s >= deadline_s:
                return states
            await asyncio.sleep(_REPORT_POLL_S)


async def open_client(
    devices: Sequence[DevicePose], address: str, *, emulated: bool, clock: Clock, halted: Latch
) -> ArrayClient:
    """Open the SDK's client on exactly these devices.

    Parameters
    ----------
    devices
        The devices' poses, in the order in which they are wired.
    address
        ``[::1]:PORT`` of an emulator, else the name of a network interface. The SDK is never left to choose.
    emulated
        Which of the two the address is.
    clock
        The host's clock.
    halted
        Once it is set, the client sends nothing any more but silence.

    Raises
    ------
    Autd3Error
        If there are not exactly so many devices, or their firmware is not supported.
    """
    from scipy.spatial.transform import Rotation

    geometry = Geometry([Autd3(pose.origin_mm, Rotation.from_matrix(pose.rotation)) for pose in devices])
    interface = Interface.Addr(address) if emulated else Interface.Name(address)
    client = await Client.open(geometry, _option(interface), _config())
    return ArrayClient(client, clock, halted)


def _option(interface: Interface) -> UdpOption:
    """Return timeouts that hold on a busy computer; no recovery, which would go on unasked.

    A device counts as lost when nothing came from it for 0.4 s: the SDK's own 0.1 s is over before a busy
    computer gets round to read the answers, and after 0.5 s without a word the firmware mutes itself.
    """
    return UdpOption(
        iface=interface,
        reply_timeout=Duration.from_millis(50),
        lost_timeout=Duration.from_millis(400),
        response_timeout=Duration.from_millis(300),
        enumeration_timeout=Duration.from_millis(2000),
        sync_timeout=Duration.from_millis(5000),
    )


def _config() -> ClientConfig:
    """Return a client that never releases a failsafe by itself: the burst's bank would still be in place."""
    return ClientConfig(
        ack_timeout=Duration.from_millis(300),
        release_failsafe_on_recovery=None,
        resynchronize_on_recovery=None,
    )
