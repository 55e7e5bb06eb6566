"""Thresholds of adaptive studies in words."""

from collections.abc import Iterator, Mapping

from autd_analysis.data.design import describe_condition
from autd_analysis.data.trials import Trials
from autd_analysis.report.wording import (
    MINUS,
    compared_labels,
    format_interval,
    format_p,
    format_rate,
    p_equals,
    place_words,
)
from autd_analysis.subject import Shown
from autd_analysis.thresholds.comparisons import ThresholdComparison, Thresholds
from autd_analysis.thresholds.numbers import GroupThreshold
from autd_trials.protocol.method import Method, Staircase

DEFINITIONS: Mapping[str, str] = {
    "threshold": (
        "With an adaptive method: a participant's threshold in a condition is the geometric mean of an even "
        "number of a staircase's reversals with its final steps, for the rate at which the staircase "
        "settles, or the mean of QUEST+'s posterior in dB, for the level at which the stimulus alone, "
        "guesses and lapses aside, is felt half the time. Means, intervals, paired t and exact sign-flip "
        "tests are of thresholds in dB over participants; those whose tracks do not tell a threshold are "
        "left out and counted. The exact sign test counts them too where a threshold seems to lie beyond "
        "the levels, and so beyond the other."
    ),
}
"""How each quantity was found."""
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
    "paired t test and an exact sign-flip test. Thresholds that the answers do not tell are left out, but an "
    "exact sign test counts which of two is higher also where one seems to lie beyond the levels. All tests "
    "are two-sided; p values were adjusted by Holm's method for each kind of test."
)


def words(found: Thresholds, _trials: Trials) -> Shown:
    """Return thresholds and the planned comparisons of them in words."""
    return Shown(
        summary=tuple(_lines(found)),
        methods=method_sentences(found.method),
        paragraphs=(" ".join(_sentences(found)),),
    )


def _lines(thresholds: Thresholds) -> Iterator[str]:
    groups = thresholds.conditions
    yield f"Thresholds ({thresholds.method.varies}; geometric mean over participants, 95 % t interval):"
    width = max((len(describe_condition(group.condition)) for group in groups), default=0)
    for group in groups:
        yield f"  {describe_condition(group.condition):<{width}}  {group_words(group)}"
    if thresholds.comparisons:
        yield ""
        yield "Planned comparisons of thresholds (within participants, two-sided; Holm over all of them):"
        for found in thresholds.comparisons:
            yield f"  {comparison_words(found)}"


def _sentences(thresholds: Thresholds) -> Iterator[str]:
    for group in thresholds.conditions:
        where = place_words(group.condition) or "overall"
        yield f"The geometric mean threshold {where} was {group_words(group)}."
    for found in thresholds.comparisons:
        yield f"Difference of thresholds, {comparison_words(found)}."


def group_words(group: GroupThreshold) -> str:
    """Return a condition's mean threshold with its interval, n, and how many tracks tell none."""
    beyond = [
        f"{count} {where}, so the mean is too {what}"
        for count, where, what in (
            (group.over, "beyond the largest level", "low"),
            (group.under, "beyond the smallest level", "high"),
        )
        if count
    ]
    untold = f", {'; '.join([f'{group.untold} not told', *beyond])}" if group.untold else ""
    return (
        f"{format_rate(group.threshold)} {format_interval(group.interval)}, n = {group.participants}{untold}"
    )


def comparison_words(found: ThresholdComparison) -> str:
    """Return what was compared, the difference, and its tests."""
    first, second = compared_labels(found.contrast)
    where = found.contrast.at
    at = f", {describe_condition(where)}" if where else ""
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
        parts.append(
            f"exact sign-flip {p_equals(flip.p)} (Holm {format_p(found.sign_flip_holm)}; least possible "
            f"{format_p(flip.floor)})"
        )
    if found.sign_p is not None:
        counts = f"{found.higher_first} of {found.higher_first + found.higher_second}"
        parts.append(
            f"{first} higher in {counts}, exact sign test {p_equals(found.sign_p)} "
            f"(Holm {format_p(found.sign_holm)})"
        )
    return f"{first} {MINUS} {second}{at}: {'; '.join(parts)}"


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
