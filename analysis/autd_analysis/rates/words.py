"""Rates in words: for the terminal, and for a manuscript."""

from collections.abc import Iterator, Mapping, Sequence

from autd_analysis.data.design import describe_condition
from autd_analysis.data.trials import Trials
from autd_analysis.rates.numbers import ConditionRate, Rates
from autd_analysis.report.wording import Labels, and_words, format_interval, format_rate, study_labels
from autd_analysis.subject import Answer, Shown

DEFINITIONS: Mapping[str, str] = {
    "participant_rate": (
        "A participant's rate is felt / trials, with Wilson's 95% score interval, which takes the trials as "
        "independent and equally likely to be felt; beside it Clopper and Pearson's exact interval and "
        "Jeffreys', which ends at 0 or 1 where none or all were felt."
    ),
    "rate": (
        "A condition's rate is the mean of the participants' rates, with Student's 95% t interval over "
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
    "are means over participants, each participant counting the same, with Student's 95% t interval over "
    "participants. "
)
_FALSE_ALARMS = "The false-alarm rate is the share of catch trials that were answered as felt."
_NO_CATCH_TRIALS = "Without catch trials the false-alarm rate and d' are undefined."


def words(rates: Rates, trials: Trials) -> Shown:
    """Return rates in words; for a manuscript only false alarms where an adaptive method steered rates."""
    steered = trials.design.method is not None
    labels = study_labels(trials.design)
    detected = () if steered else tuple(_rates(rates.conditions, labels))
    false_alarms = _NO_CATCH_TRIALS if rates.false_alarms is None else _FALSE_ALARMS
    return Shown(
        summary=tuple(_lines(rates)),
        methods="" if steered else _METHODS + false_alarms,
        paragraphs=(" ".join((*detected, *_false_alarms(rates, labels))),),
        answers=() if steered or trials.design.comparisons else (_nothing_compared(rates, trials, labels),),
    )


def _lines(rates: Rates) -> Iterator[str]:
    yield "Detection rate (mean over participants, 95% t interval):"
    yield from _rate_lines(rates.conditions)
    yield ""
    if rates.false_alarms is None:
        yield "False-alarm rate: undefined, the study has no catch trials."
        return
    yield "False-alarm rate (catch trials answered as felt; mean over participants, 95% t interval):"
    yield from _rate_lines(rates.false_alarms)


def _rate_lines(rates: Sequence[ConditionRate]) -> Iterator[str]:
    names = [describe_condition(rate.condition) for rate in rates]
    width = max(map(len, names), default=0)
    for name, rate in zip(names, rates, strict=True):
        yield (
            f"  {name:<{width}}  {format_rate(rate.mean)} {format_interval(rate.interval):<14}"
            f"  n = {rate.participants}  ({rate.felt}/{rate.n} trials)"
        )


def _rates(rates: Sequence[ConditionRate], labels: Labels) -> Iterator[str]:
    known = [rate for rate in rates if rate.mean is not None]
    if not known:
        yield "No stimulus was answered, so that there is no detection rate."
        return
    parts = [f"{_rate(rate)} {labels.place(rate.condition)}".rstrip() for rate in known]
    yield (
        "The mean detection rate over participants, with its 95% t interval where it has one, was "
        f"{and_words(parts)}."
    )


def _false_alarms(rates: Rates, labels: Labels) -> Iterator[str]:
    if rates.false_alarms is None:
        yield "There were no catch trials, so that the false-alarm rate is not known."
        return
    parts = [
        f"{_rate(rate)} {labels.place(rate.condition) or 'overall'}"
        for rate in rates.false_alarms
        if rate.mean is not None
    ]
    yield f"The mean false-alarm rate was {and_words(parts)}."


def _rate(rate: ConditionRate) -> str:
    interval = f" {format_interval(rate.interval)}" if rate.interval else ""
    return f"{format_rate(rate.mean)}{interval}"


def _nothing_compared(rates: Rates, trials: Trials, labels: Labels) -> Answer:
    """Return what stands for answers where no comparison was planned."""
    planned = "No comparison was planned" if trials.logged else "No comparison was asked for"
    known = [(rate.mean, rate.condition) for rate in rates.conditions if rate.mean is not None]
    if not known:
        return Answer("", f"{planned}.")
    (lowest, where_lowest), (highest, where_highest) = (
        choice(known, key=lambda each: each[0]) for choice in (min, max)
    )
    if lowest == highest:
        where = " everywhere" if len(known) > 1 else ""
        return Answer("", f"{planned}. The mean detection rate was {format_rate(lowest)}{where}.")
    return Answer(
        "",
        f"{planned}. Mean detection rates ran from {format_rate(lowest)} ({labels.condition(where_lowest)}) "
        f"to {format_rate(highest)} ({labels.condition(where_highest)}).",
    )
