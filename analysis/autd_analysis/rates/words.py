"""Rates in words: for the terminal, and for a manuscript."""

from collections.abc import Iterator, Mapping, Sequence

from autd_analysis.data.design import describe_condition
from autd_analysis.data.trials import Trials
from autd_analysis.rates.numbers import ConditionRate, Rates
from autd_analysis.report.wording import and_words, format_interval, format_rate, place_words
from autd_analysis.subject import Shown

DEFINITIONS: Mapping[str, str] = {
    "participant_rate": (
        "A participant's rate is felt / trials, with Wilson's 95 % score interval, which takes the trials as "
        "independent and equally likely to be felt; beside it Clopper and Pearson's exact interval and "
        "Jeffreys', which ends at 0 or 1 where none or all were felt."
    ),
    "rate": (
        "A condition's rate is the mean of the participants' rates, with Student's 95 % t interval over "
        "participants, whose ends are kept within 0..1; no interval for one participant or if all have the "
        "same rate. Beside it the percentile interval of the participant bootstrap over all n^n resamples, "
        "and the beta-binomial model's mean with its profile-likelihood interval and the correlation of two "
        "answers of one person; its test of overdispersion is halved, as a correlation is not negative."
    ),
    "false_alarm_rate": "The share of catch trials answered as felt; undefined without catch trials.",
}
"""How each quantity was found."""

_METHODS = (
    "A participant's detection rate is the share of trials with a stimulus that were answered as felt. Rates "
    "are means over participants, each participant counting the same, with Student's 95 % t interval over "
    "participants. "
)
_FALSE_ALARMS = "The false-alarm rate is the share of catch trials that were answered as felt."
_NO_CATCH_TRIALS = "Without catch trials the false-alarm rate and d' are undefined."


def words(rates: Rates, trials: Trials) -> Shown:
    """Return rates in words; for a manuscript only false alarms where an adaptive method steered rates."""
    steered = trials.design.method is not None
    detected = () if steered else tuple(_rates(rates.conditions))
    false_alarms = _NO_CATCH_TRIALS if rates.false_alarms is None else _FALSE_ALARMS
    return Shown(
        summary=tuple(_lines(rates)),
        methods="" if steered else _METHODS + false_alarms,
        paragraphs=(" ".join((*detected, *_false_alarms(rates))),),
    )


def _lines(rates: Rates) -> Iterator[str]:
    yield "Detection rate (mean over participants, 95 % t interval):"
    yield from _rate_lines(rates.conditions)
    yield ""
    if rates.false_alarms is None:
        yield "False-alarm rate: undefined, the study has no catch trials."
        return
    yield "False-alarm rate (catch trials answered as felt; mean over participants, 95 % t interval):"
    yield from _rate_lines(rates.false_alarms)


def _rate_lines(rates: Sequence[ConditionRate]) -> Iterator[str]:
    names = [describe_condition(rate.condition) for rate in rates]
    width = max(map(len, names), default=0)
    for name, rate in zip(names, rates, strict=True):
        yield (
            f"  {name:<{width}}  {format_rate(rate.mean)} {format_interval(rate.interval):<14}"
            f"  n = {rate.participants}  ({rate.felt}/{rate.n} trials)"
        )


def _rates(rates: Sequence[ConditionRate]) -> Iterator[str]:
    known = [rate for rate in rates if rate.mean is not None]
    if not known:
        yield "No stimulus was answered, so that there is no detection rate."
        return
    parts = [f"{_rate(rate)} {place_words(rate.condition)}".rstrip() for rate in known]
    yield (
        "The mean detection rate over participants, with its 95 % t interval where it has one, was "
        f"{and_words(parts)}."
    )


def _false_alarms(rates: Rates) -> Iterator[str]:
    if rates.false_alarms is None:
        yield "There were no catch trials, so that the false-alarm rate is not known."
        return
    parts = [
        f"{_rate(rate)} {place_words(rate.condition) or 'overall'}"
        for rate in rates.false_alarms
        if rate.mean is not None
    ]
    yield f"The mean false-alarm rate was {and_words(parts)}."


def _rate(rate: ConditionRate) -> str:
    interval = f" {format_interval(rate.interval)}" if rate.interval else ""
    return f"{format_rate(rate.mean)}{interval}"
