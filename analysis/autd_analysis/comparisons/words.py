"""The planned comparisons in words: for the terminal, and for a manuscript."""

from collections.abc import Iterator, Mapping, Sequence

from autd_analysis.basics.intervals import Interval
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.data.design import describe_condition
from autd_analysis.data.foreign.request import comparison_option
from autd_analysis.data.trials import Trials
from autd_analysis.report.answers import change_words, test_words
from autd_analysis.report.wording import (
    Labels,
    and_words,
    counted_words,
    direction,
    format_interval,
    format_number,
    format_p,
    format_rate,
    p_equals,
    study_labels,
    upper_first,
    was,
)
from autd_analysis.subject import Answer, Shown
from autd_trials.protocol.schema import Comparison

DEFINITIONS: Mapping[str, str] = {
    "difference": (
        "A planned comparison is the mean over participants of rate at first minus rate at second, with "
        "Student's 95% t interval; participants without both rates are excluded and named. Over factors "
        "that are not compared, cells are averaged, each counting the same."
    ),
    "sign_flip": (
        "Exact two-sided sign-flip test of the mean difference over all 2^n sign patterns; its least p is "
        "2 / 2^k with k differences that are not zero."
    ),
    "paired_t": (
        "Paired t test, two-sided; not testable if all differences are equal. dz is mean / SD, its 95% "
        "interval by the noncentral t distribution."
    ),
    "wilcoxon": (
        "Exact two-sided Wilcoxon signed-rank test with mid-ranks, zeros excluded; beside the planned tests."
    ),
    "bayes_factor": (
        "JZS Bayes factor of the paired t test, Cauchy prior of scale 0.707 on the effect size; over 1 "
        "speaks for a difference."
    ),
    "mixed_model": (
        "Logistic mixed model of the single answers at the level where factors are compared (of all answers, "
        "where it is overall): every condition a fixed effect, a random intercept and a random slope for the "
        "compared factor over participants, by adaptive Gauss-Hermite quadrature (9 nodes or more per "
        "effect); difference in logits with Wald's 95% interval, likelihood-ratio test. "
        "Where all or none were felt in a condition, half an answer of each kind is added to every condition "
        "(Firth's penalty)."
    ),
    "holm": (
        "Holm's adjustment over all planned comparisons together, for each of the three tests by itself; "
        "comparisons that could not be tested do not count."
    ),
}
"""How each quantity was found."""

_CHI2 = "\N{GREEK SMALL LETTER CHI}\N{SUPERSCRIPT TWO}"
_SIGN_FLIP = "an exact sign-flip test"
_PAIRED_T = "a paired t test"
_MIXED = (
    "the likelihood-ratio test of a logistic mixed model with random intercepts and random slopes of the "
    "compared factor over participants"
)


def words(comparisons: Sequence[ComparisonResult], trials: Trials) -> Shown:
    """Return the planned comparisons in words, or that nothing was compared."""
    labels = study_labels(trials.design)
    return Shown(
        summary=tuple(_comparison_lines(comparisons, labels) if comparisons else _nothing_compared(trials)),
        methods=" ".join(_tests_made(comparisons, labels)),
        paragraphs=(" ".join(_sentence(each, labels) for each in comparisons),) if comparisons else (),
        answers=tuple(
            Answer(labels.condition(each.contrast.at), _answer(each, labels)) for each in comparisons
        ),
    )


def _comparison_lines(comparisons: Sequence[ComparisonResult], labels: Labels) -> Iterator[str]:
    yield "Planned comparisons (within participants, two-sided; Holm over all of them):"
    for result in comparisons:
        yield f"  {describe_condition(result.contrast.at)}: {_difference(result, labels)}"
        yield from (f"    {line}" for line in _test_lines(result))


def _difference(result: ComparisonResult, labels: Labels) -> str:
    if result.mean is None:
        return f"{labels.difference(result.contrast)}: no participant has both rates"
    first, second = labels.sides(result.contrast)
    change = {
        0: f"the same mean rate with {first} as with {second}",
        1: f"felt more often with {first} than with {second}",
        -1: f"felt less often with {first} than with {second}",
    }[direction(result.mean)]
    interval = f"{format_rate(result.mean)} {format_interval(result.interval)}"
    return f"{change}, difference {interval}, n = {result.participants}"


def _test_lines(result: ComparisonResult) -> Iterator[str]:
    parts = []
    if result.sign_flip:
        parts.append(
            f"sign-flip {p_equals(result.sign_flip.p)} (Holm {format_p(result.sign_flip_holm)}; "
            f"least possible {format_p(result.sign_flip.floor)})"
        )
    if result.paired_t:
        parts.append(
            f"t({result.paired_t.df}) = {format_number(result.paired_t.t)}, {p_equals(result.paired_t.p)} "
            f"(Holm {format_p(result.paired_t_holm)}), dz = {format_number(result.paired_t.dz)}"
        )
    if parts:
        yield "; ".join(parts)
    if result.mixed_model:
        test = result.mixed_model
        yield (
            f"mixed model: {format_number(test.logits)} logits "
            f"{format_interval(test.interval, format_number)}, "
            f"chi2(1) = {format_number(test.statistic)}, {p_equals(test.p)} "
            f"(Holm {format_p(result.mixed_model_holm)})"
        )
    yield from result.notes


