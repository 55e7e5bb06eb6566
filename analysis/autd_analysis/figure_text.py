"""The text below the figure: the tests as a table, and what one must know to read the figure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.design import shown_factors
from autd_analysis.study import Results
from autd_analysis.style import INK, LEFT, LINE_IN, RIGHT, draw_notes, wrapped_notes
from autd_analysis.wording import (
    comparison_label,
    comparison_names,
    difference_label,
    factor_label,
    format_interval,
    format_p,
    format_rate,
    numbered,
)

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


def figure_text(results: Results) -> FigureText:
    """Return the text that belongs below a study's figure."""
    return FigureText(_table(results), _notes(results))


def _table(results: Results) -> tuple[tuple[str, ...], ...]:
    if not results.comparisons:
        return ()
    at = {name for result in results.comparisons for name, _ in result.at}
    named_by_level = len(at) == 1 and not numbered(results.comparisons)
    first = factor_label(at.pop()) if named_by_level else "comparison"
    headings = tuple(upper for upper, _ in _HEADINGS), (first, *(lower for _, lower in _HEADINGS[1:]))
    names = comparison_names(results.comparisons)
    return (*headings, *(_row(name, result) for name, result in zip(names, results.comparisons, strict=True)))


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


def _notes(results: Results) -> tuple[str, ...]:
    notes = [
        f"Small markers: participants (n = {len(results.trials.participants)}; lines join the same one). "
        "Large markers: mean over participants; bars: its 95 % t interval.",
        *_comparison_notes(results.comparisons),
    ]
    design = results.trials.design
    averaged = [factor.name for factor in design.factors if factor not in shown_factors(design)]
    if averaged:
        notes.append(f"Rates in A are averaged over {', '.join(averaged)}.")
    if results.false_alarms is None:
        notes.append("No catch trials: the false-alarm rate is undefined.")
    if results.warnings:
        notes.append(f"{len(results.warnings)} remark(s) on the data: see README.md beside this figure.")
    return wrapped_notes(notes)


def _comparison_notes(comparisons: Sequence[ComparisonResult]) -> Iterator[str]:
    if not comparisons:
        return
    what = (
        "; ".join(
            f"{number}: {comparison_label(result)}" for number, result in enumerate(comparisons, start=1)
        )
        if numbered(comparisons)
        else difference_label(comparisons[0])
    )
    yield (
        f"Difference of rates: {what}. Tests two-sided; Holm: adjusted over {comparisons[0].family} tests; "
        "least p: the smallest this test could give."
    )
