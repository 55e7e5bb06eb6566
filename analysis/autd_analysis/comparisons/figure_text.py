"""The text below the figure: the tests as a table, and what one must know to read the figure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.rates.figure import rate_notes
from autd_analysis.rates.numbers import Rates
from autd_analysis.report.style import INK, LEFT, LINE_IN, RIGHT, draw_notes, wrapped_notes
from autd_analysis.report.wording import (
    contrast_label,
    contrast_names,
    difference_label,
    factor_label,
    format_interval,
    format_p,
    format_rate,
    numbered,
)
from autd_analysis.subject import Others

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEADINGS = (
    ("", ""),
    ("", "n"),
    ("mean difference", "[95 % t interval]"),
    ("exact sign-flip test", "p"),
    ("", "Holm"),
    ("", "least p"),
    ("paired t test", "t (df)"),
    ("", "p"),
    ("", "Holm"),
    ("", "dz"),
)
_COLUMNS = (0.012, 0.225, 0.27, 0.475, 0.55, 0.625, 0.72, 0.81, 0.88, 0.945)


@dataclass(frozen=True)
class FigureText:
    """A table (heading lines, then a row per comparison; may be empty) and lines of notes."""

    table: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]

    @property
    def lines(self) -> float:
        """Height in lines, gaps counted."""
        return (len(self.table) + 0.9 if self.table else 0) + len(self.notes) + 0.6

    def draw(self, figure: "Figure", top_in: float) -> None:
        """Write it into a figure, from `top_in` inches above the figure's lower edge downwards."""
        line = LINE_IN / figure.get_figheight()
        y = top_in / figure.get_figheight() - 0.9 * line
        if self.table:
            self._rule(figure, y + 0.7 * line)
            for number, row in enumerate(self.table):
                for x, cell in zip(_COLUMNS, row, strict=True):
                    figure.text(x, y, cell, fontsize=7.5, va="center")
                if number == 1:
                    self._rule(figure, y - 0.5 * line)
                y -= line * (1.1 if number == 1 else 1)
            self._rule(figure, y + 0.4 * line)
            y -= 0.5 * line
        draw_notes(figure, self.notes, y * figure.get_figheight())

    @staticmethod
    def _rule(figure: "Figure", y: float) -> None:
        from matplotlib.lines import Line2D

        figure.add_artist(Line2D([LEFT, RIGHT], [y, y], color=INK, linewidth=0.6))


def figure_text(comparisons: Sequence[ComparisonResult], rates: Rates, results: Others) -> FigureText:
    """Return the text that belongs below a study's figure."""
    notes = rate_notes(rates, results, list(_comparison_notes(comparisons)))
    return FigureText(_table(comparisons), wrapped_notes(notes))


def _table(comparisons: Sequence[ComparisonResult]) -> tuple[tuple[str, ...], ...]:
    contrasts = [result.contrast for result in comparisons]
    over = {contrast.over for contrast in contrasts if contrast.over}
    named_by_level = len(over) == 1 and not numbered(contrasts)
    first = factor_label(over.pop()) if named_by_level else "comparison"
    headings = tuple(upper for upper, _ in _HEADINGS), (first, *(lower for _, lower in _HEADINGS[1:]))
    names = contrast_names(contrasts)
    return (*headings, *(_row(name, result) for name, result in zip(names, comparisons, strict=True)))


def _row(name: str, result: ComparisonResult) -> tuple[str, ...]:
    sign_flip, paired_t = result.sign_flip, result.paired_t
    return (
        name,
        str(result.participants),
        f"{format_rate(result.mean)} {format_interval(result.interval)}",
        format_p(sign_flip.p if sign_flip else None),
        format_p(result.sign_flip_holm),
        format_p(sign_flip.floor if sign_flip else None),
        f"{format_rate(paired_t.t)} ({paired_t.df})" if paired_t else "n/a",
        format_p(paired_t.p if paired_t else None),
        format_p(result.paired_t_holm),
        format_rate(paired_t.dz if paired_t else None),
    )


def _comparison_notes(comparisons: Sequence[ComparisonResult]) -> Iterator[str]:
    contrasts = [result.contrast for result in comparisons]
    what = (
        "; ".join(
            f"{number}: {contrast_label(contrast)}" for number, contrast in enumerate(contrasts, start=1)
        )
        if numbered(contrasts)
        else difference_label(contrasts[0])
    )
    tests = comparisons[0].sign_flip_tests, comparisons[0].paired_t_tests
    family = f"{tests[0]}" if tests[0] == tests[1] else f"{tests[0]} sign-flip and {tests[1]} t"
    yield (
        f"Difference of rates: {what}. Tests two-sided; Holm: adjusted over {family} tests; "
        "least p: the smallest this test could give."
    )
