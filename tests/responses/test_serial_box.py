"""The serial box over real pseudo-terminals."""

import itertools
import os
import tty
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError
from autd_trials.inbox import MOST_ITEMS
from autd_trials.responses.box_protocols import LineProtocol, SingleByteProtocol, XidProtocol
from autd_trials.responses.responder import Input, Press, Unreadable
from autd_trials.responses.serial_box import SerialBox, ftdi_latency_s
from tests.conftest import PseudoTerminal
from tests.responses.conftest import XidPad

SOON_S = 60.0


def read_inputs(box: SerialBox, done: Callable[[list[Input]], bool]) -> list[Input]:
    """Read until `done`, or nothing came for a while."""
    clock = RealClock()
    inputs: list[Input] = []
    while not done(inputs) and (new := box.read(clock.now_s() + SOON_S)):
        inputs += new
    return inputs


def presses_of(inputs: list[Input]) -> list[Press]:
    return [each for each in inputs if isinstance(each, Press)]


def unreadable_bytes(inputs: list[Input]) -> int:
    return sum(int(each.what.split()[0]) for each in inputs if isinstance(each, Unreadable))


def read_all(box: SerialBox, count: int) -> list[Press]:
    return presses_of(read_inputs(box, lambda inputs: len(presses_of(inputs)) >= count))


def test_presses_carry_arrival_and_device_time(line: PseudoTerminal) -> None:
    clock = RealClock()
    box = SerialBox(line.name, LineProtocol(), clock)
    info = box.open()
    assert info.kind == "serial_box"
    assert line.name in info.device
    before_s = clock.now_s()
    line.send(b"B1 12345\r\n")
    (press,) = read_all(box, 1)
    box.close()
    assert before_s < press.time_s < clock.now_s()
    assert press.button == "B1"
    assert press.device_time_s == pytest.approx(12.345)


def test_uncertainty_grows_with_the_time_on_the_line(line: PseudoTerminal) -> None:
    box = SerialBox(line.name, LineProtocol(), RealClock())
    fast = box.open()
    box.close()
    slow_box = SerialBox(line.name, LineProtocol(baud=9600), RealClock())
    slow = slow_box.open()
    slow_box.close()
    assert slow.time_uncertainty_s - fast.time_uncertainty_s == pytest.approx(
        160 / 9600 - 160 / 115200, abs=2e-6
    )


def test_thousands_of_presses_in_a_burst_between_noise_all_come_in_order(line: PseudoTerminal) -> None:
    box = SerialBox(line.name, LineProtocol(), RealClock())
    box.open()
    noise = bytes(range(14, 66))  # no line ends in it
    line.send(b"".join(b"%b\r\nB1 %d\r\n" % (noise if n % 100 == 0 else b"", n) for n in range(5_000)))
    inputs = read_inputs(box, lambda inputs: len(presses_of(inputs)) >= 5_000)
    box.close()
    assert [press.device_time_s for press in presses_of(inputs)] == [n / 1000 for n in range(5_000)]
    assert all(first.time_s <= second.time_s for first, second in itertools.pairwise(inputs))
    assert unreadable_bytes(inputs) == 50 * len(noise)


def test_a_flood_is_a_loss_and_takes_no_more_memory(line: PseudoTerminal) -> None:
    box = SerialBox(line.name, SingleByteProtocol(buttons={"A": "left"}), RealClock())
    box.open()
    line.send(b"A" * (MOST_ITEMS + 2_000))
    inbox = box._inbox
    while inbox.put([]):  # until it is full
        RealClock().sleep_until(RealClock().now_s() + 0.001)
    assert len(box.read(0.0)) == MOST_ITEMS
    with pytest.raises(DeviceError, match="wait to be read"):
        box.read(0.0)
    box.close()


@pytest.mark.parametrize(
    "sent", [b"b1 12\r\n", b"B1,12\r\n", b"alive\r\n", b"B1 12", b"\x80\xfe\x01\x80\n", b"\x1b[2J\n"]
)
def test_what_the_protocol_does_not_know_is_said_in_printable_words(
    line: PseudoTerminal, sent: bytes
) -> None:
    box = SerialBox(line.name, LineProtocol(), RealClock())
    box.open()
    line.send(sent)
    (found,) = read_inputs(box, bool)
    box.close()
    assert isinstance(found, Unreadable)
    assert found.may_be_answer
    assert f"{len(sent.strip())} bytes that the box's protocol does not know: " in found.what
    assert found.what.isprintable()


def test_only_the_declared_buttons_mean_felt(line: PseudoTerminal) -> None:
    box = SerialBox(line.name, LineProtocol(), RealClock())
    box.open()
    line.send(b"B1\nB2\n")
    assert [(press.button, press.felt) for press in read_all(box, 2)] == [("B1", True), ("B2", False)]
    box.close()


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    times_ms=st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=50),
    cuts=st.lists(st.integers(0, 10_000), max_size=20),
)
def test_same_presses_however_the_bytes_are_written(
    line: PseudoTerminal, times_ms: list[int], cuts: list[int]
) -> None:
    data = b"".join(b"B1 %d\r\n" % ms for ms in times_ms)
    bounds = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    box = SerialBox(line.name, LineProtocol(), RealClock())
    box.open()
    for start, end in itertools.pairwise(bounds):
        line.send(data[start:end])
    assert [press.device_time_s for press in read_all(box, len(times_ms))] == [ms / 1000 for ms in times_ms]
    box.close()


