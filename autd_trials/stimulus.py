"""What is presented, and the limits that protect people: the words that all rooms share.

Exposure is drive^2 x duration: seconds at full drive, whatever the envelope. The duty is the share of on-time
in any 60 s. What goes over a limit is refused, never clipped.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from autd_trials.model import Model

Waveform = Literal["sine", "square", "constant"]
ForceLaw = Literal["amplitude", "pressure"]
Fraction = Annotated[float, Field(ge=0, le=1)]
LimitName = Literal[
    "largest_drive", "longest_burst_s", "largest_duty", "session_exposure_s", "daily_exposure_s"
]

SAMPLE_RATE_HZ = 4000
"""The devices play the envelope in samples."""

LONGEST_BURST_S = 16.0
"""The devices' buffer holds 65,536 samples."""

LARGEST_MODULATION_HZ = 1000.0
"""Four samples a period."""

DRIVE_STEPS = 255
"""The devices take the drive, and each sample, as one byte."""

DUTY_WINDOW_S = 60.0

PUBLIC_LEVEL_DB = 100.0
"""Largest level at an ear at 40 kHz in dB SPL for the public: INIRC/IRPA 1984, AGNIR 2010; decision 0046."""

LARGEST_LEVEL_DB = 110.0
"""The same for workers (INIRC/IRPA 1984), and for up to 4 h (Howard, Hansen and Zander 2004)."""

DAILY_EXPOSURE_S = 360.0
"""Largest exposure of one participant in 24 h where neither rig nor protocol says: see decision 0039."""

_ROUNDING = 1e-9
"""A sum of decimal fractions may come out larger than it is by this share."""

_WORDS: dict[LimitName, str] = {
    "largest_drive": "the drive",
    "longest_burst_s": "the burst's length in s",
    "largest_duty": "the share of on-time in 60 s",
    "session_exposure_s": "the session's exposure in s at full drive",
    "daily_exposure_s": "the participant's exposure in 24 h, in s at full drive,",
}


class StimulusFields(Model):
    """One finite burst at one focus; where the focus is, each room says in its own words."""

    duration_s: float = Field(gt=0, le=LONGEST_BURST_S, description="Length of the burst in s.")
    modulation_hz: float = Field(gt=0, le=LARGEST_MODULATION_HZ, description="Modulation frequency in Hz.")
    waveform: Waveform = Field("sine", description="Shape of the modulation.")
    depth: Fraction = Field(1.0, description="Modulation depth: 1 swings from full to zero.")
    drive: Fraction = Field(1.0, description="Peak pressure amplitude as a fraction of the array's largest.")
    force_law: ForceLaw = Field(
        "amplitude",
        description="What follows the waveform: pressure amplitude, or radiation pressure (its square).",
    )
    ramp_s: float = Field(0.005, ge=0, le=1.0, description="Raised-cosine ramp at both ends in s.")


@dataclass(frozen=True)
class Excess:
    """A value over one of the limits."""

    limit: LimitName
    value: float
    allowed: float

    def __str__(self) -> str:
        return f"{_WORDS[self.limit]} would be {self.value:.6g}, over the limit of {self.allowed:.6g}"


class Limits(Model):
    """The limits of a rig or of a protocol; where both have a say, the stricter holds."""

    largest_drive: Fraction = Field(description="Largest drive of any stimulus, 0 to 1.")
    longest_burst_s: float = Field(gt=0, le=LONGEST_BURST_S, description="Longest burst in s.")
    largest_duty: float = Field(gt=0, le=1, description="Largest share of on-time in any 60 s.")
    session_exposure_s: float = Field(
        gt=0, le=36_000, description="Largest sum of drive^2 x duration in a session, in s at full drive."
    )
    daily_exposure_s: float = Field(
        DAILY_EXPOSURE_S,
        gt=0,
        le=36_000,
        description="Largest sum of drive^2 x duration of one participant in 24 h, over all sessions of the "
        "study, in s at full drive.",
    )

    def and_also(self, other: "Limits") -> "Limits":
        """Return the limits under which both hold (a protocol's and its rig's, say)."""
        return Limits(
            **{name: min(getattr(self, name), getattr(other, name)) for name in Limits.model_fields}
        )

    def excess(self, limit: LimitName, value: float) -> Excess | None:
        """Return by what a value is over a limit; None if it is not.

        Not a number is over every limit. A relative 1e-9 is allowed for rounding.
        """
        allowed: float = getattr(self, limit)
        return None if value <= allowed * (1 + _ROUNDING) else Excess(limit, value, allowed)


def drive_step(drive: float) -> int:
    """Return the byte that the devices make of a drive, 0 to 255; nothing is emitted at 0."""
    return round(DRIVE_STEPS * drive)


def sample_count(duration_s: float) -> int:
    """Return how many samples the devices play for a burst; the last one is silent."""
    return max(2, math.ceil(round(duration_s * SAMPLE_RATE_HZ, 6)))


def exposure_s(stimulus: StimulusFields) -> float:
    """Return a burst's exposure in s at full drive: drive^2 x duration."""
    return stimulus.drive**2 * stimulus.duration_s


def total_exposure_s(stimuli: Iterable[StimulusFields]) -> float:
    """Return the exposure of several bursts in s at full drive."""
    return math.fsum(map(exposure_s, stimuli))


def duty_until(bursts: Iterable[tuple[float, float]], end_s: float) -> float:
    """Return the share of on-time in the 60 s before `end_s`, given each burst's (onset_s, end_s)."""
    start_s = end_s - DUTY_WINDOW_S
    on_s = math.fsum(max(0.0, min(off_s, end_s) - max(onset_s, start_s)) for onset_s, off_s in bursts)
    return on_s / DUTY_WINDOW_S


def earliest_onset_s(
    bursts: Sequence[tuple[float, float]], duration_s: float, limit: float, from_s: float
) -> float:
    """Return the earliest onset of a burst, from `from_s` on, with which the duty keeps to a limit.

    Parameters
    ----------
    bursts
        Each burst's (onset_s, end_s), one after the other, all before `from_s`.
    duration_s
        The burst's length in s; shorter than the limit's share of 60 s.
    limit
        The largest share of on-time in any 60 s.
    from_s
        When it would begin.
    """
    left_s = limit * DUTY_WINDOW_S - duration_s
    for onset_s, end_s in reversed(bursts):
        if end_s - onset_s > left_s:  # of this burst, only its last left_s may lie in the window
            return max(from_s, end_s - max(left_s, 0.0) + DUTY_WINDOW_S - duration_s)
        left_s -= end_s - onset_s
    return from_s


def largest_duty(bursts: Sequence[tuple[float, float]]) -> float:
    """Return the largest share of on-time in any 60 s; the window that holds most ends where a burst ends."""
    return max((duty_until(bursts, off_s) for _, off_s in bursts), default=0.0)


def duty_of_equal_bursts(burst_s: float, period_s: float) -> float:
    """Return the largest share of on-time in any 60 s of equal bursts that follow each other evenly.

    Parameters
    ----------
    burst_s
        Length of a burst in s.
    period_s
        From one onset to the next in s, not shorter than a burst.
    """
    whole = math.floor(DUTY_WINDOW_S / period_s)
    rest_s = DUTY_WINDOW_S - whole * period_s
    return (whole * burst_s + min(burst_s, rest_s)) / DUTY_WINDOW_S
