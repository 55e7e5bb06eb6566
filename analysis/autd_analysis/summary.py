"""A short reading of the results for the terminal."""

import shlex
from collections.abc import Iterator, Sequence

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.design import describe_condition
from autd_analysis.order_effects import OrderEffect
from autd_analysis.rates import ConditionRate
from autd_analysis.study import Results
from autd_analysis.threshold_words import threshold_lines
from autd_analysis.wording import (
    Labels,
    direction,
    format_interval,
    format_number,
    format_p,
    format_rate,
    p_equals,
    study_labels,
)
from autd_trials.tables import level_text


def plain_words(results: Results) -> str:
    """Return the results in plain words: rates, comparisons, false alarms and warnings.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    str
        Several lines without a final newline.
    """
    return "\n".join(
        [
            *_heading(results),
            "",
            "Detection rate (mean over participants, 95% t interval):",
            *_rate_lines(results.rates),
            "",
            *_false_alarm_lines(results),
            "",
            *_compared_lines(results),
            *_interaction_lines(results),
            *_order_lines(results.order_effects),
            *_warning_lines(results.warnings),
        ]
    )


def _heading(results: Results) -> Iterator[str]:
    trials = results.trials
    kind = "simulated " if results.simulated else ""
    yield (
        f"{trials.design.protocol}: {len(trials.participants)} {kind}participant(s), "
        f"{trials.sessions} session(s), {int(trials.table['used'].sum())} trials counted"
    )
    if results.simulated:
        yield "SIMULATED PARTICIPANTS: these are no data about people."


def _rate_lines(rates: Sequence[ConditionRate]) -> Iterator[str]:
    names = [describe_condition(rate.condition) for rate in rates]
    width = max(map(len, names), default=0)
    for name, rate in zip(names, rates, strict=True):
        yield (
            f"  {name:<{width}}  {format_rate(rate.mean)} {format_interval(rate.interval):<14}"
            f"  n = {rate.participants}  ({rate.felt}/{rate.n} trials)"
        )


def _false_alarm_lines(results: Results) -> Iterator[str]:
    if results.false_alarms is None:
        yield "False-alarm rate: undefined, the study has no catch trials."
        return
    yield "False-alarm rate (catch trials answered as felt; mean over participants, 95% t interval):"
    yield from _rate_lines(results.false_alarms)


def _compared_lines(results: Results) -> Iterator[str]:
    if results.thresholds:
        return threshold_lines(results)
    if results.comparisons:
        return _comparison_lines(results.comparisons, study_labels(results.trials.design))
    return _nothing_compared(results)


def _nothing_compared(results: Results) -> Iterator[str]:
    if results.trials.logged:
        yield "The protocol plans no comparison."
        return
    yield "Nothing was compared, as --compare did not ask for it."
    design = results.trials.design
    compared = next((factor for factor in design.factors if len(factor.levels) > 1), None)
    if compared is not None:
        first, second = map(level_text, compared.levels[:2])
        other = next((f"@{factor.name}" for factor in design.factors if factor != compared), "")
        example = shlex.quote(f"{compared.name}={first},{second}{other}")
        yield f"To compare two levels of a factor within participants: --compare {example}"
    else:
        yield "There is one condition only."


def _comparison_lines(comparisons: Sequence[ComparisonResult], labels: Labels) -> Iterator[str]:
    yield "Planned comparisons (within participants, two-sided; Holm over all of them):"
    for result in comparisons:
        yield f"  {describe_condition(result.at)}: {_difference(result, labels)}"
        yield from (f"    {line}" for line in _tests(result))


def _difference(result: ComparisonResult, labels: Labels) -> str:
    if result.mean is None:
        difference = labels.difference(result.factor, result.first, result.second)
        return f"{difference}: no participant has both rates"
    first, second = (labels.stated(result.factor, level) for level in (result.first, result.second))
    change = {
        0: f"the same mean rate with {first} as with {second}",
        1: f"felt more often with {first} than with {second}",
        -1: f"felt less often with {first} than with {second}",
    }[direction(result.mean)]
    interval = f"{format_rate(result.mean)} {format_interval(result.interval)}"
    return f"{change}, difference {interval}, n = {result.participants}"


def _tests(result: ComparisonResult) -> Iterator[str]:
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
            f"chi2(1) = {test.statistic:.2f}, {p_equals(test.p)} (Holm {format_p(result.mixed_model_holm)})"
        )
    yield from result.notes


def _interaction_lines(results: Results) -> Iterator[str]:
    for found in results.interactions:
        tests = []
        if found.f is not None and found.df is not None and found.f_p is not None:
            tests.append(f"F({found.df[0]}, {found.df[1]}) = {found.f:.2f}, {p_equals(found.f_p)}")
        if found.sign_flip_p is not None:
            tests.append(f"sign-flip {p_equals(found.sign_flip_p)}")
        yield f"  the same at all {found.over}? {'; '.join(tests) or 'not testable'} (not adjusted)"
    for trend in results.trends:
        test = f", {p_equals(trend.paired_t.p)}" if trend.paired_t else ""
        yield (
            f"  per {trend.unit} of {trend.over} the difference changes by {format_rate(trend.mean)} "
            f"{format_interval(trend.interval)}{test} (not adjusted)"
        )


def _order_lines(effects: Sequence[OrderEffect]) -> Iterator[str]:
    known = [effect for effect in effects if effect.estimate is not None]
    if not known:
        return
    yield ""
    yield "Order effects (checks, not adjusted):"
    for effect in known:
        test = f", {p_equals(effect.p)}" if effect.p is not None else ", not testable"
        yield (
            f"  {effect.name}: {effect.about} {format_rate(effect.estimate)} "
            f"{format_interval(effect.interval)}{test}"
        )


def _warning_lines(warnings: Sequence[str]) -> Iterator[str]:
    if warnings:
        yield ""
        yield "To know before using these numbers:"
        yield from (f"  - {warning}" for warning in warnings)
