"""What goes wrong with real processes and sockets: the SDK's backend on its firmware emulator."""

import asyncio
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from autd3 import Duration
from autd3.commands import CpuConfig, SetCpuConfig

from autd_trials.array.autd3_backend import Autd3Backend
from autd_trials.array.autd3_client import open_client
from autd_trials.array.backend import DeviceStates, Latch
from autd_trials.array.commands import command_to_silence, commands_to_open
from autd_trials.array.driver import Stimulus
from autd_trials.array.emulator import Emulator
from autd_trials.array.geometry import UnitPose, device_poses
from autd_trials.array.link import EmulatorLink, Link, NetworkLink
from autd_trials.array.phased_array import PhasedArray
from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError
from autd_trials.stimulus import Limits
from tests.array.conftest import watch_until

MakeStimulus = Callable[..., Stimulus]
MakeArray = Callable[[Link], PhasedArray]

pytestmark = pytest.mark.emulator


@pytest.fixture
def emulator() -> Iterator[Emulator]:
    with Emulator(18) as emulator:
        yield emulator


@pytest.fixture
def make_array(units: list[UnitPose], limits: Limits) -> Iterator[MakeArray]:
    """Return what makes an array on a link; all are closed at the end."""
    arrays = []

    def make(link: Link) -> PhasedArray:
        clock = RealClock()
        arrays.append(PhasedArray(units, Autd3Backend(link, clock), limits, clock, speed_of_sound_m_s=343.2))
        return arrays[-1]

    yield make
    for array in arrays:
        array.close()


def seconds_for(act: Callable[[], object]) -> float:
    before_s = time.monotonic()
    act()
    return time.monotonic() - before_s


