"""The noise is pink, seamless, exactly as loud as asked, and never clipped."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import signal

from autd_trials.errors import UsageError
from autd_trials.masking.noise import pink_noise, raised_cosine

RATE_HZ = 48_000
Samples = NDArray[np.float32]


@pytest.fixture(scope="module")
def loop() -> Samples:
    return pink_noise(np.random.default_rng(20261122), -30.0)


def _third_octave_levels_db(
    samples: Samples, rate_hz: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power spectral density in third-octave bands around 100 Hz to 10 kHz, by Welch's method."""
    frequency_hz, density = signal.welch(samples, rate_hz, nperseg=2**15)
    centres_hz = 1000 * 10 ** (np.arange(-10, 11) / 10)
    bands = [(frequency_hz >= c * 10**-0.05) & (frequency_hz < c * 10**0.05) for c in centres_hz]
    return centres_hz, np.array([10 * np.log10(np.mean(density[band])) for band in bands])


@pytest.mark.parametrize("rate_hz", [44_100, 48_000, 96_000])
def test_power_falls_by_10_db_a_decade_within_half_a_decibel(rate_hz: int) -> None:
    noise = pink_noise(np.random.default_rng(5), -30.0, sample_rate_hz=rate_hz)

    centres_hz, levels_db = _third_octave_levels_db(noise, rate_hz)
    slope_db, _ = np.polyfit(np.log10(centres_hz), levels_db, 1)
    ideal_db = -10 * np.log10(centres_hz)
    deviation_db = levels_db - ideal_db - np.mean(levels_db - ideal_db)

    assert slope_db == pytest.approx(-10, abs=0.1)
    assert np.max(np.abs(deviation_db)) < 0.5


def test_all_third_octave_bands_have_the_same_power(loop: Samples) -> None:
    """An estimator of another kind: Butterworth filters in the time domain."""
    powers_db = []
    for centre_hz in 1000 * 10 ** (np.arange(-10, 11, 4) / 10):
        edges_hz = [centre_hz * 10**-0.05, centre_hz * 10**0.05]
        band = signal.sosfilt(signal.butter(4, edges_hz, "bandpass", fs=RATE_HZ, output="sos"), loop)
        powers_db.append(10 * np.log10(np.mean(np.square(band))))
    assert np.ptp(powers_db) < 0.5


def test_nothing_lies_outside_20_hz_to_20_khz(loop: Samples) -> None:
    power = np.abs(np.fft.rfft(loop.astype(np.float64))) ** 2
    frequency_hz = np.fft.rfftfreq(len(loop), 1 / RATE_HZ)
    outside = (frequency_hz < 19.9) | (frequency_hz > 20_001)
    assert 10 * np.log10(power[outside].sum() / power.sum()) < -100


@pytest.mark.parametrize("level_dbfs", [-90.0, -40.0, -15.0])
def test_rms_level_is_exact_on_the_scale_where_a_full_sine_has_minus_3_01(level_dbfs: float) -> None:
    noise = pink_noise(np.random.default_rng(1), level_dbfs, length_s=5).astype(np.float64)
    sine = np.sin(2 * np.pi * 1000 * np.arange(RATE_HZ) / RATE_HZ)
    over_the_sine_db = 10 * np.log10(np.mean(noise**2) / np.mean(sine**2))
    assert over_the_sine_db - 3.0103 == pytest.approx(level_dbfs, abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**63), length_s=st.floats(1, 4), rate_hz=st.sampled_from([44_100, 48_000]))
def test_nothing_is_clipped_at_the_largest_level(seed: int, length_s: float, rate_hz: int) -> None:
    noise = pink_noise(np.random.default_rng(seed), -15.0, length_s=length_s, sample_rate_hz=rate_hz)
    assert np.max(np.abs(noise)) < 1
    assert abs(np.mean(noise)) < 1e-6


def test_a_draw_with_too_large_a_crest_is_not_used() -> None:
    """The first draw of 60 s from this seed has peaks 15.4 dB over its rms: at -15 dBFS it would clip."""
    assert _crest_of_the_first_draw_db(seed=44) > 15
    assert np.max(np.abs(pink_noise(np.random.default_rng(44), -15.0))) < 1


def _crest_of_the_first_draw_db(seed: int) -> float:
    frequency_hz = np.fft.rfftfreq(60 * RATE_HZ, 1 / RATE_HZ)
    band = (frequency_hz >= 20) & (frequency_hz <= 20_000)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(frequency_hz))
    draw = np.fft.irfft(np.where(band, np.maximum(frequency_hz, 1) ** -0.5, 0) * np.exp(1j * phase))
    return float(20 * np.log10(np.max(np.abs(draw)) / np.std(draw)))


def _leakage_db(around_a_joint: NDArray[np.float64]) -> float:
    """Power over 21 kHz re all power: a click has some, the noise has none."""
    power = np.abs(np.fft.rfft(around_a_joint * signal.windows.blackmanharris(len(around_a_joint)))) ** 2
    frequency_hz = np.fft.rfftfreq(len(around_a_joint), 1 / RATE_HZ)
    return float(10 * np.log10(power[frequency_hz > 21_000].sum() / power.sum()))


def test_the_end_runs_into_the_beginning(loop: Samples) -> None:
    seam = np.concatenate([loop[-2048:], loop[:2048]]).astype(np.float64)
    cut = np.concatenate([loop[-3048:-1000], loop[:2048]]).astype(np.float64)
    assert _leakage_db(seam) < -80
    assert _leakage_db(cut) > -60  # the measure does see a seam


def test_the_same_generator_makes_the_same_noise_and_another_one_does_not() -> None:
    first, again, other = (pink_noise(np.random.default_rng(seed), -30, length_s=1) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.2


@pytest.mark.parametrize("level_dbfs", [-14.9, 0.0, float("nan"), float("inf")])
def test_a_level_that_would_clip_is_refused(level_dbfs: float) -> None:
    with pytest.raises(UsageError, match="clipped"):
        pink_noise(np.random.default_rng(1), level_dbfs)


@pytest.mark.parametrize(
    ("length_s", "rate_hz"), [(0.5, 48_000), (601, 48_000), (float("nan"), 48_000), (60, 32_000)]
)
def test_a_loop_that_cannot_carry_the_band_is_refused(length_s: float, rate_hz: int) -> None:
    with pytest.raises(UsageError, match=r"not between 1 and 600|cannot carry"):
        pink_noise(np.random.default_rng(1), -30, length_s=length_s, sample_rate_hz=rate_hz)


def test_the_ramp_is_half_a_period_of_a_cosine() -> None:
    ramp = raised_cosine(2400)
    assert ramp[0] < 1e-6
    assert ramp[-1] > 1 - 1e-6
    assert np.all(np.diff(ramp) > 0)
    assert np.allclose(ramp + ramp[::-1], 1)
    assert ramp[600] == pytest.approx((1 - np.cos(np.pi / 4)) / 2, abs=1e-3)
