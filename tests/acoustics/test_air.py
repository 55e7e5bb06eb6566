import math

import pytest

from autd_trials.acoustics.air import Air
from autd_trials.errors import UsageError


@pytest.mark.parametrize(
    ("temperature_c", "expected_m_s"), [(0, 331.3), (10, 337.3), (20, 343.2), (30, 349.0)]
)
def test_speed_of_sound_agrees_with_published_tables(temperature_c: float, expected_m_s: float) -> None:
    assert Air(temperature_c).speed_of_sound_m_s == pytest.approx(expected_m_s, abs=0.2)


def test_speed_of_sound_agrees_with_the_ideal_gas() -> None:
    """sqrt(gamma R T / M) of dry air, an independent formula."""
    ideal_m_s = math.sqrt(1.4 * 8.314462 * 298.15 / 0.0289645)
    assert Air(25).speed_of_sound_m_s == pytest.approx(ideal_m_s, rel=2e-3)


@pytest.mark.parametrize("temperature_c", [-40, 68, math.nan, 293.15])
def test_an_impossible_temperature_is_refused(temperature_c: float) -> None:
    with pytest.raises(UsageError, match="degrees Celsius"):
        Air(temperature_c)


@pytest.mark.parametrize(
    ("temperature_c", "humidity_percent", "expected_db_m"),
    [(20, 50, 1.318), (20, 20, 0.783), (25, 50, 1.392), (10, 50, 0.848), (30, 50, 1.341)],
)
def test_absorption_at_40_khz_agrees_with_iso_9613_1(
    temperature_c: float, humidity_percent: float, expected_db_m: float
) -> None:
    assert Air(temperature_c, humidity_percent).absorption_db_m(40_000) == pytest.approx(
        expected_db_m, abs=1e-3
    )


@pytest.mark.parametrize(
    ("band", "expected_db_km"), [(24, 1.1), (27, 2.8), (30, 5.0), (33, 9.0), (36, 22.9), (39, 76.6)]
)
def test_absorption_agrees_with_the_table_of_iso_9613_2(band: int, expected_db_km: float) -> None:
    """Its table 2 at 20 degrees Celsius and 70 %, 250 Hz to 8 kHz at exact midband frequencies."""
    assert 1000 * Air(20, 70).absorption_db_m(10 ** (band / 10)) == pytest.approx(expected_db_km, abs=0.06)


def test_density_of_dry_and_of_moist_air() -> None:
    assert Air(0, 0).density_kg_m3 == pytest.approx(1.2929, rel=1e-3)
    assert Air(20, 0).density_kg_m3 == pytest.approx(1.2041, rel=1e-3)
    assert Air(20, 100).density_kg_m3 < Air(20, 50).density_kg_m3 < Air(20, 0).density_kg_m3


@pytest.mark.parametrize("values", [(20, -1), (20, 101), (20, 50, 1013.0), (20, 50, 10), (20, math.nan)])
def test_impossible_air_is_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(UsageError, match="air's"):
        Air(*values)
