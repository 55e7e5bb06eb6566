"""Mixed models of single answers: of a planned contrast, and of all conditions together."""

from autd_analysis.data.trials import Trials
from autd_analysis.models.cell_model import Models, all_models
from autd_analysis.models.tables import EFFECTS, FIT, MEANS
from autd_analysis.models.words import DEFINITIONS
from autd_analysis.rates import RATES, STEERED
from autd_analysis.subject import NotApplicable, Others, Subject


def _compute(trials: Trials, results: Others) -> Models | NotApplicable:
    if trials.design.method is not None:
        return STEERED
    return all_models(results[RATES].participants, trials.design)


MODELS = Subject[Models](
    name="models",
    title="Mixed models of all answers",
    compute=_compute,
    needs=(RATES,),
    definitions=DEFINITIONS,
    tables=(MEANS, EFFECTS, FIT),
)