def _nothing_compared(trials: Trials) -> Iterator[str]:
    if trials.logged:
        yield "The protocol plans no comparison."
        return
    yield "Nothing was compared, as --compare did not ask for it."
    design = trials.design
    compared = next((factor for factor in design.factors if len(factor.levels) > 1), None)
    if compared is not None:
        first, second = compared.levels[:2]
        other = next((factor.name for factor in design.factors if factor != compared), None)
        example = Comparison.model_construct(factor=compared.name, first=first, second=second, at_each=other)
        yield f"To compare two levels of a factor within participants: {comparison_option(example)}"
    else:
        yield "There is one condition only."


def _tests_made(comparisons: Sequence[ComparisonResult], labels: Labels) -> Iterator[str]:
    if not comparisons:
        yield "No comparison was planned."
        return
    places: dict[str, list[str]] = {}
    for result in comparisons:
        places.setdefault(labels.difference(result.contrast), []).append(
            labels.place(result.contrast.at) or "overall"
        )
    what = and_words([f"{difference} {and_words(where)}" for difference, where in places.items()])
    yield (
        f"{upper_first(counted_words(len(comparisons), 'comparison'))} within participants "
        f"{was(len(comparisons))} planned: {what}."
    )
    made = [
        test
        for test, its in (
            (_SIGN_FLIP, [result.sign_flip for result in comparisons]),
            (_PAIRED_T, [result.paired_t for result in comparisons]),
            (_MIXED, [result.mixed_model for result in comparisons]),
        )
        if any(its)
    ]
    if made:
        yield (
            f"Participants' differences of rates were tested two-sided by {and_words(made)}; p values were "
            f"adjusted by Holm's method over {counted_words(comparisons[0].family, 'planned test')} of each "
            "kind."
        )
    else:
        yield "None of them could be tested."


def _sentence(result: ComparisonResult, labels: Labels) -> str:
    where = labels.place(result.contrast.at)
    opening = f"{upper_first(where)}, " if where else "Overall, "
    first, second = labels.sides(result.contrast)
    if result.mean is None:
        return f"{opening}{first} and {second} could not be compared: no participant has both rates."
    change = (
        f"the detection rate was {format_rate(abs(result.mean))} "
        f"{'higher' if result.mean > 0 else 'lower'} with {first} than with {second}"
        if direction(result.mean)
        else f"the mean detection rate was the same with {first} as with {second}"
    )
    facts = [f"{_interval(result.interval)}n = {result.participants}", *_tests(result)]
    notes = "".join(f" {upper_first(note)}." for note in result.notes)
    return f"{opening}{change} ({'; '.join(facts)}).{notes}"


def _tests(result: ComparisonResult) -> Iterator[str]:
    if result.sign_flip:
        yield (
            f"exact sign-flip test {p_equals(result.sign_flip.p)}, Holm-adjusted "
            f"{p_equals(result.sign_flip_holm)}, least possible {p_equals(result.sign_flip.floor)}"
        )
    if result.paired_t:
        test = result.paired_t
        yield (
            f"paired t test t({test.df}) = {format_number(test.t)}, {p_equals(test.p)}, Holm-adjusted "
            f"{p_equals(result.paired_t_holm)}, dz = {format_number(test.dz)}"
        )
    if result.mixed_model:
        model = result.mixed_model
        yield (
            f"mixed model {format_number(model.logits)} logits, "
            f"{_CHI2}(1) = {format_number(model.statistic)}, {p_equals(model.p)}, "
            f"Holm-adjusted {p_equals(result.mixed_model_holm)}"
        )


def _interval(interval: Interval | None) -> str:
    return f"95% CI {format_interval(interval)}, " if interval else ""


def _answer(result: ComparisonResult, labels: Labels) -> str:
    first, second = labels.sides(result.contrast)
    if result.mean is None:
        return f"{first} and {second} could not be compared: no participant has both rates."
    change = change_words(
        direction(result.mean),
        result.sign_flip,
        result.sign_flip_holm if result.sign_flip else result.paired_t_holm,
        result.family,
        (
            f"felt more often with {first} than with {second}",
            f"felt less often with {first} than with {second}",
            f"no clear difference between {first} and {second}",
        ),
    )
    facts = [
        f"difference in rate {format_rate(result.mean)}",
        *([f"95% CI {format_interval(result.interval)}"] if result.interval else []),
        f"n = {result.participants}",
        *test_words(result.sign_flip, result.sign_flip_holm, result.paired_t, result.paired_t_holm),
    ]
    return f"{change}: {', '.join(facts)}."