def test_an_emulator_killed_in_mid_burst_is_noticed_within_a_second(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    array.open()
    array.arm(make_stimulus(duration_s=2.0))
    onset = array.start(0.0)
    RealClock().sleep_until(onset.onset_s + 0.3)
    emulator.kill()
    killed_s = time.monotonic()
    with pytest.raises(DeviceError, match=r"the devices have not answered .*; .* did not confirm .* silent"):
        array.finish()
    assert time.monotonic() - killed_s < 1.5
    assert not array.health().ok
    assert seconds_for(array.close) < 2.0


def test_devices_lost_in_mid_burst_are_noticed_while_it_runs(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    array.open()
    array.arm(make_stimulus(duration_s=2.0))
    onset = array.start(0.0)
    RealClock().sleep_until(onset.onset_s + 0.2)
    array.watch()
    emulator.kill()
    killed_s = time.monotonic()
    with pytest.raises(DeviceError, match="the devices have not answered"):
        watch_until(array, RealClock(), onset.onset_s + 2.0)
    assert time.monotonic() - killed_s < 1.0  # 0.3 s where the computer is not busy: see the benchmark


def test_aborting_lost_devices_does_not_hang(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    array.open()
    array.arm(make_stimulus())
    emulator.kill()

    def abort() -> None:
        with pytest.raises(DeviceError, match="did not confirm"):
            array.abort()

    assert seconds_for(abort) < 1.0
    assert seconds_for(abort) < 1.0


def test_an_emulator_killed_between_trials_is_noticed_when_arming(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    array.open()
    emulator.kill()
    with pytest.raises(DeviceError, match=r"did not reply|of 18 devices answer"):
        array.arm(make_stimulus())


def test_devices_that_hang_are_noticed_and_a_failsafe_is_not_released(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    array.open()
    os.kill(emulator.pid, signal.SIGSTOP)
    time.sleep(0.7)
    os.kill(emulator.pid, signal.SIGCONT)
    time.sleep(0.2)
    assert not array.health().ok
    with pytest.raises(DeviceError):
        array.arm(make_stimulus())


def test_a_latched_failsafe_is_read_back(emulator: Emulator, units: list[UnitPose]) -> None:
    """Devices that think that they have lost the host mute themselves; sends succeed all the same."""

    async def latch_and_read() -> list[DeviceStates]:
        devices = device_poses(units)
        client = await open_client(
            devices, emulator.address, emulated=True, clock=RealClock(), halted=Latch()
        )
        await client.send(commands_to_open())
        before = await client.states()
        await client.send([SetCpuConfig(CpuConfig(failsafe_timeout=Duration.from_millis(1)))])
        await asyncio.sleep(0.1)
        await client.send([command_to_silence()])
        after = await client.states()
        for _ in range(100):  # reports lag
            if not after.failsafe:
                await asyncio.sleep(0.05)
                after = await client.states()
        await client.close()
        return [before, after]

    before, after = asyncio.run(latch_and_read())
    assert (before.failsafe, after.failsafe) == (False, True)
    assert after.ready == after.devices


@pytest.mark.parametrize(("devices", "numbers"), [(17, "17 of the 18"), (19, "18 devices but 19")])
def test_a_wrong_number_of_devices_is_refused_with_both_numbers(
    make_array: MakeArray, devices: int, numbers: str
) -> None:
    with Emulator(devices) as emulator:
        array = make_array(EmulatorLink(emulator.address))

        def open_it() -> None:
            with pytest.raises(DeviceError, match=numbers):
                array.open()

        assert seconds_for(open_it) < 3.0


def test_a_second_runner_on_the_array_is_refused_by_the_firsts_pid(
    emulator: Emulator, make_array: MakeArray
) -> None:
    first, second = make_array(EmulatorLink(emulator.address)), make_array(EmulatorLink(emulator.address))
    first.open()
    with pytest.raises(DeviceError, match=f"process {os.getpid()}"):
        second.open()
    assert first.health().ok
    first.close()
    second.open()
    assert second.health().ok


@pytest.mark.parametrize("replaced", [False, True])
def test_no_burst_starts_once_the_lock_file_is_removed_or_replaced(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus, replaced: bool
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    array.open()
    array.arm(make_stimulus(duration_s=0.05))
    array.start(0.0)
    array.finish()
    name = "".join(part for part in emulator.address if part.isdigit())
    (lock,) = Path(tempfile.gettempdir()).glob(f"autd-trials-array-1-{name[1:]}.lock")
    lock.unlink()
    if replaced:
        lock.write_text("1")
    array.arm(make_stimulus(duration_s=0.05))
    with pytest.raises(DeviceError, match="lock file was removed or replaced"):
        array.start(0.0)
    assert array.health().ok
    array.close()
    array.open()
    array.arm(make_stimulus(duration_s=0.05))
    array.start(0.0)
    array.finish()


def test_a_runner_that_was_killed_does_not_block_the_next(
    emulator: Emulator, make_array: MakeArray, tmp_path: Path
) -> None:
    script = tmp_path / "runner.py"
    script.write_text(
        "import sys, time\n"
        "from autd_trials.array.link import EmulatorLink, HeldLink\n"
        "HeldLink(EmulatorLink(sys.argv[1]), 18)\n"
        "print('held', flush=True)\n"
        "time.sleep(60)\n"
    )
    other = subprocess.Popen([sys.executable, script, emulator.address], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    assert other.stdout.readline() == "held\n"
    array = make_array(EmulatorLink(emulator.address))
    with pytest.raises(DeviceError, match=f"process {other.pid}"):
        array.open()
    other.kill()
    other.wait()
    other.stdout.close()
    array.open()
    assert array.health().ok


def test_a_missing_network_interface_is_told(make_array: MakeArray) -> None:
    with pytest.raises(DeviceError, match="nosuchnic0") as raised:
        make_array(NetworkLink("nosuchnic0")).open()
    assert raised.value.do is not None
    assert "interface" in raised.value.do


def test_a_failed_opening_lets_the_devices_go(make_array: MakeArray) -> None:
    array = make_array(NetworkLink("nosuchnic0"))
    for _ in range(2):
        with pytest.raises(DeviceError, match="does not exist"):
            array.open()


def test_an_array_can_be_opened_again_after_it_was_closed(
    emulator: Emulator, make_array: MakeArray, make_stimulus: MakeStimulus
) -> None:
    array = make_array(EmulatorLink(emulator.address))
    for _ in range(2):
        array.open()
        array.arm(make_stimulus(duration_s=0.05))
        array.start(0.0)
        array.finish()
        assert array.health().ok
        array.close()


def test_an_emulator_ends_with_its_parent(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(
        "import os, signal\n"
        "from autd_trials.array.emulator import Emulator\n"
        "print(Emulator(1).pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    parent = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    emulator_pid = int(parent.stdout)
    deadline_s = time.monotonic() + 5
    while _runs(emulator_pid) and time.monotonic() < deadline_s:
        time.sleep(0.02)
    assert not _runs(emulator_pid)


def test_a_ctrl_c_in_the_terminal_does_not_reach_the_emulator(emulator: Emulator) -> None:
    assert os.getpgid(emulator.pid) != os.getpgid(0)
    os.kill(emulator.pid, signal.SIGINT)
    time.sleep(0.1)
    assert _runs(emulator.pid)


def test_closing_an_emulator_twice_or_after_its_death_is_harmless() -> None:
    emulator = Emulator(1)
    emulator.kill()
    assert seconds_for(emulator.close) < 1.0
    emulator.close()


def _runs(pid: int) -> bool:
    """Whether a process runs; a zombie that nobody waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
