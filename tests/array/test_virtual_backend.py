"""The virtual devices keep what they would have emitted; and what follows when they fail."""

from collections.abc import Callable

import numpy as np
import pytest

from autd_trials.array import envelope
from autd_trials.array.driver import Stimulus
from autd_trials.array.focus import focus_phases
from autd_trials.array.geometry import UnitPose, transducer_positions_mm
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError, UnsafeError, UsageError
from autd_trials.stimulus import Limits
from tests.array.conftest import watch_until

MakeStimulus = Callable[..., Stimulus]
STEP_NS = 25_000


@pytest.fixture
def backend(virtual_clock: VirtualClock) -> VirtualBackend:
    return VirtualBackend(virtual_clock)


@pytest.fixture
def array(
    units: list[UnitPose], limits: Limits, backend: VirtualBackend, virtual_clock: VirtualClock
) -> PhasedArray:
    array = PhasedArray(units, backend, limits, virtual_clock, speed_of_sound_m_s=343.2)
    array.open()
    return array


def emitted(backend: VirtualBackend, from_ns: int, duration_s: float) -> np.ndarray:
    return backend.emitted_amplitude(from_ns + np.arange(0, round(duration_s * 1e9), STEP_NS))


@pytest.mark.parametrize("modulation_hz", [25.0, 37.3, 100.0])
def test_the_emission_follows_the_envelope_and_the_drive(
    array: PhasedArray,
    backend: VirtualBackend,
    virtual_clock: VirtualClock,
    make_stimulus: MakeStimulus,
    modulation_hz: float,
) -> None:
    stimulus = make_stimulus(modulation_hz=modulation_hz, drive=0.6)
    array.arm(stimulus)
    onset = array.start(virtual_clock.now_s() + 1.0)
    array.finish()
    amplitude = emitted(backend, onset.device_ns, 1.0)
    ideal = 0.6 * envelope.amplitude(stimulus, np.arange(len(amplitude)) * STEP_NS / 1e9)
    assert np.sqrt(np.mean((amplitude - ideal) ** 2)) < 0.01 * 0.6
    assert not emitted(backend, onset.device_ns - 1_000_000_000, 1.0).any()
    assert not emitted(backend, onset.device_ns + 1_000_000_000, 5.0).any()


def test_it_keeps_the_phases_of_the_focus(
    array: PhasedArray,
    backend: VirtualBackend,
    units: list[UnitPose],
    virtual_clock: VirtualClock,
    make_stimulus: MakeStimulus,
) -> None:
    array.arm(make_stimulus())
    array.start(virtual_clock.now_s())
    array.finish()
    expected = focus_phases(transducer_positions_mm(units), (302.0, 225.0, 1000.0), 343.2)
    np.testing.assert_array_equal(backend.emissions[0].burst.phases, expected)


def test_an_abort_ends_the_emission_within_a_millisecond(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus(waveform="constant"))
    onset = array.start(virtual_clock.now_s())
    virtual_clock.sleep_until(onset.onset_s + 0.3)
    array.abort()
    assert emitted(backend, onset.device_ns + 299_000_000, 0.0009).min() > 0.99
    assert not emitted(backend, onset.device_ns + 301_000_000, 2.0).any()


def test_a_start_that_is_aborted_before_its_time_emits_nothing(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus())
    array.start(virtual_clock.now_s() + 1.0)
    array.abort()
    virtual_clock.sleep_until(virtual_clock.now_s() + 5.0)
    assert backend.emissions == []


def test_a_catch_trial_emits_nothing(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus(drive=0.0))
    onset = array.start(virtual_clock.now_s())
    array.finish()
    assert not emitted(backend, onset.device_ns, 1.0).any()


