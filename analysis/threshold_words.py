"""Thresholds of adaptive studies in words."""

from collections.abc import Iterator

from analysis.design import describe_condition
from analysis.study import Results
from analysis.threshold_comparisons import ThresholdComparison
from analysis.thresholds import GroupThreshold
from analysis.wording import (
    MINUS,
    compared_level,
    format_interval,
    format_p,
    format_rate,
    p_equals,
)
from autd_trials.protocol.method import Method, Staircase


def threshold_lines(results: Results) -> Iterator[str]:
    """Yield the lines of a summary: thresholds, and the planned comparisons of them."""
    assert results.trials.design.method is not None
    varied, groups = results.trials.design.method.varies, results.group_thresholds
    yield f"Thresholds ({varied}; geometric mean over participants, 95 % t interval):"
    width = max((len(describe_condition(group.condition)) for group in groups), default=0)
    for group in groups:
        yield f"  {describe_condition(group.condition):<{width}}  {group_words(group)}"
    if results.threshold_comparisons:
        yield ""
        yield "Planned comparisons of thresholds (within participants, two-sided; Holm over all of them):"
        for found in results.threshold_comparisons:
            yield f"  {comparison_words(found)}"


def group_words(group: GroupThreshold) -> str:
    """Return a condition's mean threshold with its interval, n, and how many tracks tell none."""
    untold = f", {group.untold} not told" if group.untold else ""
    return (
        f"{format_rate(group.threshold)} {format_interval(group.interval)}, n = {group.participants}{untold}"
    )


def comparison_words(found: ThresholdComparison) -> str:
    """Return what was compared, the difference, and its tests."""
    first, second = (compared_level(found.factor, level) for level in (found.first, found.second))
    at = f", {describe_condition(found.at)}" if found.at else ""
    parts = [f"{format_rate(found.mean_db)} dB {format_interval(found.interval)}"]
    parts.append(f"n = {len(found.differences_db)}")
    if found.paired_t:
        test = found.paired_t
        parts.append(
            f"t({test.df}) = {test.t:.2f}, {p_equals(test.p)} (Holm {format_p(found.paired_t_holm)}), "
            f"dz = {test.dz:.2f}"
        )
    if found.sign_flip:
        flip = found.sign_flip
        parts.append(f"exact sign-flip {p_equals(flip.p)} (Holm {format_p(found.sign_flip_holm)})")
    if found.sign_p is not None:
        counts = f"{found.higher_first} of {found.higher_first + found.higher_second}"
        parts.append(
            f"higher at first in {counts}, exact sign test {p_equals(found.sign_p)} "
            f"(Holm {format_p(found.sign_holm)})"
        )
    return f"{first} {MINUS} {second}{at}: {'; '.join(parts)}"


def method_words(method: Method) -> str:
    """Return how levels were chosen, as a sentence."""
    levels = f"{method.range.levels} levels from {method.range.smallest:g} to {method.range.largest:g}"
    if isinstance(method, Staircase):
        rule = f"a 1-up-{method.felt_to_go_down}-down staircase"
        if method.step_up != method.step_down:
            rule = f"a weighted {rule[2:]} ({method.step_up} up, {method.step_down} down)"
        rule = f"{rule}, which settles where {method.converges_to:.3g} of the trials are felt"
    else:
        rule = "QUEST+ (Watson, 2017) with a Weibull function"
    return f"The {method.varies} of each trial was chosen from the answers before by {rule}, among {levels}."
