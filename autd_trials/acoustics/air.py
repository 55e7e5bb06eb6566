"""The air that the ultrasound travels through."""

import math

from autd_trials.errors import UsageError

_COLDEST_C, _WARMEST_C = -20.0, 50.0


def speed_of_sound_m_s(temperature_c: float) -> float:
    """Return the speed of sound in air.

    Parameters
    ----------
    temperature_c
        Air temperature in degrees Celsius, -20 to 50.

    Returns
    -------
    float
        Speed in m/s: 343.2 sqrt(T / 293.15 K), the formula of ISO 9613-1:1993, which leaves humidity out.

    Raises
    ------
    UsageError
        If the temperature lies outside the range of that standard.
    """
    if not _COLDEST_C <= temperature_c <= _WARMEST_C:
        raise UsageError(
            f"air temperature is {temperature_c} degrees Celsius",
            do=f"give the room's temperature in degrees Celsius, {_COLDEST_C:g} to {_WARMEST_C:g}",
        )
    return 343.2 * math.sqrt((temperature_c + 273.15) / 293.15)
