"""All results of a study as tables."""

from autd_analysis.comparisons.more_tables import more_comparison_tables
from autd_analysis.comparisons.tables import comparison_table
from autd_analysis.detectability.tables import detectability_tables
from autd_analysis.models.tables import model_tables
from autd_analysis.order.tables import order_effect_table
from autd_analysis.psychometric.tables import psychometric_tables
from autd_analysis.rates.tables import rate_tables
from autd_analysis.report.table import ResultTable
from autd_analysis.sensitivity.tables import other_model_tables
from autd_analysis.study import Results
from autd_analysis.thresholds.tables import threshold_tables
from autd_analysis.timing.tables import timing_tables


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
