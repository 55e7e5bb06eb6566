"""The one contract that every responder keeps, real or simulated."""

import dataclasses
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import pytest

from autd_trials.clock import Clock, RealClock, VirtualClock
from autd_trials.errors import DeviceError
from autd_trials.participants.simulated import SimulatedParticipant
from autd_trials.participants.traits import ParticipantTraits
from autd_trials.responses.box_protocols import BoxProtocol, LineProtocol, SingleByteProtocol, XidProtocol
from autd_trials.responses.keyboard import KeyboardResponder
from autd_trials.responses.responder import Input, Presentation, Press, Responder
from autd_trials.responses.serial_box import SerialBox
from autd_trials.terminal import Terminal
from tests.conftest import PseudoTerminal
from tests.responses.conftest import XidPad

SHORT_S = 0.03
SOON_S = 60.0
"""Long enough for a press to come through on a busy machine; never waited for in full."""


@dataclass(frozen=True)
class Bench:
    """A responder and somebody who presses its button; `unplug` is None where there is nothing to unplug."""

    responder: Responder
    clock: Clock
    press: Callable[[], None]
    unplug: Callable[[], None] | None = None

    def read(self, duration_s: float) -> Sequence[Input]:
        return self.responder.read(self.clock.now_s() + duration_s)

    def read_all(self, count: int) -> list[Input]:
        """Read until `count` presses came, or nothing for a while."""
        presses: list[Input] = []
        while len(presses) < count and (new := self.read(SOON_S)):
            presses += new
        return presses


def keyboard_bench(pty: PseudoTerminal) -> Iterator[Bench]:
    clock = RealClock()
    with Terminal(clock, fd=pty.near) as terminal:
        yield Bench(KeyboardResponder(terminal), clock, lambda: pty.send(b" "), pty.unplug)


def serial_bench(line: PseudoTerminal, protocol: BoxProtocol, message: bytes) -> Iterator[Bench]:
    clock = RealClock()
    yield Bench(SerialBox(line.name, protocol, clock), clock, lambda: line.send(message), line.unplug)


def xid_bench(line: PseudoTerminal) -> Iterator[Bench]:
    clock = RealClock()
    with XidPad(line) as pad:
        yield Bench(SerialBox(line.name, XidProtocol(), clock), clock, pad.press, pad.unplug)


def simulated_bench() -> Iterator[Bench]:
    clock = VirtualClock(datetime(2026, 1, 1, tzinfo=UTC))
    trials = iter(range(1, 10_000))

    def press() -> None:
        while not feels(
            shown := presentation(next(trials), clock.now_s())
        ):  # one attempt in a hundred lapses
            pass
        participant.present(shown)

    participant = eager_participant(clock)
    yield Bench(participant, clock, press)


def eager_participant(clock: Clock) -> SimulatedParticipant:
    traits = ParticipantTraits(threshold_offset_db=0, inner_loss_db=-1, outer_loss_db=-1, criterion=-1000)
    return SimulatedParticipant(clock, seed=1, place=1, session=1, traits=traits)


def feels(shown: Presentation) -> bool:
    probe = eager_participant(VirtualClock(datetime(2026, 1, 1, tzinfo=UTC)))
    probe.open()
    probe.present(shown)
    return bool(probe.read(shown.onset_s + 100.0))


def presentation(trial: int, onset_s: float) -> Presentation:
    return Presentation(
        trial, 1, onset_s, duration_s=1.0, drive=1.0, modulation_hz=100.0, target="chest", conditions={}
    )


HARDWARE = ["keyboard", "line", "single_byte", "xid"]


@pytest.fixture(params=[*HARDWARE, "simulated"])
def bench(request: pytest.FixtureRequest, pty: PseudoTerminal, line: PseudoTerminal) -> Iterator[Bench]:
    """Each responder in turn; for hardware alone, parametrize it indirectly with `HARDWARE`."""
    benches = {
        "keyboard": lambda: keyboard_bench(pty),
        "line": lambda: serial_bench(line, LineProtocol(), b"B1 12345\r\n"),
        "single_byte": lambda: serial_bench(line, SingleByteProtocol(buttons={"A": "left"}), b"A"),
        "xid": lambda: xid_bench(line),
        "simulated": simulated_bench,
    }
    for bench in benches[request.param]():
        yield bench
        bench.responder.close()


