import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.level import (
    disc_force_mn,
    energy_density_j_m3,
    force_harmonics,
    shock_distance_mm,
    sound_level_db,
)


def test_energy_density_is_of_the_rms_pressure() -> None:
    """Equation 13 with the paper's air: 100 J/m3 are 3768 Pa rms, and 165.5 dB SPL."""
    air = Air()
    rms_pa = math.sqrt(100 * air.density_kg_m3 * air.speed_of_sound_m_s**2)
    peak = np.array([rms_pa * math.sqrt(2)], complex)
    assert energy_density_j_m3(peak, air)[0] == pytest.approx(100)
    assert sound_level_db(peak)[0] == pytest.approx(165.5, abs=0.1)


def test_levels_are_re_20_micropascal_rms() -> None:
    assert sound_level_db(np.array([math.sqrt(2)]))[0] == pytest.approx(93.98, abs=0.01), "1 Pa rms"
    assert sound_level_db(np.array([0.0]))[0] < -100


def test_the_force_on_13_mm_at_100_joules_per_cubic_metre_is_13_3_mn() -> None:
    assert disc_force_mn(100, 13) == pytest.approx(13.3, abs=0.05)


def test_the_shock_distance_at_b_is_about_10_mm() -> None:
    assert shock_distance_mm(16_500, Air()) == pytest.approx(10, abs=0.5)
    assert shock_distance_mm(1650, Air()) == pytest.approx(10 * shock_distance_mm(16_500, Air()))


@given(depth=st.floats(0, 1))
def test_harmonics_of_a_sine_of_the_amplitude(depth: float) -> None:
    """(m - d/2 cos)^2 with m = 1 - d/2: mean m^2 + d^2/8, fundamental m d, second harmonic d^2/8."""
    phase = 2 * np.pi * np.arange(64) / 64
    middle = 1 - depth / 2
    mean, fundamental, second = force_harmonics(middle - depth / 2 * np.cos(phase))
    assert mean == pytest.approx(middle**2 + depth**2 / 8, abs=1e-12)
    assert fundamental == pytest.approx(middle * depth, abs=1e-12)
    assert second == pytest.approx(depth**2 / 8, abs=1e-12)


def test_the_square_root_law_has_no_second_harmonic() -> None:
    phase = 2 * np.pi * np.arange(64) / 64
    found = force_harmonics(np.sqrt((1 - np.cos(phase)) / 2))
    assert found == pytest.approx((0.5, 0.5, 0.0), abs=1e-12)
