"""d' and criterion, where there are catch trials."""

from autd_analysis.data.trials import Trials
from autd_analysis.detectability.numbers import DetectabilityResults, detectability_results
from autd_analysis.detectability.tables import BY_PARTICIPANT, OVER_PARTICIPANTS
from autd_analysis.detectability.words import DEFINITIONS, words
from autd_analysis.rates import RATES, STEERED
from autd_analysis.subject import NotApplicable, Others, Subject


def _compute(trials: Trials, results: Others) -> DetectabilityResults | NotApplicable:
    return STEERED if trials.design.method else detectability_results(results[RATES])


DETECTABILITY = Subject[DetectabilityResults](
    name="detectability",
    title="d' and criterion",
    compute=_compute,
    needs=(RATES,),
    definitions=DEFINITIONS,
    tables=(OVER_PARTICIPANTS, BY_PARTICIPANT),
    words=words,
)
