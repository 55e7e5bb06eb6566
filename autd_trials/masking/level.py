"""How loud the masking noise is: digital level, headphones, and the ceiling that protects hearing."""

from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Any, NamedTuple

from autd_trials.errors import UnsafeError, UsageError
from autd_trials.masking.noise import HIGH_HZ, LOW_HZ, check_level_dbfs

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST_DBA = 75.0
"""Most that is ever played, in dB(A); over it is refused."""

HARD_STOP_DBA = 80.0
"""What must not reach an ear even if the stated sensitivity is 5 dB off (NIOSH allows 85 for 8 h)."""

_SINE_DBFS = 3.01  # a full-scale sine has -3.01 dBFS rms
_SMALLEST_PLAUSIBLE_DB_PER_V, _LARGEST_PLAUSIBLE_DB_PER_V = 60.0, 150.0


@dataclass(frozen=True)
class Headphones:
    """The sound chain behind the digital output, as measured.

    Parameters
    ----------
    sensitivity_db_per_v
        Sound pressure level at the ear in dB SPL for 1 V rms at 1 kHz.
    full_scale_v_rms
        Voltage in V rms at the headphones while a full-scale sine is played, volume controls as in the study.
    checked
        The day on which the level was checked with a coupler.
    note
        Which headphones, which amplifier, which volume setting.

    Raises
    ------
    UsageError
        A figure that no headphones have.
    """

    sensitivity_db_per_v: float
    full_scale_v_rms: float
    checked: date
    note: str

    def __post_init__(self) -> None:
        if not _SMALLEST_PLAUSIBLE_DB_PER_V <= self.sensitivity_db_per_v <= _LARGEST_PLAUSIBLE_DB_PER_V:
            raise UsageError(
                f"headphones with a sensitivity of {self.sensitivity_db_per_v:g} dB/V are not plausible",
                do="give dB SPL for 1 V rms, mostly 95 to 125; "
                "from dB/mW add 10*log10(1000 / impedance in ohms)",
            )
        if not 0 < self.full_scale_v_rms <= 20:
            raise UsageError(
                f"a full-scale output of {self.full_scale_v_rms:g} V rms is not plausible",
                do="measure the voltage at the headphones during a full-scale sine, mostly 0.1 to 5 V",
            )

    def dba(self, level_dbfs: float) -> float:
        """Return the A-weighted level in dB(A) of pink noise played at `level_dbfs`."""
        return level_dbfs + self._dba_at_0_dbfs

    def dbfs(self, level_dba: float) -> float:
        """Return the digital level in dBFS rms at which pink noise has `level_dba`."""
        return level_dba - self._dba_at_0_dbfs

    @property
    def _dba_at_0_dbfs(self) -> float:
        import math

        full_scale_sine_db_spl = self.sensitivity_db_per_v + 20 * math.log10(self.full_scale_v_rms)
        return full_scale_sine_db_spl + _SINE_DBFS + pink_weighting_db()


class MaskingLevel(NamedTuple):
    """A level that may be played; `dba` is None where the headphones are unknown."""

    dbfs: float
    dba: float | None


def resolve_level(
    *, level_dbfs: float | None = None, level_dba: float | None = None, headphones: Headphones | None = None
) -> MaskingLevel:
    """Turn the level that a protocol asks for into the one that is played; exactly one of the two is given.

    Parameters
    ----------
    level_dbfs
        RMS level in dB re digital full scale.
    level_dba
        A-weighted level at the ear in dB(A).
    headphones
        The rig's sound chain, None if nobody measured it.

    Raises
    ------
    UsageError
        Both levels or none; dB(A) without known headphones; a level that would be clipped.
    UnsafeError
        More than 75 dB(A) at the ear, whichever way it was asked for.
    """
    if (level_dbfs is None) == (level_dba is None):
        raise UsageError("masking needs exactly one of level_dbfs and level_dba", do="keep one of them")
    if level_dba is not None:
        level = MaskingLevel(_need(headphones).dbfs(level_dba), level_dba)
    else:
        assert level_dbfs is not None
        level = MaskingLevel(level_dbfs, None if headphones is None else headphones.dba(level_dbfs))
    _refuse_loud(level)
    check_level_dbfs(level.dbfs)
    return level


def a_weighting_db(frequency_hz: "NDArray[np.float64]") -> "NDArray[np.float64]":
    """Return the A-weighting in dB at each frequency in Hz (IEC 61672-1:2013, annex E; 0 dB at 1 kHz)."""
    import numpy as np

    return np.asarray(20 * np.log10(_a_response(frequency_hz) / _a_response(1000.0)), dtype=np.float64)


def pink_weighting_db(low_hz: float = LOW_HZ, high_hz: float = HIGH_HZ) -> float:
    """Return the A-weighted minus the plain level, in dB, of pink noise between two frequencies in Hz."""
    import numpy as np

    # Pink noise has the same power in equal steps of log frequency: its weight is the mean over them.
    edges_hz = np.geomspace(low_hz, high_hz, 4001)
    middles_hz = np.sqrt(edges_hz[:-1] * edges_hz[1:])
    return float(10 * np.log10(np.mean(10 ** (a_weighting_db(middles_hz) / 10))))


def _a_response(frequency_hz: Any) -> Any:
    """Return the amplitude response of the A-weighting, not yet normalised (IEC 61672-1, equation E.6)."""
    f2 = frequency_hz**2
    f1_2, f2_2, f3_2, f4_2 = 20.598997**2, 107.65265**2, 737.86223**2, 12194.217**2
    return f4_2 * f2**2 / ((f2 + f1_2) * ((f2 + f2_2) * (f2 + f3_2)) ** 0.5 * (f2 + f4_2))


def _need(headphones: Headphones | None) -> Headphones:
    if headphones is None:
        raise UsageError(
            "a masking level in dB(A) needs headphones of known sensitivity, and the rig names none",
            do="measure the headphones' sensitivity in dB SPL for 1 V rms and their voltage in V rms for a "
            "full-scale sine, check the level with a coupler and enter all with the date in the rig file; "
            "or give level_dbfs",
        )
    return headphones


def _refuse_loud(level: MaskingLevel) -> None:
    # Not written as "dba > 75": NaN must be refused, too.
    if level.dba is not None and not level.dba <= LARGEST_DBA:
        raise UnsafeError(
            f"the masking noise would have {level.dba:.1f} dB(A) at the ear; the most is {LARGEST_DBA:g},"
            f" to stay under {HARD_STOP_DBA:g} dB(A) even if the headphones' figures are off",
            do="lower the masking level; or the volume, and then measure the headphones' voltage again",
        )
