"""Tests of planned comparisons as a table below a figure, whatever was compared."""

from collections.abc import Sequence

from autd_analysis.basics.paired import PairedT, SignFlip
from autd_analysis.data.contrasts import Contrast
from autd_analysis.report.sheet import Table
from autd_analysis.report.wording import Labels, format_number, format_p

Heading = tuple[str, str]
"""What stands above several columns (over the first of them), and above the column."""

TEST_HEADINGS: tuple[Heading, ...] = (
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


def tests_table(
    contrasts: Sequence[Contrast],
    labels: Labels,
    headings: Sequence[Heading],
    rows: Sequence[tuple[str, ...]],
) -> Table:
    """Return rows under headings, each with the name of its contrast: where it is, or in full if need be."""
    if not contrasts:
        return ()
    alike = len({contrast.overall for contrast in contrasts}) == 1
    names = [
        labels.condition(contrast.at) or "overall" if alike else labels.contrast(contrast)
        for contrast in contrasts
    ]
    return (
        tuple(upper for upper, _ in headings),
        tuple(lower for _, lower in headings),
        *((name, *row) for name, row in zip(names, rows, strict=True)),
    )


def test_cells(
    sign_flip: SignFlip | None,
    sign_flip_adjusted: float | None,
    paired_t: PairedT | None,
    paired_t_adjusted: float | None,
) -> tuple[str, ...]:
    """Return the cells of the two tests, under the headings from the fourth on."""
    return (
        format_p(sign_flip.p if sign_flip else None),
        format_p(sign_flip_adjusted),
        format_p(sign_flip.floor if sign_flip else None),
        f"{format_number(paired_t.t)} ({paired_t.df})" if paired_t else "n/a",
        format_p(paired_t.p if paired_t else None),
        format_p(paired_t_adjusted),
        format_number(paired_t.dz if paired_t else None),
    )
