"""Nothing is emitted once `halt` has returned, whatever the thread that uses the array was doing.

The same tests over virtual devices and over the SDK's firmware emulator; here both in real time.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from threading import Event, Thread

import numpy as np
import pytest

from autd_trials.array.autd3_backend import Autd3Backend
from autd_trials.array.backend import Backend
from autd_trials.array.driver import Stimulus
from autd_trials.array.emulator import Emulator
from autd_trials.array.geometry import UnitPose
from autd_trials.array.link import EmulatorLink
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import RealClock, VirtualClock
from autd_trials.errors import StoppedByPerson
from autd_trials.stimulus import Limits

MakeStimulus = Callable[..., Stimulus]


@dataclass
class User(Thread):
    """The thread that uses the array; keeps what stopped it."""

    use: Callable[[], object]
    stopped_by: list[BaseException] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__(daemon=True)

    __hash__ = Thread.__hash__

    def run(self) -> None:
        try:
            self.use()
        except BaseException as error:
            self.stopped_by.append(error)


@dataclass
class Bench:
    array: PhasedArray
    backend: Backend
    clock: RealClock


@pytest.fixture(params=["virtual", pytest.param("autd3", marks=pytest.mark.emulator)])
def bench(request: pytest.FixtureRequest, units: list[UnitPose]) -> Iterator[Bench]:
    clock = RealClock()
    backend: Backend = (
        VirtualBackend(clock) if request.param == "virtual" else Autd3Backend(EmulatorLink(), clock)
    )
    limits = Limits(
        largest_drive=1.0,
        longest_burst_s=16.0,
        largest_duty=1.0,
        session_exposure_s=36_000.0,
        daily_exposure_s=36_000.0,
    )
    array = PhasedArray(units, backend, limits, clock, speed_of_sound_m_s=343.2)
    array.open()
    yield Bench(array, backend, clock)
    array.close()


@pytest.fixture
def use(bench: Bench) -> Iterator[Callable[[Callable[[], object]], User]]:
    """Return what runs something in the thread that uses the array; ended with the array."""
    users: list[User] = []

    def run(use: Callable[[], object]) -> User:
        users.append(User(use))
        users[-1].start()
        return users[-1]

    yield run
    bench.array.halt()
    for user in users:
        user.join(10)
        assert not user.is_alive()


Use = Callable[[Callable[[], object]], User]


@pytest.mark.parametrize("duration_s", [0.02, 4.0])
def test_no_interleaving_lets_anything_through(
    bench: Bench, use: Use, make_stimulus: MakeStimulus, duration_s: float
) -> None:
    """Trials run one after the other while the array is halted at a random moment, again and again."""

    def run_trials() -> None:
        while True:
            bench.array.arm(make_stimulus(duration_s=duration_s))
            bench.array.start(bench.clock.now_s())
            bench.array.finish()

    emissions = bench.backend.emissions if isinstance(bench.backend, VirtualBackend) else []
    for moment_s in np.random.default_rng(20261125).uniform(0, 0.2, 12):
        bench.backend.halted.clear()
        user = use(run_trials)
        time.sleep(moment_s)
        bench.array.halt()
        at_return = bench.backend.states()
        emitted = list(emissions)
        assert at_return.silent
        user.join(10)
        assert [type(error) for error in user.stopped_by] == [StoppedByPerson]
        time.sleep(0.02)
        assert bench.backend.states().silent
        assert emissions == emitted
        bench.array.abort()


def test_a_start_that_is_overtaken_emits_nothing(
    units: list[UnitPose], limits: Limits, make_stimulus: MakeStimulus
) -> None:
    """The thread that uses the array hangs right before the start command, which it sends after the halt."""
    clock = RealClock()
    backend = VirtualBackend(clock)
    array = PhasedArray(units, backend, limits, clock, speed_of_sound_m_s=343.2)
    array.open()
    hangs, go_on = Event(), Event()

    def hang() -> None:
        hangs.set()
        go_on.wait(10)

    backend.faults.before_start = hang
    array.arm(make_stimulus())
    user = User(lambda: array.start(clock.now_s()))
    user.start()
    assert hangs.wait(10)
    array.halt()
    go_on.set()
    user.join(10)
    assert [type(error) for error in user.stopped_by] == [StoppedByPerson]
    assert backend.emissions == []


def test_a_halted_array_refuses_until_it_is_opened_again(bench: Bench, make_stimulus: MakeStimulus) -> None:
    bench.array.arm(make_stimulus(duration_s=8.0))
    bench.array.start(bench.clock.now_s())
    bench.array.halt()
    for call in (
        lambda: bench.array.finish(),
        lambda: bench.array.arm(make_stimulus()),
        lambda: bench.array.start(bench.clock.now_s()),
    ):
        with pytest.raises(StoppedByPerson, match="the array was halted"):
            call()
    assert bench.array.health().ok
    bench.array.halt()
    bench.array.abort()
    bench.array.close()
    bench.array.halt()
    bench.array.open()
    bench.array.arm(make_stimulus(duration_s=0.02))
    bench.array.start(bench.clock.now_s())
    bench.array.finish()


@pytest.mark.emulator
def test_an_array_that_is_halted_while_it_opens_is_not_opened(units: list[UnitPose], limits: Limits) -> None:
    clock = RealClock()
    array = PhasedArray(units, Autd3Backend(EmulatorLink(), clock), limits, clock, speed_of_sound_m_s=343.2)
    user = User(array.open)
    user.start()
    while user.is_alive():
        array.halt()
    assert [type(error) for error in user.stopped_by] == [StoppedByPerson]
    array.close()


def test_halting_never_raises_whatever_failed(
    units: list[UnitPose], limits: Limits, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    backend = VirtualBackend(virtual_clock)
    array = PhasedArray(units, backend, limits, virtual_clock, speed_of_sound_m_s=343.2)
    array.halt()
    array.open()
    array.arm(make_stimulus())
    backend.faults.lost_devices = 3
    array.halt()
    backend.faults.lost_devices = 0
    with pytest.raises(StoppedByPerson):
        array.start(virtual_clock.now_s())


@pytest.mark.emulator
def test_halting_devices_that_are_gone_returns(
    units: list[UnitPose], limits: Limits, make_stimulus: MakeStimulus
) -> None:
    clock = RealClock()
    with Emulator(18) as emulator:
        backend = Autd3Backend(EmulatorLink(emulator.address), clock)
        array = PhasedArray(units, backend, limits, clock, speed_of_sound_m_s=343.2)
        array.open()
        array.arm(make_stimulus())
        emulator.kill()
        array.halt()
        with pytest.raises(StoppedByPerson):
            array.start(clock.now_s())
        array.close()
