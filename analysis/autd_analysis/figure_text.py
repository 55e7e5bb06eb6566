"""The words below figures of rates and of thresholds: the tests as a table, and how to read the figure."""

from collections.abc import Iterator, Sequence

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.report.sheet import Table
from autd_analysis.study import Results
from autd_analysis.threshold_comparisons import ThresholdComparison
from autd_analysis.wording import Compared, Labels, format_interval, format_number, format_p, format_rate

_HEADINGS = (
    ("", ""),
    ("", "n"),
    ("mean difference", "[95% t interval]"),
    ("exact sign-flip test", "p"),
    ("", "Holm"),
    ("", "least p"),
    ("paired t test", "t (df)"),
    ("", "p"),
    ("", "Holm"),
    ("", "dz"),
)
_SIGN_HEADINGS = (("exact sign test", "first higher"), ("", "p"), ("", "Holm"))


def comparison_table(comparisons: Sequence[ComparisonResult], labels: Labels) -> Table:
    """Return the tests of rates as a table: two rows of headings, then one for each comparison.

    It is empty without any.
    """
    rows = [
        (
            str(result.participants),
            f"{format_rate(result.mean)} {format_interval(result.interval)}",
            *_tests(result),
        )
        for result in comparisons
    ]
    return _table(comparisons, labels, _HEADINGS, rows)


def threshold_table(comparisons: Sequence[ThresholdComparison], labels: Labels) -> Table:
    """Return the tests of thresholds, likewise; differences are in dB."""
    rows = [
        (
            str(len(found.differences_db)),
            f"{format_number(found.mean_db)} {format_interval(found.interval, format_number)}",
            *_tests(found),
            f"{found.higher_first} of {found.higher_first + found.higher_second}",
            format_p(found.sign_p),
            format_p(found.sign_holm),
        )
        for found in comparisons
    ]
    return _table(comparisons, labels, (*_HEADINGS, *_SIGN_HEADINGS), rows)


def rates_caption(results: Results, *, tests: bool = True) -> tuple[str, ...]:
    """Return what one must know to read the figure of rates, and the tests below it if they are there."""
    return tuple(_caption(results, tests=tests))


def _table(
    comparisons: Sequence[Compared],
    labels: Labels,
    headings: Sequence[tuple[str, str]],
    rows: Sequence[tuple[str, ...]],
) -> Table:
    if not comparisons:
        return ()
    pairs = {(found.factor, found.first, found.second) for found in comparisons}
    names = [
        labels.comparison(found) if len(pairs) > 1 else labels.condition(found.at) or "overall"
        for found in comparisons
    ]
    return (
        tuple(upper for upper, _ in headings),
        tuple(lower for _, lower in headings),
        *((name, *row) for name, row in zip(names, rows, strict=True)),
    )


def _tests(found: ComparisonResult | ThresholdComparison) -> tuple[str, ...]:
    sign_flip, paired_t = found.sign_flip, found.paired_t
    return (
        format_p(sign_flip.p if sign_flip else None),
        format_p(found.sign_flip_holm),
        format_p(sign_flip.floor if sign_flip else None),
        f"{format_number(paired_t.t)} ({paired_t.df})" if paired_t else "n/a",
        format_p(paired_t.p if paired_t else None),
        format_p(found.paired_t_holm),
        format_number(paired_t.dz if paired_t else None),
    )


def _caption(results: Results, *, tests: bool) -> Iterator[str]:
    people = len(results.trials.participants)
    catch = " Open markers: catch trials." if results.false_alarms else ""
    yield (
        f"Small markers: participants (n = {people}; thin lines join the same one). Large markers: mean over "
        f"participants; bars: its 95% t interval.{catch}"
    )
    if results.comparisons:
        yield "Differences are of rates, the first level minus the second."
    if results.comparisons and tests:
        yield _about_tests(results.comparisons)
    if results.false_alarms is None:
        yield "No catch trials: the false-alarm rate is undefined."


def _about_tests(comparisons: Sequence[ComparisonResult]) -> str:
    first = comparisons[0]
    tests = first.sign_flip_tests, first.paired_t_tests
    if not any(tests):
        return "None of them could be tested."
    family = f"{tests[0]}" if tests[0] == tests[1] else f"{tests[0]} sign-flip and {tests[1]} t"
    adjusted = (
        f"Holm: p adjusted over {family} tests" if tests != (1, 1) else "Holm: p of one test is its own"
    )
    return f"Tests two-sided; {adjusted}; least p: the smallest this test could give."
