"""The air that the ultrasound travels through."""

import math
from dataclasses import dataclass

from autd_trials.errors import UsageError

_COLDEST_C, _WARMEST_C = -20.0, 50.0
_LOWEST_KPA, _HIGHEST_KPA = 50.0, 120.0
_REFERENCE_K, _TRIPLE_POINT_K, _REFERENCE_KPA = 293.15, 273.16, 101.325
_DRY_AIR_J_KG_K, _VAPOUR_J_KG_K = 287.05, 461.5


@dataclass(frozen=True)
class Air:
    """Air at rest.

    Parameters
    ----------
    temperature_c
        Temperature in degrees Celsius, -20 to 50.
    relative_humidity_percent
        Relative humidity in percent, 0 to 100.
    pressure_kpa
        Ambient pressure in kPa, 50 to 120.

    Raises
    ------
    UsageError
        If a value lies outside its range, which is that of ISO 9613-1 or of places where people live.
    """

    temperature_c: float = 20.0
    relative_humidity_percent: float = 50.0
    pressure_kpa: float = _REFERENCE_KPA

    def __post_init__(self) -> None:
        _refuse_outside(
            "temperature", self.temperature_c, _COLDEST_C, _WARMEST_C, "degrees Celsius of the room"
        )
        _refuse_outside("relative humidity", self.relative_humidity_percent, 0, 100, "percent")
        _refuse_outside("pressure", self.pressure_kpa, _LOWEST_KPA, _HIGHEST_KPA, "kPa (1013 hPa are 101.3)")

    @property
    def speed_of_sound_m_s(self) -> float:
        """Speed of sound in m/s: 343.2 sqrt(T / 293.15 K) of ISO 9613-1:1993, which leaves humidity out."""
        return 343.2 * math.sqrt(self._kelvin / _REFERENCE_K)

    @property
    def density_kg_m3(self) -> float:
        """Density in kg/m3: dry air and water vapour as ideal gases (specific gas constants of CIPM-2007)."""
        vapour_kpa = self._vapour_share * self.pressure_kpa
        dry_kpa = self.pressure_kpa - vapour_kpa
        return 1000 / self._kelvin * (dry_kpa / _DRY_AIR_J_KG_K + vapour_kpa / _VAPOUR_J_KG_K)

    def absorption_db_m(self, frequency_hz: float) -> float:
        """Return the absorption of a pure tone in dB/m, by ISO 9613-1:1993, equations 3 to 5.

        The standard claims 10 % for frequencies over pressure up to 1 MHz/atm.
        """
        pressure = self.pressure_kpa / _REFERENCE_KPA
        warmth = self._kelvin / _REFERENCE_K
        molar_percent = 100 * self._vapour_share
        oxygen_hz = pressure * (
            24 + 4.04e4 * molar_percent * (0.02 + molar_percent) / (0.391 + molar_percent)
        )
        nitrogen_hz = (
            pressure
            / math.sqrt(warmth)
            * (9 + 280 * molar_percent * math.exp(-4.170 * (math.pow(warmth, -1 / 3) - 1)))
        )
        classical = 1.84e-11 / pressure * math.sqrt(warmth)
        oxygen = 0.01275 * math.exp(-2239.1 / self._kelvin) / (oxygen_hz + frequency_hz**2 / oxygen_hz)
        nitrogen = 0.1068 * math.exp(-3352.0 / self._kelvin) / (nitrogen_hz + frequency_hz**2 / nitrogen_hz)
        return 8.686 * frequency_hz**2 * (classical + math.pow(warmth, -2.5) * (oxygen + nitrogen))

    @property
    def _kelvin(self) -> float:
        return self.temperature_c + 273.15

    @property
    def _vapour_share(self) -> float:
        """Molar share of water vapour, by ISO 9613-1:1993, annex B."""
        exponent = 4.6151 - 6.8346 * math.pow(_TRIPLE_POINT_K / self._kelvin, 1.261)
        saturation_kpa = _REFERENCE_KPA * math.pow(10, exponent)
        return self.relative_humidity_percent / 100 * saturation_kpa / self.pressure_kpa


def _refuse_outside(what: str, value: float, lowest: float, highest: float, unit: str) -> None:
    if not lowest <= value <= highest:
        raise UsageError(f"the air's {what} is {value:g}", do=f"give {lowest:g} to {highest:g}: {unit}")
