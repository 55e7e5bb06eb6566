"""Pink noise as one long loop without a seam, at an exact level."""

import math
from typing import TYPE_CHECKING

from autd_trials.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LOW_HZ = 20.0
HIGH_HZ = 20_000.0
LARGEST_LEVEL_DBFS = -15.0
"""Peaks of the noise lie up to 15 dB over its rms level; above this they would be clipped."""

RAMP_S = 0.05

_LARGEST_CREST_DB = 14.9
_LARGEST_DRAWS = 100  # one draw in about twenty has a larger crest, so this is never reached by chance


def pink_noise(
    generator: "np.random.Generator",
    level_dbfs: float,
    *,
    length_s: float = 60.0,
    sample_rate_hz: int = 48_000,
) -> "NDArray[np.float32]":
    """Make a loop of pink noise, 20 Hz to 20 kHz, whose end runs into its beginning.

    Every multiple of the loop's own frequency gets an amplitude of exactly 1/sqrt(f) and a random phase. All
    of them fit the loop a whole number of times, so there is no seam, and no filter bends the slope.

    Parameters
    ----------
    generator
        Source of the phases.
    level_dbfs
        RMS level over the loop in dB re full scale (1.0); a full-scale sine has -3.01 dBFS.
    length_s
        Length of the loop in s. A listener can learn short loops; 60 s are taken for endless.
    sample_rate_hz
        Sample rate in Hz.

    Returns
    -------
    ndarray, shape (n,)
        One period of the noise, full scale 1.0, nowhere clipped.

    Raises
    ------
    UsageError
        The level would clip, or rate and length cannot carry the band.
    """
    import numpy as np

    check_level_dbfs(level_dbfs)
    check_loop(length_s, sample_rate_hz)
    rms = 10 ** (level_dbfs / 20)
    samples = round(length_s * sample_rate_hz)
    return np.asarray(rms * _unit_loop(generator, samples, sample_rate_hz), dtype=np.float32)


def check_level_dbfs(level_dbfs: float) -> None:
    """Refuse (UsageError) a level whose peaks would be clipped, or that is no number."""
    if not math.isfinite(level_dbfs) or level_dbfs > LARGEST_LEVEL_DBFS:
        raise UsageError(
            f"a masking level of {level_dbfs:g} dBFS rms would be clipped: "
            f"pink noise needs 15 dB for its peaks, so {LARGEST_LEVEL_DBFS:g} dBFS is the most",
            do="lower the level, and make up for it with a more powerful headphone amplifier",
        )


def check_loop(length_s: float, sample_rate_hz: int) -> None:
    """Refuse (UsageError) a loop that cannot carry the band."""
    if sample_rate_hz < 2.2 * HIGH_HZ:
        raise UsageError(
            f"a sample rate of {sample_rate_hz} Hz cannot carry masking noise up to {HIGH_HZ:g} Hz",
            do="choose 44100, 48000 or more",
        )
    if not 1 <= length_s <= 600:
        raise UsageError(f"a noise loop of {length_s:g} s is not between 1 and 600 s", do="choose 60")


def raised_cosine(samples: int) -> "NDArray[np.float32]":
    """Return a gain that rises from 0 to 1 along half a period of a cosine; shape (samples,)."""
    import numpy as np

    position = (np.arange(samples) + 0.5) / samples
    return np.asarray((1 - np.cos(np.pi * position)) / 2, dtype=np.float32)


def _unit_loop(generator: "np.random.Generator", samples: int, sample_rate_hz: int) -> "NDArray[np.float64]":
    """Draw a loop with an rms of 1 until its crest fits under full scale at the largest level."""
    import numpy as np

    frequency_hz = np.fft.rfftfreq(samples, 1 / sample_rate_hz)
    band = (frequency_hz >= LOW_HZ) & (frequency_hz <= HIGH_HZ)
    amplitude = np.zeros(len(frequency_hz))
    amplitude[band] = frequency_hz[band] ** -0.5
    for _ in range(_LARGEST_DRAWS):
        phase = generator.uniform(0, 2 * np.pi, len(frequency_hz))
        loop: NDArray[np.float64] = np.fft.irfft(amplitude * np.exp(1j * phase), samples)
        loop /= np.sqrt(np.mean(loop**2))
        if np.max(np.abs(loop)) <= 10 ** (_LARGEST_CREST_DB / 20):
            return loop
    raise UsageError(
        f"no noise loop of {samples} samples with a crest under {_LARGEST_CREST_DB} dB was found"
    )
