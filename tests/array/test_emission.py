"""What devices would emit, by the SDK's offline recorder, fed with the very commands that the driver sends.

The recorder gives each transducer's pulse width (of 512) every 25 us; the amplitude is sin(pi width / 512).
"""

from collections.abc import Callable

import numpy as np
import pytest
from autd3 import Duration
from autd3.geometry import Autd3, Geometry
from autd3_emulator import Emulator, Recorder
from numpy.typing import NDArray

from autd_trials.array import envelope
from autd_trials.array.backend import Burst
from autd_trials.array.commands import (
    command_to_silence,
    command_to_start,
    commands_to_load,
    commands_to_open,
)
from autd_trials.array.driver import Stimulus

MakeStimulus = Callable[..., Stimulus]
Amplitudes = NDArray[np.float64]

ONSET_MS = 40
STEP_S = 25e-6
STEPS_PER_MS = 40
ONSET = ONSET_MS * STEPS_PER_MS


def record(stimulus: Stimulus, act: Callable[[Recorder], None], intensity: int = 255) -> Amplitudes:
    """Return the amplitude of a device's transducers (all the same) every 25 us, with the start at ONSET."""

    def run(recorder: Recorder) -> None:
        for command in commands_to_open():
            recorder.send(command)
        phases = np.full((1, 249), 37, np.uint8)
        for command in commands_to_load(Burst(envelope.samples(stimulus), phases, intensity)):
            recorder.send(command)
        recorder.tick(Duration.from_millis(5))
        recorder.send(command_to_start(ONSET_MS * 1_000_000))
        act(recorder)

    widths = Emulator(Geometry([Autd3([0, 0, 0])])).record(run).pulse_width().to_numpy()
    assert (widths == widths[0]).all()
    amplitudes: Amplitudes = np.sin(np.pi * widths[0].astype(np.float64) / 512)
    return amplitudes


def to_the_end(stimulus: Stimulus) -> Callable[[Recorder], None]:
    """Let the burst run, and 50 ms more."""
    return lambda recorder: recorder.tick(
        Duration.from_millis(ONSET_MS - 5 + round(1000 * stimulus.duration_s) + 50)
    )


@pytest.mark.parametrize("modulation_hz", [25.0, 50.0, 100.0, 37.3])
@pytest.mark.parametrize("force_law", ["amplitude", "pressure"])
def test_the_emission_follows_the_envelope_within_one_percent_and_is_silent_outside(
    make_stimulus: MakeStimulus, modulation_hz: float, force_law: str
) -> None:
    stimulus = make_stimulus(modulation_hz=modulation_hz, force_law=force_law)
    emitted = record(stimulus, to_the_end(stimulus))
    ends = ONSET + round(stimulus.duration_s / STEP_S)
    assert not emitted[:ONSET].any()
    assert not emitted[ends:].any()
    time_s: Amplitudes = (
        np.arange(ends - ONSET, dtype=np.float64) + 0.5
    ) * STEP_S  # a recorded value holds for 25 us
    ideal = envelope.amplitude(stimulus, time_s)
    assert np.sqrt(np.mean((emitted[ONSET:ends] - ideal) ** 2)) < 0.01
    assert abs(delay_s(emitted[ONSET:ends], ideal)) < 25e-6


@pytest.mark.parametrize("waveform", ["constant", "square"])
def test_the_emission_starts_within_25_us_of_the_start_time(
    make_stimulus: MakeStimulus, waveform: str
) -> None:
    stimulus = make_stimulus(waveform=waveform, duration_s=0.05, ramp_s=0.0)
    emitted = record(stimulus, to_the_end(stimulus))
    assert not emitted[:ONSET].any()
    assert emitted[ONSET] > 0.05


def test_without_a_ramp_the_silencer_rises_and_falls_in_250_us(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(waveform="constant", duration_s=0.02, ramp_s=0.0)
    emitted = record(stimulus, to_the_end(stimulus))[ONSET : ONSET + 20 * STEPS_PER_MS]
    rise = np.arange(1, 11) / 10
    np.testing.assert_allclose(emitted[:10], rise, atol=0.01)
    np.testing.assert_allclose(emitted[10:-10], 1.0)
    np.testing.assert_allclose(emitted[-10:], 1 - rise, atol=0.01)


def test_before_the_start_a_loaded_burst_is_silent(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(waveform="constant", duration_s=0.05)
    emitted = record(stimulus, lambda recorder: recorder.tick(Duration.from_millis(ONSET_MS - 6)))
    assert len(emitted) == (ONSET_MS - 1) * STEPS_PER_MS
    assert not emitted.any()


def test_an_abort_silences_within_a_millisecond(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(waveform="constant", duration_s=0.2)

    def abort_after_50_ms(recorder: Recorder) -> None:
        recorder.tick(Duration.from_millis(ONSET_MS - 5 + 50))
        recorder.send(command_to_silence())
        recorder.tick(Duration.from_millis(300))

    emitted = record(stimulus, abort_after_50_ms)
    aborted = ONSET + 50 * STEPS_PER_MS
    assert emitted[aborted - 1] == 1.0
    assert not emitted[aborted + STEPS_PER_MS :].any()


def test_an_abort_before_the_onset_cancels_it(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(waveform="constant", duration_s=0.05)

    def abort_at_once(recorder: Recorder) -> None:
        recorder.send(command_to_silence())
        recorder.tick(Duration.from_millis(150))

    assert not record(stimulus, abort_at_once).any()


@pytest.mark.parametrize("intensity", [0, 1, 26, 64, 128, 204, 255])
def test_the_amplitude_is_proportional_to_the_intensity(make_stimulus: MakeStimulus, intensity: int) -> None:
    stimulus = make_stimulus(waveform="constant", duration_s=0.02)
    emitted = record(stimulus, to_the_end(stimulus), intensity)
    assert emitted.max() == pytest.approx(intensity / 255, abs=0.004)
    assert bool(emitted.any()) is (intensity > 0)


def test_a_second_burst_is_emitted_like_the_first(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(duration_s=0.05)
    burst = Burst(envelope.samples(stimulus), np.zeros((1, 249), np.uint8), 255)

    def again(recorder: Recorder) -> None:
        recorder.tick(Duration.from_millis(ONSET_MS - 5 + 60))
        for command in commands_to_load(burst):
            recorder.send(command)
        recorder.tick(Duration.from_millis(10))
        recorder.send(command_to_start(2 * ONSET_MS * 1_000_000 + 70_000_000))
        recorder.tick(Duration.from_millis(150))

    emitted = record(stimulus, again)
    second = 2 * ONSET + 70 * STEPS_PER_MS
    length = 50 * STEPS_PER_MS
    np.testing.assert_array_equal(emitted[ONSET : ONSET + length], emitted[second : second + length])
    assert not emitted[ONSET + length : second].any()
    assert not emitted[second + length :].any()


def delay_s(emitted: Amplitudes, ideal: Amplitudes) -> float:
    """Return by how much the emission lags the ideal, from their first-order difference."""
    slope_per_s = np.gradient(ideal, STEP_S)
    return float(-np.sum((emitted - ideal) * slope_per_s) / np.sum(slope_per_s**2))
