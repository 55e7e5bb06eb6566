"""All results of a study as tables."""

from analysis.study import Results
from analysis.tables.comparisons import comparison_table
from analysis.tables.detectability import detectability_tables
from analysis.tables.more_comparisons import more_comparison_tables
from analysis.tables.order_effects import order_effect_table
from analysis.tables.psychometric import psychometric_tables
from analysis.tables.rates import rate_tables
from analysis.tables.table import ResultTable


def result_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return all results of a study as tables.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    tuple of ResultTable
        The same tables for every study; what is undefined is said in a row of its own.
    """
    return (
        *rate_tables(results),
        comparison_table(results),
        *more_comparison_tables(results),
        *detectability_tables(results),
        order_effect_table(results),
        *psychometric_tables(results),
    )
