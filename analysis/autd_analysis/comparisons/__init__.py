"""The planned comparisons of rates, within participants."""

from collections.abc import Sequence

from autd_analysis.comparisons.figure import draw_differences_on, figures
from autd_analysis.comparisons.numbers import ComparisonResult, planned_comparisons
from autd_analysis.comparisons.tables import COMPARISONS as COMPARISONS_TABLE
from autd_analysis.comparisons.tables import DIFFERENCES
from autd_analysis.comparisons.words import DEFINITIONS, words
from autd_analysis.data.trials import Trials
from autd_analysis.rates import RATES, STEERED
from autd_analysis.subject import NotApplicable, Others, Subject


def _compute(trials: Trials, results: Others) -> Sequence[ComparisonResult] | NotApplicable:
    if trials.design.method is not None:
        return STEERED
    return planned_comparisons(results[RATES].participants, trials.design)


COMPARISONS = Subject[Sequence[ComparisonResult]](
    name="comparisons",
    title="Planned comparisons",
    compute=_compute,
    needs=(RATES,),
    definitions=DEFINITIONS,
    tables=(COMPARISONS_TABLE, DIFFERENCES),
    words=words,
    figures=figures,
    plot=draw_differences_on,
)
