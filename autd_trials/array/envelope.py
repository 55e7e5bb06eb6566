"""The envelope of a burst: the ideal course of its pressure amplitude, and the samples that devices play.

The devices play 8-bit samples at 4 kHz. Their silencer, set as in `autd_trials.array.commands`, turns each
step into a straight line that takes exactly one sample period. So the sample of a period is the envelope at
the period's *end*: the emission then runs in straight lines through the ideal envelope, without delay, and
starts from zero at the onset. (Held samples without the silencer are 3 % rms off at 100 Hz, and click.)
"""

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.driver import Stimulus
from autd_trials.errors import UsageError
from autd_trials.stimulus import LARGEST_MODULATION_HZ, SAMPLE_RATE_HZ, sample_count

LARGEST_BUFFER = 65536

_FULL = 255


def amplitude(stimulus: Stimulus, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ideal pressure amplitude of a burst, relative to its drive.

    Parameters
    ----------
    stimulus
        The burst.
    time_s
        Times from the onset in s, any shape.

    Returns
    -------
    ndarray of float64
        0 to 1, same shape; 0 before the onset and from the burst's end on. With the force law `pressure` the
        square of it (the radiation pressure) is what follows the waveform and its ramps.
    """
    inside = (time_s >= 0) & (time_s < stimulus.duration_s)
    course = np.where(inside, _waveform(stimulus, time_s) * _ramps(stimulus, time_s), 0.0)
    return np.sqrt(course) if stimulus.force_law == "pressure" else course


def samples(stimulus: Stimulus) -> NDArray[np.uint8]:
    """Return the burst as the devices play it.

    Returns
    -------
    ndarray of uint8
        Samples at 4 kHz, each for the end of its period; the last is 0, because the devices hold it for ever.

    Raises
    ------
    UsageError
        If the burst cannot be sampled: too long for the devices' buffer, too fast, its ramps longer than
        itself, or a number out of its range.
    """
    _refuse_impossible(stimulus)
    ends_s = np.arange(1, sample_count(stimulus.duration_s) + 1) / SAMPLE_RATE_HZ
    played = np.rint(_FULL * amplitude(stimulus, ends_s)).astype(np.uint8)
    played[-1] = 0
    return played


def _waveform(stimulus: Stimulus, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    cycles = stimulus.modulation_hz * time_s
    match stimulus.waveform:
        case "sine":
            swing = (1 - np.cos(2 * np.pi * cycles)) / 2
        case "square":
            swing = (np.round(cycles, 9) % 1 < 0.5).astype(np.float64)
        case "constant":
            swing = np.ones_like(cycles)
    return 1 - stimulus.depth + stimulus.depth * swing


def _ramps(stimulus: Stimulus, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the raised cosine ramps at both ends."""
    if stimulus.ramp_s == 0:
        return np.ones_like(time_s)
    from_the_nearer_end_s = np.minimum(time_s, stimulus.duration_s - time_s)
    return np.sin(np.pi / 2 * np.clip(from_the_nearer_end_s, 0, stimulus.ramp_s) / stimulus.ramp_s) ** 2


def _refuse_impossible(stimulus: Stimulus) -> None:
    longest_s = LARGEST_BUFFER / SAMPLE_RATE_HZ
    longest_ramp_s = stimulus.duration_s / 2
    _refuse_unless(
        0 < stimulus.duration_s <= longest_s,
        f"duration_s is {stimulus.duration_s}",
        f"make it more than 0 and at most {longest_s:g} (the devices' buffer)",
    )
    _refuse_unless(
        0 < stimulus.modulation_hz <= LARGEST_MODULATION_HZ,
        f"modulation_hz is {stimulus.modulation_hz}",
        f"make it more than 0 and at most {LARGEST_MODULATION_HZ:g} (at {SAMPLE_RATE_HZ} samples a second)",
    )
    _refuse_unless(0 <= stimulus.depth <= 1, f"depth is {stimulus.depth}", "make it 0 to 1")
    _refuse_unless(
        0 <= stimulus.ramp_s <= longest_ramp_s,
        f"ramp_s is {stimulus.ramp_s}",
        f"make it 0 to {longest_ramp_s:g}, half of the burst, as there is a ramp at each end",
    )


def _refuse_unless(possible: bool, what: str, do: str) -> None:
    if not possible:
        raise UsageError(f"the stimulus's {what}", do=do)