def test_a_refused_start_is_silenced_and_tried_again_later(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    backend.faults.refused_starts = 2
    array.arm(make_stimulus())
    onset = array.start(virtual_clock.now_s())
    array.finish()
    assert [emission.onset_ns for emission in backend.emissions] == [onset.device_ns]


def test_starts_that_are_always_refused_fail(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    backend.faults.refused_starts = 99
    array.arm(make_stimulus())
    with pytest.raises(DeviceError, match="refused 3 starts"):
        array.start(virtual_clock.now_s())
    assert backend.emissions == []


def test_every_attempt_is_on_the_account(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    backend.faults.refused_starts = 1
    array.arm(make_stimulus(drive=0.5))
    array.start(virtual_clock.now_s())
    array.abort()
    assert array.exposure_used_s == pytest.approx(0.5)


def test_devices_lost_in_mid_burst_are_noticed_and_told(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus(duration_s=2.0))
    onset = array.start(virtual_clock.now_s())
    backend.faults.lost_devices = 1
    backend.faults.lost_from_s = onset.onset_s + 0.5
    with pytest.raises(DeviceError, match=r"only 17 of 18 devices answer; .* did not confirm .* silent"):
        array.finish()
    assert virtual_clock.now_s() - backend.faults.lost_from_s < 1.0


def test_a_failsafe_in_mid_burst_is_noticed_and_mutes(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus(waveform="constant"))
    onset = array.start(virtual_clock.now_s())
    backend.faults.failsafe_from_s = onset.onset_s + 0.5
    with pytest.raises(DeviceError, match="failsafe"):
        array.finish()
    assert not emitted(backend, onset.device_ns + 501_000_000, 2.0).any()


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("lost", "only 17 of 18 devices answer"),
        ("unanswered", r"not answered for 0\.2"),
        ("failsafe", "failsafe"),
        ("thermal", "too hot"),
    ],
)
def test_a_fault_in_mid_burst_is_noticed_within_0_3_s(
    array: PhasedArray,
    backend: VirtualBackend,
    virtual_clock: VirtualClock,
    make_stimulus: MakeStimulus,
    fault: str,
    message: str,
) -> None:
    array.arm(make_stimulus(duration_s=2.0))
    onset = array.start(virtual_clock.now_s())
    backend.faults.lost_devices = int(fault == "lost")
    setattr(backend.faults, f"{fault}_from_s", onset.onset_s + 0.5)
    with pytest.raises(DeviceError, match=message):
        watch_until(array, virtual_clock, onset.onset_s + 2.0)
    assert 0.5 <= virtual_clock.now_s() - onset.onset_s < 0.8
    if fault in ("failsafe", "thermal"):
        assert not emitted(backend, onset.device_ns + 801_000_000, 2.0).any()
    with pytest.raises(RuntimeError, match="no stimulus was started"):
        array.finish()


def test_a_busy_computer_is_not_taken_for_lost_devices(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus(duration_s=2.0))
    onset = array.start(virtual_clock.now_s())
    backend.faults.unanswered_from_s = onset.onset_s + 0.5
    backend.faults.stalled_s = 0.4
    with pytest.raises(DeviceError, match=r"not answered for 0\.6.*this computer stood still for 0\.40 s"):
        watch_until(array, virtual_clock, onset.onset_s + 2.0)


def test_no_trial_begins_on_unwell_devices(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    backend.faults.failsafe_from_s = virtual_clock.now_s()
    with pytest.raises(DeviceError, match="failsafe"):
        array.arm(make_stimulus())
    assert not array.health().ok


def test_devices_that_became_unwell_since_arming_are_not_started(
    array: PhasedArray, backend: VirtualBackend, virtual_clock: VirtualClock, make_stimulus: MakeStimulus
) -> None:
    array.arm(make_stimulus())
    backend.faults.lost_devices = 3
    with pytest.raises(DeviceError, match="15 of 18"):
        array.start(virtual_clock.now_s())
    assert backend.emissions == []


def test_a_drive_too_small_to_be_emitted_is_refused(array: PhasedArray, make_stimulus: MakeStimulus) -> None:
    with pytest.raises(UsageError, match="too small"):
        array.arm(make_stimulus(drive=0.001))


def test_too_many_bursts_in_a_minute_are_refused_and_not_emitted(
    units: list[UnitPose],
    backend: VirtualBackend,
    virtual_clock: VirtualClock,
    make_stimulus: MakeStimulus,
    limits: Limits,
) -> None:
    strict = limits.model_copy(update={"largest_duty": 1.5 / 60})
    array = PhasedArray(units, backend, strict, virtual_clock, speed_of_sound_m_s=343.2)
    array.open()
    array.arm(make_stimulus())
    array.start(virtual_clock.now_s())
    array.finish()
    array.arm(make_stimulus())
    with pytest.raises(UnsafeError, match="share of on-time"):
        array.start(virtual_clock.now_s())
    assert len(backend.emissions) == 1
