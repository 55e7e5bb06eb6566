"""How loud the noise is at the ear, and that nobody is given more than the ceiling."""

from datetime import date

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.errors import UnsafeError, UsageError
from autd_trials.masking.level import Headphones, a_weighting_db, pink_weighting_db, resolve_level
from autd_trials.masking.noise import pink_noise

# IEC 61672-1:2013, table 3: A-weighting at the third-octave frequencies 20 Hz to 20 kHz.
TABLE_DB = [
    *(-50.5, -44.7, -39.4, -34.6, -30.2, -26.2, -22.5, -19.1, -16.1, -13.4, -10.9, -8.6, -6.6, -4.8, -3.2),
    *(-1.9, -0.8, 0.0, 0.6, 1.0, 1.2, 1.3, 1.2, 1.0, 0.5, -0.1, -1.1, -2.5, -4.3, -6.6, -9.3),
]
TABLE_HZ = 1000 * 10 ** (np.arange(-17, 14) / 10)

HEADPHONES = Headphones(100.0, 1.0, date(2026, 11, 20), "made-up headphones")
headphones = st.builds(
    Headphones,
    st.floats(60, 150),
    st.floats(0.001, 20),
    st.just(date(2026, 11, 20)),
    st.just("any headphones"),
)


def test_a_weighting_agrees_with_the_published_table() -> None:
    assert np.max(np.abs(a_weighting_db(TABLE_HZ) - TABLE_DB)) <= 0.06  # the table is rounded to 0.1


def test_pink_noise_loses_2_86_db() -> None:
    assert pink_weighting_db() == pytest.approx(-2.86, abs=0.005)


def test_the_table_alone_gives_the_same_within_its_coarseness() -> None:
    assert pink_weighting_db() == pytest.approx(
        10 * np.log10(np.mean(10 ** (np.array(TABLE_DB) / 10))), abs=0.2
    )


def test_the_noise_that_is_played_has_that_weighted_level() -> None:
    power = np.abs(np.fft.rfft(pink_noise(np.random.default_rng(3), -30.0).astype(np.float64))) ** 2
    frequency_hz = np.fft.rfftfreq(60 * 48_000, 1 / 48_000)
    audible = (frequency_hz >= 20) & (frequency_hz <= 20_000)
    weight_db = np.interp(np.log10(frequency_hz[audible]), np.log10(TABLE_HZ), TABLE_DB)
    weighted_db = 10 * np.log10(np.sum(power[audible] * 10 ** (weight_db / 10)) / power.sum())
    assert weighted_db == pytest.approx(pink_weighting_db(), abs=0.1)


def test_level_by_hand() -> None:
    """100 dB/V at 1 V for a full-scale sine: -30 dBFS rms is 73.01 dB SPL, 70.15 dB(A)."""
    assert resolve_level(level_dbfs=-30, headphones=HEADPHONES).dba == pytest.approx(70.15, abs=0.01)
    assert resolve_level(level_dba=70.15, headphones=HEADPHONES).dbfs == pytest.approx(-30, abs=0.01)


def test_ten_times_the_voltage_is_20_db_more() -> None:
    louder = Headphones(100.0, 10.0, HEADPHONES.checked, "louder")
    assert louder.dba(-60) - HEADPHONES.dba(-60) == pytest.approx(20)


def test_dbfs_on_unknown_headphones_has_no_weighted_level() -> None:
    assert resolve_level(level_dbfs=-30) == (-30, None)


@given(worn=headphones, level=st.floats(allow_nan=True), as_dba=st.booleans())
def test_a_level_is_under_the_ceiling_and_unclipped_or_refused(
    worn: Headphones, level: float, as_dba: bool
) -> None:
    try:
        if as_dba:
            resolved = resolve_level(level_dba=level, headphones=worn)
        else:
            resolved = resolve_level(level_dbfs=level, headphones=worn)
    except (UnsafeError, UsageError):
        return
    assert resolved.dba is not None
    assert resolved.dba <= 75
    assert resolved.dbfs <= -15
    assert worn.dba(resolved.dbfs) == pytest.approx(resolved.dba)


@pytest.mark.parametrize("level_dba", [75.01, 80.0, 100.0, float("nan"), float("inf")])
def test_more_than_75_dba_is_refused(level_dba: float) -> None:
    with pytest.raises(UnsafeError, match="75"):
        resolve_level(level_dba=level_dba, headphones=HEADPHONES)


def test_75_dba_itself_is_allowed() -> None:
    assert resolve_level(level_dba=75, headphones=HEADPHONES).dba == 75


def test_the_ceiling_holds_for_a_level_in_dbfs_too() -> None:
    with pytest.raises(UnsafeError, match=r"85\.2 dB\(A\)"):
        resolve_level(level_dbfs=-15, headphones=HEADPHONES)


def test_dba_without_headphones_says_what_to_measure() -> None:
    with pytest.raises(UsageError) as caught:
        resolve_level(level_dba=60)
    assert "V rms" in str(caught.value)
    assert "coupler" in str(caught.value)


def test_dba_that_the_amplifier_cannot_reach_is_refused() -> None:
    with pytest.raises(UsageError, match="clipped"):
        resolve_level(level_dba=75, headphones=Headphones(90.0, 0.1, HEADPHONES.checked, "weak"))


def test_exactly_one_level_is_needed() -> None:
    for both in ({}, {"level_dbfs": -30.0, "level_dba": 60.0}):
        with pytest.raises(UsageError, match="exactly one"):
            resolve_level(**both, headphones=HEADPHONES)


@pytest.mark.parametrize(
    ("sensitivity", "volts"),
    [(0.1, 1), (200, 1), (float("nan"), 1), (100, 0), (100, -1), (100, 50), (100, float("nan"))],
)
def test_figures_of_no_headphones_are_refused(sensitivity: float, volts: float) -> None:
    with pytest.raises(UsageError, match="not plausible"):
        Headphones(sensitivity, volts, HEADPHONES.checked, "typo")
