"""What a study found, one sentence for each planned comparison: what its report opens with."""

from collections.abc import Iterator
from dataclasses import dataclass

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.rates import ConditionRate
from autd_analysis.study import Results
from autd_analysis.threshold_comparisons import ThresholdComparison
from autd_analysis.wording import (
    THIN,
    Labels,
    direction,
    format_interval,
    format_number,
    format_p,
    format_rate,
    p_equals,
    study_labels,
)

CLEAR = 0.05
RULE = (
    "A difference is called clear where the exact sign-flip test (the paired t test, where there is none) "
    "gives a p of at most .05 after adjustment by Holm's method over all planned comparisons."
)


@dataclass(frozen=True)
class Answer:
    """Where something was compared (empty: overall), and what was found there."""

    where: str
    sentence: str


def answers(results: Results) -> tuple[Answer, ...]:
    """Return a sentence for each planned comparison; without any, one on what was measured.

    Parameters
    ----------
    results
        The study's results.
    """
    labels = study_labels(results.trials.design)
    tests = sum(found.sign_flip is not None for found in results.threshold_comparisons)
    compared = (
        *(
            Answer(labels.condition(found.at), _rates(found, found.sign_flip_tests, labels))
            for found in results.comparisons
        ),
        *(
            Answer(labels.condition(found.at), _thresholds(found, tests, labels))
            for found in results.threshold_comparisons
        ),
    )
    return compared or (Answer("", _nothing_compared(results, labels)),)


def _rates(found: ComparisonResult, tests: int, labels: Labels) -> str:
    first, second = (labels.stated(found.factor, level) for level in (found.first, found.second))
    if found.mean is None:
        return f"{first} and {second} could not be compared: no participant has both rates."
    change = _change(
        found,
        direction(found.mean),
        tests,
        f"felt more often with {first} than with {second}",
        f"felt less often with {first} than with {second}",
        f"no clear difference between {first} and {second}",
    )
    facts = [
        f"difference in rate {format_rate(found.mean)}",
        *([f"95% CI {format_interval(found.interval)}"] if found.interval else []),
        f"n = {found.participants}",
        *_test(found),
    ]
    return f"{change}: {', '.join(facts)}."


def _thresholds(found: ThresholdComparison, tests: int, labels: Labels) -> str:
    first, second = (labels.stated(found.factor, level) for level in (found.first, found.second))
    if found.mean_db is None:
        return f"the thresholds of {first} and {second} could not be compared: no participant has both."
    change = _change(
        found,
        direction(found.mean_db),
        tests,
        f"a higher threshold with {first} than with {second}",
        f"a lower threshold with {first} than with {second}",
        f"no clear difference between the thresholds of {first} and {second}",
    )
    facts = [
        f"difference {format_number(found.mean_db)}{THIN}dB",
        *([f"95% CI {format_interval(found.interval, format_number)}"] if found.interval else []),
        f"n = {len(found.differences_db)}",
        *_test(found),
    ]
    return f"{change}: {', '.join(facts)}."


def _change(
    found: ComparisonResult | ThresholdComparison, sign: int, tests: int, more: str, less: str, none: str
) -> str:
    """Return which way the difference goes, if it is clear, or if no difference could have been."""
    adjusted = found.sign_flip_holm if found.sign_flip else found.paired_t_holm
    observed = {1: more, -1: less}.get(sign, none)
    if adjusted is not None and adjusted <= CLEAR:
        return observed
    if sign and found.sign_flip and tests * found.sign_flip.floor > CLEAR:
        return f"{observed}, but so few participants cannot make it clear"
    return none


def _test(found: ComparisonResult | ThresholdComparison) -> Iterator[str]:
    if found.sign_flip:
        flip = found.sign_flip
        yield (
            f"exact sign-flip {p_equals(flip.p)} (least possible {format_p(flip.floor)}), adjusted "
            f"{p_equals(found.sign_flip_holm)}"
        )
    elif found.paired_t:
        test = found.paired_t
        yield (
            f"t({test.df}) = {format_number(test.t)}, {p_equals(test.p)}, adjusted "
            f"{p_equals(found.paired_t_holm)}"
        )


def _nothing_compared(results: Results, labels: Labels) -> str:
    planned = "No comparison was planned" if results.trials.logged else "No comparison was asked for"
    known = [rate for rate in results.rates if rate.mean is not None]
    if results.thresholds or not known:
        return f"{planned}."
    lowest, highest = min(known, key=_mean), max(known, key=_mean)
    if lowest.mean == highest.mean:
        where = " everywhere" if len(known) > 1 else ""
        return f"{planned}. The mean detection rate was {format_rate(lowest.mean)}{where}."
    ends = [
        f"{format_rate(rate.mean)} ({labels.condition(rate.condition) or 'overall'})"
        for rate in (lowest, highest)
    ]
    return f"{planned}. Mean detection rates ran from {ends[0]} to {ends[1]}."


def _mean(rate: ConditionRate) -> float:
    return rate.mean or 0.0
