"""The simulated participants' model: what they feel, and when they answer.

Every number here is a tuned assumption, not data: no detection threshold of the chest and no loss through a
layer of cloth was found in print. The model makes studies come out plausible; it proves nothing about people.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from numpy.random import Generator

Layer = Literal["inner", "outer"]

FULL_DRIVE_FORCE_MN = 20.0
"""Peak force at full drive on the bare chest in mN (13.3 mN would be 100 Pa over a disc of 13 mm)."""

PREDICTED_FORCE_MN = 47.7
"""What linear theory predicts for that force, on a disc of 13 mm, with two well-posed units 1 m away. Air
saturates, so the two differ; other fields are taken in proportion."""

MEDIAN_THRESHOLDS_MN = {25.0: 10.0, 50.0: 6.0, 100.0: 3.0}
"""Median threshold force in mN by modulation frequency in Hz."""

THRESHOLD_SD_DB = 3.0  # between people, 20 log of force
TRIAL_JITTER_SD_DB = 1.5  # from trial to trial, 20 log of force
LAYER_LOSS_DB: dict[Layer, tuple[float, float]] = {"inner": (-3.0, 1.0), "outer": (-6.5, 4.0)}  # mean, SD
SMALLEST_LAYER_LOSS_DB = -1.0  # no cloth lets more through
SENSITIVITY = 1.65  # d' at threshold
CRITERION_MEAN, CRITERION_SD = 1.65, 0.3
LAPSE = 0.01  # presses without, and silence in spite of, any feeling
_REACTION_MU_S, _REACTION_SIGMA_S, _REACTION_TAU_S = 0.45, 0.07, 0.15
_PHI = NormalDist().cdf


@dataclass(frozen=True)
class ParticipantTraits:
    """What stays the same in one simulated participant over all sessions.

    Attributes
    ----------
    threshold_offset_db
        How far every threshold lies above the median, in dB (20 log of force).
    inner_loss_db, outer_loss_db
        What the inner clothing lets through and what the outer adds, in dB of power: force x 10^(loss / 10).
    criterion
        How sure the participant must be to answer "felt", in units of d'.
    """

    threshold_offset_db: float
    inner_loss_db: float
    outer_loss_db: float
    criterion: float

    @classmethod
    def draw(cls, generator: "Generator") -> "ParticipantTraits":
        """Draw a participant."""
        return cls(
            threshold_offset_db=generator.normal(0.0, THRESHOLD_SD_DB),
            inner_loss_db=min(generator.normal(*LAYER_LOSS_DB["inner"]), SMALLEST_LAYER_LOSS_DB),
            outer_loss_db=min(generator.normal(*LAYER_LOSS_DB["outer"]), SMALLEST_LAYER_LOSS_DB),
            criterion=generator.normal(CRITERION_MEAN, CRITERION_SD),
        )

    def force_mn(
        self, drive: float, layers: tuple[Layer, ...], *, full_drive_mn: float = FULL_DRIVE_FORCE_MN
    ) -> float:
        """Return the peak force on the skin in mN.

        Radiation force goes with the square of pressure, hence of `drive` (0 to 1). The stimulus' waveform,
        depth and force law are not considered.
        """
        loss_db = sum(self.inner_loss_db if layer == "inner" else self.outer_loss_db for layer in layers)
        return full_drive_mn * drive**2 * math.pow(10.0, loss_db / 10.0)

    def threshold_mn(self, modulation_hz: float) -> float:
        """Return the participant's own threshold force in mN, without the jitter of a trial."""
        return median_threshold_mn(modulation_hz) * math.pow(10.0, self.threshold_offset_db / 20.0)

    def detection_probability(self, force_mn: float, threshold_mn: float) -> float:
        """Return the probability of the answer "felt": equal-variance signal detection with lapses.

        With a force of 0 it is the participant's false-alarm rate.
        """
        d_prime = SENSITIVITY * force_mn / threshold_mn
        return LAPSE + (1.0 - 2.0 * LAPSE) * _PHI(d_prime - self.criterion)

    def answer(self, force_mn: float, modulation_hz: float, generator: "Generator") -> float | None:
        """Decide one trial.

        Returns
        -------
        float or None
            The reaction time in s (ex-Gaussian); None if the participant does not press.
        """
        jitter_db = generator.normal(0.0, TRIAL_JITTER_SD_DB)
        threshold_mn = self.threshold_mn(modulation_hz) * math.pow(10.0, jitter_db / 20.0)
        if generator.random() >= self.detection_probability(force_mn, threshold_mn):
            return None
        return generator.normal(_REACTION_MU_S, _REACTION_SIGMA_S) + generator.exponential(_REACTION_TAU_S)


def median_threshold_mn(modulation_hz: float) -> float:
    """Return the median threshold force in mN.

    Between the three frequencies of `MEDIAN_THRESHOLDS_MN` it is interpolated in log-log, outside it is held:
    both assumed.
    """
    frequencies_hz = sorted(MEDIAN_THRESHOLDS_MN)
    held_hz = min(max(modulation_hz, frequencies_hz[0]), frequencies_hz[-1])
    above = next(index for index, f_hz in enumerate(frequencies_hz) if index > 0 and held_hz <= f_hz)
    low_hz, high_hz = frequencies_hz[above - 1], frequencies_hz[above]
    low_mn, high_mn = MEDIAN_THRESHOLDS_MN[low_hz], MEDIAN_THRESHOLDS_MN[high_hz]
    share = math.log(held_hz / low_hz) / math.log(high_hz / low_hz)
    return low_mn * math.pow(high_mn / low_mn, share)