def test_bounces_are_kept(line: PseudoTerminal) -> None:
    protocol = SingleByteProtocol(buttons={"A": "left", "B": "right"}, felt=("left",))
    box = SerialBox(line.name, protocol, RealClock())
    box.open()
    line.send(b"AABxA")
    inputs = read_inputs(box, lambda inputs: len(presses_of(inputs)) >= 4)
    assert [press.button for press in presses_of(inputs)] == ["left", "left", "right", "left"]
    assert unreadable_bytes(inputs) == 1
    box.close()


def test_presses_sent_before_open_do_not_count(line: PseudoTerminal) -> None:
    line.send(b"B1\nB1\nB")
    box = SerialBox(line.name, LineProtocol(), RealClock())
    box.open()
    line.send(b"B2\n")
    assert [press.button for press in read_all(box, 1)] == ["B2"]
    box.close()


def test_unplugged_and_plugged_in_again(line: PseudoTerminal, pty: PseudoTerminal, tmp_path: Path) -> None:
    port = tmp_path / "by-id"
    port.symlink_to(line.name)
    box = SerialBox(str(port), LineProtocol(), RealClock())
    box.open()
    line.send(b"B1 1\n")
    assert len(read_all(box, 1)) == 1
    line.unplug()
    with pytest.raises(DeviceError, match="lost") as lost:
        box.read(RealClock().now_s() + SOON_S)
    assert str(port) in str(lost.value)
    assert "plug it in" in str(lost.value)
    box.close()
    port.unlink()
    with pytest.raises(DeviceError, match="cannot be opened"):
        box.open()
    tty.setraw(pty.near)
    port.symlink_to(pty.name)
    box.open()
    pty.send(b"B2 2\n")
    assert [press.button for press in read_all(box, 1)] == ["B2"]
    box.close()


def test_presses_just_before_the_unplugging_are_delivered_first(line: PseudoTerminal) -> None:
    box = SerialBox(line.name, LineProtocol(), RealClock())
    box.open()
    line.send(b"B1\nB2\n")
    RealClock().sleep_until(
        RealClock().now_s() + 0.2
    )  # a pty, unlike USB, forgets what was not read when closed
    line.unplug()
    RealClock().sleep_until(RealClock().now_s() + 0.2)
    assert [press.button for press in presses_of([*box.read(0.0)])] == ["B1", "B2"]
    with pytest.raises(DeviceError, match="lost"):
        box.read(0.0)
    box.close()


def test_missing_port_is_named_with_advice(tmp_path: Path) -> None:
    box = SerialBox(str(tmp_path / "ttyUSB7"), LineProtocol(), RealClock())
    with pytest.raises(DeviceError, match="ttyUSB7") as error:
        box.open()
    assert "plug it in, or correct the rig file" in str(error.value)
    assert error.value.exit_code == 4


def test_port_that_is_no_port(tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("no serial port")
    with pytest.raises(DeviceError, match="cannot be opened"):
        SerialBox(str(file), LineProtocol(), RealClock()).open()


def test_port_is_taken_for_one_process_alone(line: PseudoTerminal) -> None:
    first = SerialBox(line.name, LineProtocol(), RealClock())
    second = SerialBox(line.name, LineProtocol(), RealClock())
    first.open()
    with pytest.raises(DeviceError, match="no other program"):
        second.open()
    line.send(b"B1\n")
    assert len(read_all(first, 1)) == 1
    first.close()
    second.open()
    second.close()


def test_no_file_descriptor_is_left_behind(line: PseudoTerminal) -> None:
    box = SerialBox(line.name, LineProtocol(), RealClock())
    before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208
    for _ in range(20):
        box.open()
        box.close()
    assert len(os.listdir("/proc/self/fd")) == before  # noqa: PTH208


@pytest.mark.parametrize(("identity", "commands"), [(b"_xid0", b"_c1"), (b"_xid1", b"_c1c10")])
def test_xid_pad_is_asked_and_put_into_xid_mode(
    line: PseudoTerminal, identity: bytes, commands: bytes
) -> None:
    box = SerialBox(line.name, XidProtocol(), RealClock())
    with XidPad(line, identity) as pad:
        box.open()
        pad.press(3)
        (press,) = read_all(box, 1)
        box.close()
        assert pad.commands == commands
    assert press.button == "3"
    assert press.device_time_s == pytest.approx(1.01)


def test_something_else_than_an_xid_pad_is_refused(line: PseudoTerminal) -> None:
    with XidPad(line, b"hello"), pytest.raises(DeviceError, match="no Cedrus XID pad") as error:
        SerialBox(line.name, XidProtocol(), RealClock()).open()
    assert "hello" in str(error.value)


def test_silent_device_is_no_xid_pad(line: PseudoTerminal) -> None:
    with pytest.raises(DeviceError, match="no Cedrus XID pad"):
        SerialBox(line.name, XidProtocol(), RealClock()).open()


def test_ftdi_latency_is_read_through_links(tmp_path: Path) -> None:
    devices = tmp_path / "devices"
    (devices / "ttyUSB0").mkdir(parents=True)
    (devices / "ttyUSB0" / "latency_timer").write_text("16\n")
    port = tmp_path / "usb-FTDI-if00"
    port.symlink_to(tmp_path / "ttyUSB0")
    assert ftdi_latency_s(str(port), devices) == pytest.approx(0.016)
    assert ftdi_latency_s("/dev/ttyACM0", devices) is None
    assert ftdi_latency_s("COM3", devices) is None


@pytest.mark.parametrize("text", ["", "fast"])
def test_unreadable_ftdi_latency_is_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "ttyUSB0").mkdir()
    (tmp_path / "ttyUSB0" / "latency_timer").write_text(text)
    assert ftdi_latency_s("/dev/ttyUSB0", tmp_path) is None
