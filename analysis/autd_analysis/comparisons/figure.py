"""The figure of comparisons: rates with every participant visible, paired differences, and the tests."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from autd_analysis.comparisons.figure_text import about_differences, about_tests, comparison_table
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.rates import RATES
from autd_analysis.rates.figure import rate_facets, rates_caption, rates_group, rates_legend
from autd_analysis.rates.numbers import Rates
from autd_analysis.report.differences import Difference, difference_groups, draw_differences
from autd_analysis.report.facets import study_facets
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.panels import Column
from autd_analysis.report.sheet import Sheet
from autd_analysis.report.style import PLAIN
from autd_analysis.report.wording import size_words
from autd_analysis.subject import Others

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LABEL = "Difference in rate"


def figures(comparisons: Sequence[ComparisonResult], results: Others) -> Iterator[ResultFigure]:
    """Yield the figure of rates and differences, which takes the place of that of rates alone."""
    if comparisons:
        rates = results[RATES]
        yield ResultFigure(
            "rates",
            "Detection rates and paired differences",
            "Panel A: the detection rate of every participant in every condition as a dot, with the mean "
            "over participants and its 95% t interval. Panel B: every participant's difference between the "
            "compared conditions, likewise. All numbers are in the tables of rates and of comparisons.",
            lambda options: draw_comparisons(comparisons, rates, results, options),
            rates_caption(rates, results, about_differences()),
        )


def draw_comparisons(
    comparisons: Sequence[ComparisonResult], rates: Rates, results: Others, options: FigureOptions
) -> "Figure":
    """Draw the rates in every condition, the paired differences, and below them the tests.

    Parameters
    ----------
    comparisons
        The planned comparisons, at least one.
    rates
        The rates that were compared.
    results
        Whose they are.
    options
        How it is made.

    Returns
    -------
    Figure
        Not bound to any window; to be drawn within `autd_analysis.report.style.figure_style`.
    """
    facets = rate_facets(results, options)
    tests = about_tests(comparisons) if options.test_table else ()
    return Sheet(
        head=f"{facets.study}: {size_words(results.trials)}",
        simulated=results.trials.simulated,
        legend=rates_legend(rates, facets),
        groups=[
            rates_group(rates, results.trials.design, facets),
            *difference_groups(_differences(comparisons), facets, _LABEL),
        ],
        table=comparison_table(comparisons, facets.labels),
        caption=rates_caption(rates, results, (*about_differences(), *tests)),
    ).draw(options)


def draw_differences_on(
    comparisons: Sequence[ComparisonResult], results: Others, axes: "Axes", options: FigureOptions
) -> None:
    """Draw the panel of paired differences on given axes."""
    if comparisons:
        draw_differences(
            axes, _differences(comparisons), study_facets(results.trials.design, options), _LABEL
        )


def _differences(comparisons: Sequence[ComparisonResult]) -> list[Difference]:
    return [(result.contrast, _column(result)) for result in comparisons]


def _column(result: ComparisonResult) -> Column:
    values = {difference.participant: float(difference.value) for difference in result.differences}
    return Column(values, result.mean, result.interval, PLAIN)
