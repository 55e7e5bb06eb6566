"""The words below the figure of rates: the tests as a table, and how to read the figure."""

from collections.abc import Iterator, Sequence

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.report.sheet import Table
from autd_analysis.study import Results
from autd_analysis.wording import Labels, format_interval, format_number, format_p, format_rate

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


def comparison_table(comparisons: Sequence[ComparisonResult], labels: Labels) -> Table:
    """Return the tests as a table: two rows of headings, then one for each comparison; empty without any."""
    if not comparisons:
        return ()
    pairs = {(result.factor, result.first, result.second) for result in comparisons}
    headings = tuple(upper for upper, _ in _HEADINGS), tuple(lower for _, lower in _HEADINGS)
    return (
        *headings,
        *(
            _row(
                labels.comparison(result) if len(pairs) > 1 else labels.condition(result.at) or "overall",
                result,
            )
            for result in comparisons
        ),
    )


def rates_caption(results: Results) -> tuple[str, ...]:
    """Return what one must know to read the figure of rates."""
    return tuple(_caption(results))


def _row(name: str, result: ComparisonResult) -> tuple[str, ...]:
    sign_flip, paired_t = result.sign_flip, result.paired_t
    return (
        name,
        str(result.participants),
        f"{format_rate(result.mean)} {format_interval(result.interval)}",
        format_p(sign_flip.p if sign_flip else None),
        format_p(result.sign_flip_holm),
        format_p(sign_flip.floor if sign_flip else None),
        f"{format_number(paired_t.t)} ({paired_t.df})" if paired_t else "n/a",
        format_p(paired_t.p if paired_t else None),
        format_p(result.paired_t_holm),
        format_number(paired_t.dz if paired_t else None),
    )


def _caption(results: Results) -> Iterator[str]:
    people = len(results.trials.participants)
    catch = " Open markers: catch trials." if results.false_alarms else ""
    yield (
        f"Small markers: participants (n = {people}; thin lines join the same one). Large markers: mean over "
        f"participants; bars: its 95% t interval.{catch}"
    )
    if results.comparisons:
        yield (
            f"Differences are of rates, the first level minus the second. Tests two-sided; {_family(results)}; "
            "least p: the smallest this test could give."
        )
    if results.false_alarms is None:
        yield "No catch trials: the false-alarm rate is undefined."
    if results.warnings:
        remarks = len(results.warnings)
        yield f"{remarks} remark{'s' * (remarks != 1)} on the data: see README.md beside this figure."


def _family(results: Results) -> str:
    first = results.comparisons[0]
    tests = first.sign_flip_tests, first.paired_t_tests
    family = f"{tests[0]}" if tests[0] == tests[1] else f"{tests[0]} sign-flip and {tests[1]} t"
    return f"Holm: p adjusted over {family} tests"
