"""Thresholds of adaptive studies in words."""

from collections.abc import Iterator

from autd_analysis.design import describe_condition
from autd_analysis.study import Results
from autd_analysis.threshold_comparisons import ThresholdComparison
from autd_analysis.thresholds import GroupThreshold
from autd_analysis.wording import (
    THIN,
    Labels,
    format_interval,
    format_level,
    format_number,
    format_p,
    p_equals,
    study_labels,
)
from autd_trials.protocol.method import Method, Staircase

_ESTIMATES = {
    "staircase": (
        "A participant's threshold is the geometric mean of an even number of the reversals with the final "
        "steps."
    ),
    "quest_plus": (
        "A participant's threshold is the mean of QUEST+'s posterior in dB, for the level at which the "
        "stimulus alone, guesses and lapses aside, is felt half the time."
    ),
}
_COMPARED = (
    "Thresholds were averaged over participants and compared within them in dB (20 log10 of the level), by a "
    "paired t test and an exact sign-flip test. Undetermined thresholds are excluded, but an exact sign "
    "test counts which of two is higher also where one seems to lie beyond the levels. All tests "
    "are two-sided; p values were adjusted by Holm's method for each kind of test."
)


def threshold_lines(results: Results) -> Iterator[str]:
    """Yield the lines of a summary: thresholds, and the planned comparisons of them."""
    assert results.trials.design.method is not None
    labels = study_labels(results.trials.design)
    varied, groups = results.trials.design.method.varies, results.group_thresholds
    yield f"Thresholds ({varied}; geometric mean over participants, 95% t interval):"
    width = max((len(describe_condition(group.condition)) for group in groups), default=0)
    for group in groups:
        yield f"  {describe_condition(group.condition):<{width}}  {group_words(group)}"
    if results.threshold_comparisons:
        yield ""
        yield "Planned comparisons of thresholds (within participants, two-sided; Holm over all of them):"
        for found in results.threshold_comparisons:
            yield f"  {comparison_words(found, labels)}"


def group_words(group: GroupThreshold) -> str:
    """Return a condition's mean threshold with its interval, n, and how many are undetermined."""
    beyond = [
        f"{count} {where}, so the mean is too {what}"
        for count, where, what in (
            (group.over, "beyond the largest level", "low"),
            (group.under, "beyond the smallest level", "high"),
        )
        if count
    ]
    undetermined = f", {'; '.join([f'{group.untold} undetermined', *beyond])}" if group.untold else ""
    mean = f"{format_level(group.threshold)} {format_interval(group.interval, format_level)}"
    return f"{mean}, n = {group.participants}{undetermined}"


def felt_words(method: Method) -> str:
    """Return for which rate of "felt" the method's thresholds are, for an axis."""
    if isinstance(method, Staircase):
        return f"felt in {100 * method.converges_to:.3g}% of trials"
    return "felt in 50% of trials, guesses and lapses aside"


def comparison_words(found: ThresholdComparison, labels: Labels) -> str:
    """Return what was compared, the difference, and its tests."""
    first = labels.stated(found.factor, found.first)
    parts = [
        f"{format_number(found.mean_db)}{THIN}dB, 95% CI {format_interval(found.interval, format_number)}",
        f"n = {len(found.differences_db)}",
        *threshold_tests(found),
    ]
    if found.sign_p is not None:
        counts = f"{found.higher_first} of {found.higher_first + found.higher_second}"
        parts.append(
            f"{first} higher in {counts}, exact sign test {p_equals(found.sign_p)} "
            f"(Holm {format_p(found.sign_holm)})"
        )
    return f"{labels.comparison(found)}: {'; '.join(parts)}"


def threshold_tests(found: ThresholdComparison) -> Iterator[str]:
    """Yield the tests of a difference of thresholds in dB."""
    if found.paired_t:
        test = found.paired_t
        yield (
            f"t({test.df}) = {format_number(test.t)}, {p_equals(test.p)} "
            f"(Holm {format_p(found.paired_t_holm)}), dz = {format_number(test.dz)}"
        )
    if found.sign_flip:
        flip = found.sign_flip
        yield (
            f"exact sign-flip {p_equals(flip.p)} (Holm {format_p(found.sign_flip_holm)}; least possible "
            f"{format_p(flip.floor)})"
        )


def method_sentences(method: Method) -> str:
    """Return how levels were chosen and thresholds estimated and compared, as sentences."""
    levels = f"{method.range.levels} levels from {method.range.smallest:g} to {method.range.largest:g}"
    chosen = f"The {method.varies} of each trial was chosen from the answers before by"
    return " ".join(
        (
            f"{chosen} {_rule(method)}, among {levels}, evenly spaced on a logarithmic scale.",
            _ESTIMATES[method.kind],
            _COMPARED,
        )
    )


def _rule(method: Method) -> str:
    if not isinstance(method, Staircase):
        return "QUEST+ (Watson, 2017) with a Weibull function"
    kind = f"1-up-{method.felt_to_go_down}-down staircase"
    if method.step_up != method.step_down:
        kind = f"weighted {kind}"
    factors = " and ".join(map(str, method.step_factors))
    return (
        f"a {kind} that began at {method.start:g}, with steps of {method.step_up} levels up and "
        f"{method.step_down} down times {factors} (the next with each reversal), which balance where "
        f"{method.converges_to:.3g} of the trials are felt"
    )
