"""What every array driver does: the same tests over virtual devices and over the SDK's firmware emulator.

The emulated ones run in real time, on one open array.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from autd_trials.array.autd3_backend import Autd3Backend
from autd_trials.array.backend import Backend
from autd_trials.array.driver import ArrayDriver, ArrayInfo, Stimulus
from autd_trials.array.geometry import UnitPose
from autd_trials.array.link import EmulatorLink
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import Clock, RealClock, VirtualClock
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.stimulus import Limits

MakeStimulus = Callable[..., Stimulus]
SPEED_M_S = 343.2


@dataclass
class Rig:
    array: ArrayDriver
    info: ArrayInfo
    clock: Clock


@pytest.fixture(params=["virtual", pytest.param("autd3", marks=pytest.mark.emulator)])
def rig(
    request: pytest.FixtureRequest, units: list[UnitPose], limits: Limits, virtual_clock: VirtualClock
) -> Iterator[Rig]:
    clock: Clock = virtual_clock if request.param == "virtual" else RealClock()
    backend: Backend = (
        VirtualBackend(clock) if request.param == "virtual" else Autd3Backend(EmulatorLink(), clock)
    )
    array = PhasedArray(units, backend, limits, clock, speed_of_sound_m_s=SPEED_M_S)
    info = array.open()
    yield Rig(array, info, clock)
    array.close()


@pytest.fixture
def burst(make_stimulus: MakeStimulus) -> Stimulus:
    return make_stimulus(duration_s=0.1)


def test_opening_tells_what_is_there(rig: Rig) -> None:
    assert (rig.info.devices, rig.info.transducers) == (18, 4482)
    assert rig.info.emulated
    assert len(rig.info.firmware) == 18
    assert rig.array.health().ok


def test_a_burst_starts_when_asked_and_ends_by_itself(rig: Rig, burst: Stimulus) -> None:
    assert rig.array.arm(burst).exposure_s == pytest.approx(0.1)
    asked_s = rig.clock.now_s() + rig.array.lead_s + 0.05
    onset = rig.array.start(asked_s)
    assert onset.requested_s == asked_s
    assert -1e-9 <= onset.onset_s - asked_s < 251e-6
    assert onset.device_ns % 250_000 == 0
    assert onset.margin_s >= 0.01
    completion = rig.array.finish()
    assert completion.silent_s < onset.onset_s <= completion.emitting_s + 1e-9
    assert completion.emitting_s < onset.onset_s + burst.duration_s
    assert 0 <= completion.ended_s - (onset.onset_s + burst.duration_s) + 1e-3 < 0.1
    assert completion.health.ok


def test_a_late_start_moves_the_onset_and_says_so(rig: Rig, burst: Stimulus) -> None:
    rig.array.arm(burst)
    now_s = rig.clock.now_s()
    onset = rig.array.start(now_s - 5.0)
    assert onset.requested_s == now_s - 5.0
    assert onset.onset_s >= now_s + 0.01
    assert onset.margin_s >= 0.01
    rig.array.finish()


def test_consecutive_bursts_alike(rig: Rig, burst: Stimulus, make_stimulus: MakeStimulus) -> None:
    for stimulus in (burst, burst, make_stimulus(duration_s=0.05, drive=0.5), burst):
        rig.array.arm(stimulus)
        onset = rig.array.start(rig.clock.now_s())
        completion = rig.array.finish()
        assert completion.silent_s < onset.onset_s <= completion.emitting_s + 1e-9


def test_a_catch_trial_goes_like_any_other(rig: Rig, make_stimulus: MakeStimulus) -> None:
    assert rig.array.arm(make_stimulus(duration_s=0.1, drive=0.0)).exposure_s == 0
    onset = rig.array.start(rig.clock.now_s())
    assert rig.array.finish().ended_s >= onset.onset_s + 0.1 - 1e-3


def test_a_long_burst_is_aborted_at_once(rig: Rig, make_stimulus: MakeStimulus) -> None:
    rig.array.arm(make_stimulus(duration_s=2.0))
    onset = rig.array.start(rig.clock.now_s())
    rig.clock.sleep_until(onset.onset_s + 0.05)
    before_s = rig.clock.now_s()
    rig.array.abort()
    assert rig.clock.now_s() - before_s < 1.0
    rig.array.abort()
    assert rig.array.health().ok


def test_after_an_abort_the_next_burst_is_emitted(
    rig: Rig, burst: Stimulus, make_stimulus: MakeStimulus
) -> None:
    rig.array.arm(make_stimulus(duration_s=2.0))
    rig.array.start(rig.clock.now_s())
    rig.array.abort()
    rig.array.arm(burst)
    onset = rig.array.start(rig.clock.now_s())
    assert rig.array.finish().emitting_s >= onset.onset_s - 1e-9


def test_an_armed_burst_may_be_dropped_and_armed_again(rig: Rig, burst: Stimulus) -> None:
    rig.array.arm(burst)
    rig.array.abort()
    with pytest.raises(RuntimeError, match="armed"):
        rig.array.start(rig.clock.now_s())
    rig.array.arm(burst)
    rig.array.arm(burst)
    rig.array.start(rig.clock.now_s())
    rig.array.finish()


def test_what_is_over_a_limit_is_refused_and_nothing_is_armed(rig: Rig, make_stimulus: MakeStimulus) -> None:
    with pytest.raises(UnsafeError, match="length"):
        rig.array.arm(make_stimulus(duration_s=3.0))
    with pytest.raises(UsageError, match="out of reach of unit 1"):
        rig.array.arm(make_stimulus(target_mm=(302.0, 225.0, 3000.0)))
    with pytest.raises(RuntimeError, match="armed"):
        rig.array.start(rig.clock.now_s())


def test_a_whole_plan_is_checked_without_emitting(rig: Rig, burst: Stimulus) -> None:
    rig.array.check([burst] * 900)
    with pytest.raises(UnsafeError, match="exposure"):
        rig.array.check([burst] * 1001)


def test_closing_twice_and_aborting_when_closed_is_harmless(rig: Rig, burst: Stimulus) -> None:
    rig.array.arm(burst)
    rig.array.start(rig.clock.now_s())
    rig.array.close()
    rig.array.close()
    rig.array.abort()
    with pytest.raises(RuntimeError, match="not open"):
        rig.array.arm(burst)
