"""Thresholds of adaptive studies in words."""

from collections.abc import Iterator, Mapping

from autd_analysis.data.design import describe_condition
from autd_analysis.data.trials import Trials
from autd_analysis.report.answers import change_words, test_words
from autd_analysis.report.wording import (
    THIN,
    Labels,
    and_words,
    direction,
    format_interval,
    format_level,
    format_number,
    format_p,
    p_equals,
    study_labels,
)
from autd_analysis.subject import Answer, Shown
from autd_analysis.thresholds.comparisons import ThresholdComparison, Thresholds
from autd_analysis.thresholds.numbers import GroupThreshold
from autd_trials.protocol.method import Method, Staircase

DEFINITIONS: Mapping[str, str] = {
    "threshold": (
        "With an adaptive method: a participant's threshold in a condition is the geometric mean of an even "
        "number of a staircase's reversals with its final steps, for the rate at which the staircase "
        "settles, or the mean of QUEST+'s posterior in dB, for the level at which the stimulus alone, "
        "guesses and lapses aside, is felt half the time. Means, intervals, paired t and exact sign-flip "
        "tests are of thresholds in dB over participants; undetermined ones are excluded "
        "and counted. The exact sign test counts them too where a threshold seems to lie beyond "
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
    "paired t test and an exact sign-flip test. Undetermined thresholds are excluded, but an exact sign "
    "test counts which of two is higher also where one seems to lie beyond the levels. All tests are "
    "two-sided; p values were adjusted by Holm's method for each kind of test."
)


def words(found: Thresholds, trials: Trials) -> Shown:
    """Return thresholds and the planned comparisons of them in words."""
    labels = study_labels(trials.design)
    tests = sum(each.sign_flip is not None for each in found.comparisons)
    answers = tuple(
        Answer(labels.condition(each.contrast.at), _answer(each, tests, labels)) for each in found.comparisons
    )
    return Shown(
        summary=tuple(_lines(found, labels)),
        methods=method_sentences(found.method),
        paragraphs=(" ".join(_sentences(found, labels)),),
        answers=answers or tuple(_nothing_compared(found, trials, labels)),
    )


def _lines(thresholds: Thresholds, labels: Labels) -> Iterator[str]:
    groups = thresholds.conditions
    yield f"Thresholds ({thresholds.method.varies}; geometric mean over participants, 95% t interval):"
    width = max((len(describe_condition(group.condition)) for group in groups), default=0)
    for group in groups:
        yield f"  {describe_condition(group.condition):<{width}}  {_group(group)}"
    if thresholds.comparisons:
        yield ""
        yield "Planned comparisons of thresholds (within participants, two-sided; Holm over all of them):"
        for found in thresholds.comparisons:
            yield f"  {_comparison(found, labels)}"


def _sentences(thresholds: Thresholds, labels: Labels) -> Iterator[str]:
    for group in thresholds.conditions:
        where = labels.place(group.condition) or "overall"
        yield f"The geometric mean threshold {where} was {_group(group)}."
    for found in thresholds.comparisons:
        yield f"Difference of thresholds, {_comparison(found, labels)}."


def _group(group: GroupThreshold) -> str:
    """Return a condition's mean threshold with its interval, n, and how many are undetermined."""
    beyond = [
        f"{count} {where}, so the mean is too {what}"
        for count, where, what in (
            (group.over, "beyond the largest level", "low"),
            (group.under, "beyond the smallest level", "high"),
        )
        if count
    ]
    undetermined = (
        f", {'; '.join([f'{group.undetermined} undetermined', *beyond])}" if group.undetermined else ""
    )
    mean = f"{format_level(group.threshold)} {format_interval(group.interval, format_level)}"
    return f"{mean}, n = {group.participants}{undetermined}"


def _comparison(found: ThresholdComparison, labels: Labels) -> str:
    """Return what was compared, the difference, and its tests."""
    first, _ = labels.sides(found.contrast)
    parts = [
        f"{format_number(found.mean_db)}{THIN}dB, 95% CI {format_interval(found.interval, format_number)}",
        f"n = {len(found.differences_db)}",
    ]
    if found.paired_t:
        test = found.paired_t
        parts.append(
            f"t({test.df}) = {format_number(test.t)}, {p_equals(test.p)} "
            f"(Holm {format_p(found.paired_t_holm)}), dz = {format_number(test.dz)}"
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
    return f"{labels.contrast(found.contrast)}: {'; '.join(parts)}"


def _answer(found: ThresholdComparison, tests: int, labels: Labels) -> str:
    first, second = labels.sides(found.contrast)
    if found.mean_db is None:
        return f"the thresholds of {first} and {second} could not be compared: no participant has both."
    change = change_words(
        direction(found.mean_db),
        found.sign_flip,
        found.sign_flip_holm if found.sign_flip else found.paired_t_holm,
        tests,
        (
            f"a higher threshold with {first} than with {second}",
            f"a lower threshold with {first} than with {second}",
            f"no clear difference between the thresholds of {first} and {second}",
        ),
    )
    facts = [
        f"difference {format_number(found.mean_db)}{THIN}dB",
        *([f"95% CI {format_interval(found.interval, format_number)}"] if found.interval else []),
        f"n = {len(found.differences_db)}",
        *test_words(found.sign_flip, found.sign_flip_holm, found.paired_t, found.paired_t_holm),
    ]
    return f"{change}: {', '.join(facts)}."


def _nothing_compared(found: Thresholds, trials: Trials, labels: Labels) -> Iterator[Answer]:
    """Yield the thresholds instead of answers, where no comparison was planned."""
    known = [group for group in found.conditions if group.threshold is not None]
    if known and not trials.design.comparisons:
        means = [
            f"{format_level(group.threshold)} ({labels.condition(group.condition) or 'overall'})"
            for group in known
        ]
        varied = labels.words(found.method.varies)
        yield Answer("", f"No comparison was planned. Mean thresholds ({varied}) were {and_words(means)}.")


def felt_words(method: Method) -> str:
    """Return for which rate of "felt" the method's thresholds are, for an axis."""
    if isinstance(method, Staircase):
        return f"felt in {100 * method.converges_to:.3g}% of trials"
    return "felt in 50% of trials, guesses and lapses aside"


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
