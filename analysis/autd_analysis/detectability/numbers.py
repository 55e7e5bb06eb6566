"""Signal detection: d' and criterion of each participant from hits and false alarms.

With the log-linear correction, rates are (hits + 1/2) / (stimuli + 1) and (false alarms + 1/2) / (catch
trials + 1), for everybody, so that rates of 0 and 1 stay finite (Hautus, 1995, Behav. Res. Methods 27,
46-51). Without catch trials d' is undefined, not 0.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from autd_analysis.basics.intervals import Interval, t_interval, wald_interval
from autd_analysis.data.design import Condition
from autd_analysis.rates.numbers import ParticipantRate, Rates

DETECTABILITY_INTERVAL = "95 % t interval over participants"
PARTICIPANT_INTERVAL = "95 % Wald interval, trials taken as independent"

_NORMAL = statistics.NormalDist()


@dataclass(frozen=True)
class Detectability:
    """One participant's d' in a condition.

    Attributes
    ----------
    participant, condition
        Whose, and where.
    stimuli, catch_trials
        Numbers of trials.
    d_prime, criterion
        z(hits) - z(false alarms), and -(z(hits) + z(false alarms)) / 2.
    standard_error
        Of d', by the delta method (Gourevitch and Galanter, 1967); that of the criterion is half of it.
    """

    participant: str
    condition: Condition
    stimuli: int
    catch_trials: int
    d_prime: float
    criterion: float
    standard_error: float

    @property
    def interval(self) -> Interval:
        """Wald 95 % interval of d'."""
        return wald_interval(self.d_prime, self.standard_error)

    @property
    def criterion_interval(self) -> Interval:
        """Wald 95 % interval of the criterion."""
        return wald_interval(self.criterion, self.standard_error / 2)


@dataclass(frozen=True)
class GroupDetectability:
    """Mean d' and criterion over participants in a condition; the intervals are None where undefined."""

    condition: Condition
    d_prime: float
    interval: Interval | None
    criterion: float
    criterion_interval: Interval | None
    participants: int


@dataclass(frozen=True)
class DetectabilityResults:
    """What there is of d', of each participant and over participants; empty without catch trials."""

    participants: tuple[Detectability, ...]
    conditions: tuple[GroupDetectability, ...]


def detectability_results(rates: Rates) -> DetectabilityResults:
    """Return d' in every condition, of each participant and over participants."""
    found = detectability(rates.participants, rates.block_false_alarms) or ()
    return DetectabilityResults(found, over_participants(found))


def detectability(
    rates: Sequence[ParticipantRate], false_alarms: Sequence[ParticipantRate] | None
) -> tuple[Detectability, ...] | None:
    """Return d' of each participant in each condition.

    Parameters
    ----------
    rates
        Detection rates in the single cells.
    false_alarms
        False alarms in each kind of block; a condition goes with the catch trials of its own kind of block.

    Returns
    -------
    tuple of Detectability | None
        None without catch trials. Participants without trials or catch trials there are left out.
    """
    if false_alarms is None:
        return None
    found = []
    for rate in rates:
        catch = [noise for noise in false_alarms if _goes_with(noise, rate)]
        if rate.n > 0 and catch and catch[0].n > 0:
            found.append(_detectability(rate, catch[0]))
    return tuple(found)


def over_participants(found: Sequence[Detectability]) -> tuple[GroupDetectability, ...]:
    """Return the means over participants in each condition."""
    groups = []
    for condition in dict.fromkeys(each.condition for each in found):
        there = [each for each in found if each.condition == condition]
        values = [each.d_prime for each in there]
        criteria = [each.criterion for each in there]
        groups.append(
            GroupDetectability(
                condition=condition,
                d_prime=statistics.fmean(values),
                interval=t_interval(values),
                criterion=statistics.fmean(criteria),
                criterion_interval=t_interval(criteria),
                participants=len(there),
            )
        )
    return tuple(groups)


def _goes_with(noise: ParticipantRate, rate: ParticipantRate) -> bool:
    return noise.participant == rate.participant and set(noise.condition) <= set(rate.condition)


def _detectability(hits: ParticipantRate, catch: ParticipantRate) -> Detectability:
    hit_rate = (hits.felt + 0.5) / (hits.n + 1)
    false_alarm_rate = (catch.felt + 0.5) / (catch.n + 1)
    z_hit, z_false = _NORMAL.inv_cdf(hit_rate), _NORMAL.inv_cdf(false_alarm_rate)
    variance = _variance(hit_rate, z_hit, hits.n) + _variance(false_alarm_rate, z_false, catch.n)
    return Detectability(
        participant=hits.participant,
        condition=hits.condition,
        stimuli=hits.n,
        catch_trials=catch.n,
        d_prime=z_hit - z_false,
        criterion=-(z_hit + z_false) / 2,
        standard_error=math.sqrt(variance),
    )


def _variance(rate: float, z: float, n: int) -> float:
    return rate * (1 - rate) / (n * _NORMAL.pdf(z) ** 2)