def test_info_says_what_it_is(bench: Bench) -> None:
    info = bench.responder.open()
    assert info.kind
    assert info.device
    assert 0 <= info.time_uncertainty_s < 0.1


def test_read_waits_until_the_clock_shows_it(bench: Bench) -> None:
    bench.responder.open()
    until_s = bench.clock.now_s() + SHORT_S
    assert bench.responder.read(until_s) == []
    assert until_s <= bench.clock.now_s() < until_s + 1.0


def test_read_of_the_past_returns_at_once(bench: Bench) -> None:
    bench.responder.open()
    before_s = bench.clock.now_s()
    assert bench.responder.read(before_s - 10.0) == []
    assert bench.clock.now_s() < before_s + 1.0


def test_press_ends_the_wait(bench: Bench) -> None:
    bench.responder.open()
    before_s = bench.clock.now_s()
    bench.press()
    (press,) = bench.read(600.0)
    assert before_s <= press.time_s <= bench.clock.now_s() < before_s + 100.0
    assert isinstance(press, Press)
    assert press.button
    assert press.felt


def test_presses_are_frozen(bench: Bench) -> None:
    bench.responder.open()
    bench.press()
    (press,) = bench.read(SOON_S)
    with pytest.raises(dataclasses.FrozenInstanceError):
        press.time_s = 0.0  # type: ignore[misc]


def test_every_press_of_a_burst_is_kept_in_order(bench: Bench) -> None:
    bench.responder.open()
    for _ in range(50):
        bench.press()
    presses = bench.read_all(50)
    assert len(presses) == 50
    assert [press.time_s for press in presses] == sorted(press.time_s for press in presses)
    assert bench.read(SHORT_S) == []


@pytest.mark.parametrize("bench", HARDWARE, indirect=True)
def test_present_without_a_person_makes_no_press(bench: Bench) -> None:
    bench.responder.open()
    bench.responder.present(presentation(1, bench.clock.now_s()))
    assert bench.read(SHORT_S) == []


def test_closed_responder_is_no_device(bench: Bench) -> None:
    with pytest.raises(DeviceError, match="not open"):
        bench.read(0.0)
    bench.responder.open()
    bench.responder.close()
    with pytest.raises(DeviceError, match="not open"):
        bench.read(0.0)


def test_close_may_be_called_at_any_time(bench: Bench) -> None:
    bench.responder.close()
    bench.responder.open()
    bench.responder.close()
    bench.responder.close()
    with pytest.raises(DeviceError, match="not open"):
        bench.read(0.0)


def test_reopened_responder_forgets_old_presses_and_takes_new_ones(bench: Bench) -> None:
    bench.responder.open()
    bench.press()
    assert bench.read(SOON_S)
    bench.press()
    bench.clock.sleep_until(bench.clock.now_s() + 0.2)  # it is on its way
    bench.responder.close()
    bench.responder.open()
    assert bench.read(SHORT_S) == []
    bench.press()
    assert len(bench.read(SOON_S)) == 1


@pytest.mark.parametrize("bench", HARDWARE, indirect=True)
def test_presses_before_a_loss_are_delivered_then_the_loss_is_told_again_and_again(bench: Bench) -> None:
    assert bench.unplug is not None
    bench.responder.open()
    bench.press()
    assert bench.read(SOON_S)
    bench.unplug()
    for _ in range(2):
        with pytest.raises(DeviceError, match="lost"):
            bench.read(SOON_S)
    bench.responder.close()


@pytest.mark.parametrize("bench", HARDWARE, indirect=True)
def test_loss_ends_the_wait(bench: Bench) -> None:
    assert bench.unplug is not None
    bench.responder.open()
    started_s = bench.clock.now_s()
    timer = threading.Timer(SHORT_S, bench.unplug)
    timer.start()
    with pytest.raises(DeviceError, match="lost"):
        bench.read(60.0)
    timer.join()
    assert bench.clock.now_s() - started_s < 10.0
