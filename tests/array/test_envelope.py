"""Samples and the ideal envelope: exact courses, the force law, and properties over all stimuli."""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.array.driver import Stimulus
from autd_trials.array.envelope import LARGEST_BUFFER, amplitude, samples
from autd_trials.errors import UsageError

LENGTH_ROUNDING = 1e-6
"""Of a sample: a length is taken for the whole number of samples that it is this close to."""

MakeStimulus = Callable[..., Stimulus]


@st.composite
def stimuli(draw: st.DrawFn) -> Stimulus:
    duration_s = draw(st.floats(0.0003, 16.0))
    return Stimulus(
        target_mm=(302.0, 225.0, 1000.0),
        duration_s=duration_s,
        modulation_hz=draw(st.floats(0.1, 1000)),
        waveform=draw(st.sampled_from(["sine", "square", "constant"])),
        depth=draw(st.floats(0, 1)),
        drive=1.0,
        force_law=draw(st.sampled_from(["amplitude", "pressure"])),
        ramp_s=draw(st.floats(0, min(0.5 * duration_s, 1.0))),
    )


@given(stimuli())
def test_any_burst_ends_at_zero_fits_the_buffer_and_lasts_as_long_as_asked(stimulus: Stimulus) -> None:
    played = samples(stimulus)
    assert played[-1] == 0
    assert 2 <= len(played) <= LARGEST_BUFFER
    periods = stimulus.duration_s * 4000
    assert len(played) == 2 or periods - LENGTH_ROUNDING <= len(played) < periods + 1 + LENGTH_ROUNDING


@given(stimuli())
def test_samples_are_the_ideal_envelope_at_the_ends_of_their_periods(stimulus: Stimulus) -> None:
    played = samples(stimulus)[:-1] / 255
    ideal = amplitude(stimulus, np.arange(1, len(played) + 1) / 4000)
    np.testing.assert_allclose(played, ideal, atol=0.5 / 255 + 1e-9)


@pytest.mark.parametrize("duration_s", [0.1, 0.10000000000000002, 0.09999999999999999, 1 / 3, 0.7, 16.0])
def test_rounding_of_a_length_costs_no_sample(make_stimulus: MakeStimulus, duration_s: float) -> None:
    assert len(samples(make_stimulus(duration_s=duration_s))) == math.ceil(
        round(Fraction(duration_s) * 4000, 6)
    )


@given(stimuli(), st.floats(-100, 100))
def test_outside_of_the_burst_the_ideal_envelope_is_zero(stimulus: Stimulus, time_s: float) -> None:
    level = float(amplitude(stimulus, np.array(time_s)))
    assert 0 <= level <= 1
    if not 0 <= time_s < stimulus.duration_s:
        assert level == 0


def test_a_sine_swings_from_zero_to_full(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(modulation_hz=25.0, ramp_s=0.0)
    at_s = np.array([0.0, 0.01, 0.02, 0.03, 0.04])
    np.testing.assert_allclose(amplitude(stimulus, at_s), [0, 0.5, 1, 0.5, 0], atol=1e-12)


def test_depth_raises_the_trough(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(modulation_hz=25.0, ramp_s=0.0, depth=0.4)
    np.testing.assert_allclose(amplitude(stimulus, np.array([0.0, 0.02])), [0.6, 1.0], atol=1e-12)


def test_a_square_wave_is_high_in_the_first_half_of_its_period(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(waveform="square", modulation_hz=100.0, ramp_s=0.0, depth=0.75)
    played = samples(stimulus)[:40]
    assert list(played) == [255] * 19 + [64] * 20 + [255]


def test_ramps_are_raised_cosines(make_stimulus: MakeStimulus) -> None:
    stimulus = make_stimulus(waveform="constant", ramp_s=0.1)
    at_s = np.array([0.0, 0.025, 0.05, 0.1, 0.5, 0.95, 0.975])
    expected = [0, (1 - math.cos(math.pi / 4)) / 2, 0.5, 1, 1, 0.5, (1 - math.cos(math.pi / 4)) / 2]
    np.testing.assert_allclose(amplitude(stimulus, at_s), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("force_law", "mean", "fundamental", "second"),
    [("amplitude", 0.375, 0.5, 0.125), ("pressure", 0.5, 0.5, 0.0)],
)
def test_the_force_laws_harmonics(
    make_stimulus: MakeStimulus, force_law: str, mean: float, fundamental: float, second: float
) -> None:
    """The radiation pressure goes with the amplitude's square; closed forms give its harmonics."""
    stimulus = make_stimulus(modulation_hz=50.0, ramp_s=0.0, force_law=force_law)
    force = (samples(stimulus)[:4000] / 255) ** 2
    spectrum = np.abs(np.fft.rfft(force)) / len(force)
    assert spectrum[0] == pytest.approx(mean, abs=2e-3)
    assert 2 * spectrum[50] == pytest.approx(fundamental, abs=2e-3)
    assert 2 * spectrum[100] == pytest.approx(second, abs=2e-3)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"duration_s": 16.5}, "duration_s"),
        ({"duration_s": 0.0}, "duration_s"),
        ({"duration_s": -1.0}, "duration_s"),
        ({"duration_s": math.nan}, "duration_s"),
        ({"duration_s": math.inf}, "duration_s"),
        ({"modulation_hz": 0.0}, "modulation_hz"),
        ({"modulation_hz": 1001.0}, "modulation_hz"),
        ({"modulation_hz": math.nan}, "modulation_hz"),
        ({"depth": 1.1}, "depth"),
        ({"depth": -0.1}, "depth"),
        ({"ramp_s": 0.6}, "ramp_s"),
        ({"ramp_s": -0.1}, "ramp_s"),
    ],
)
def test_what_cannot_be_sampled_is_refused(
    make_stimulus: MakeStimulus, changes: dict[str, float], named: str
) -> None:
    with pytest.raises(UsageError, match=named):
        samples(make_stimulus(**changes))
