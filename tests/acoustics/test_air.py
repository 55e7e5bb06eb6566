import math

import pytest

from autd_trials.acoustics.air import speed_of_sound_m_s
from autd_trials.errors import UsageError


@pytest.mark.parametrize(
    ("temperature_c", "expected_m_s"), [(0, 331.3), (10, 337.3), (20, 343.2), (30, 349.0)]
)
def test_speed_of_sound_agrees_with_published_tables(temperature_c: float, expected_m_s: float) -> None:
    assert speed_of_sound_m_s(temperature_c) == pytest.approx(expected_m_s, abs=0.2)


def test_speed_of_sound_agrees_with_the_ideal_gas() -> None:
    """sqrt(gamma R T / M) of dry air, an independent formula."""
    ideal_m_s = math.sqrt(1.4 * 8.314462 * 298.15 / 0.0289645)
    assert speed_of_sound_m_s(25) == pytest.approx(ideal_m_s, rel=2e-3)


@pytest.mark.parametrize("temperature_c", [-40, 68, math.nan, 293.15])
def test_an_impossible_temperature_is_refused(temperature_c: float) -> None:
    with pytest.raises(UsageError, match="degrees Celsius"):
        speed_of_sound_m_s(temperature_c)
