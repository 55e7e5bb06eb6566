"""All results of a study as tables."""

from autd_analysis.study import Results
from autd_analysis.tables.comparisons import comparison_table
from autd_analysis.tables.detectability import detectability_tables
from autd_analysis.tables.models import model_tables
from autd_analysis.tables.more_comparisons import more_comparison_tables
from autd_analysis.tables.order_effects import order_effect_table
from autd_analysis.tables.other_models import other_model_tables
from autd_analysis.tables.psychometric import psychometric_tables
from autd_analysis.tables.rates import rate_tables
from autd_analysis.tables.table import ResultTable
from autd_analysis.tables.thresholds import threshold_tables
from autd_analysis.tables.timing import timing_tables


def result_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return all results of a study as tables.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    tuple of ResultTable
        The same tables for every study of a kind (constant stimuli, or levels chosen by an adaptive method);
        what is undefined is said in a row of its own.
    """
    if results.trials.design.method is not None:
        return (
            *rate_tables(results),
            *threshold_tables(results),
            *psychometric_tables(results),
            *timing_tables(results),
        )
    return (
        *rate_tables(results),
        comparison_table(results),
        *more_comparison_tables(results),
        *detectability_tables(results),
        order_effect_table(results),
        *model_tables(results),
        *other_model_tables(results),
        *psychometric_tables(results),
        *timing_tables(results),
    )
