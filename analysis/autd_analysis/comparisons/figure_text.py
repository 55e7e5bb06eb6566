"""The words below the figure of comparisons: the tests as a table, and how to read them."""

from collections.abc import Sequence

from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.report.sheet import Table
from autd_analysis.report.tests_table import TEST_HEADINGS, test_cells, tests_table
from autd_analysis.report.wording import Labels, format_interval, format_rate


def comparison_table(comparisons: Sequence[ComparisonResult], labels: Labels) -> Table:
    """Return the tests as a table: two rows of headings, then one for each comparison; empty without any."""
    rows = [
        (
            str(result.participants),
            f"{format_rate(result.mean)} {format_interval(result.interval)}",
            *test_cells(result.sign_flip, result.sign_flip_holm, result.paired_t, result.paired_t_holm),
        )
        for result in comparisons
    ]
    return tests_table([result.contrast for result in comparisons], labels, TEST_HEADINGS, rows)


def about_differences() -> tuple[str, ...]:
    """Return what one must know to read the panels of differences."""
    return ("Differences are of rates, the first level minus the second.",)


def about_tests(comparisons: Sequence[ComparisonResult]) -> tuple[str, ...]:
    """Return what one must know to read the table."""
    if not any(result.sign_flip or result.paired_t for result in comparisons):
        return ("None of them could be tested.",)
    family = comparisons[0].family
    adjusted = f"Holm: p adjusted over {family} tests" if family > 1 else "Holm: p of one test is its own"
    return (f"Tests two-sided; {adjusted}; least p: the smallest this test could give.",)
