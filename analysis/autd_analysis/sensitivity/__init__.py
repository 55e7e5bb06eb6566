"""The planned comparisons by other models, tests and adjustments, to see whether the choice matters."""

from autd_analysis.comparisons import COMPARISONS
from autd_analysis.rates import RATES
from autd_analysis.sensitivity.numbers import Sensitivity, sensitivity
from autd_analysis.sensitivity.tables import ADJUSTED_P, FIRTH_LOGITS, OTHER_MODELS, POOLED
from autd_analysis.sensitivity.words import DEFINITIONS
from autd_analysis.subject import Subject

SENSITIVITY = Subject[Sensitivity](
    name="sensitivity",
    title="Other models, tests and adjustments",
    compute=lambda trials, results: sensitivity(results[RATES], results[COMPARISONS], trials.design),
    needs=(RATES, COMPARISONS),
    definitions=DEFINITIONS,
    tables=(ADJUSTED_P, OTHER_MODELS, POOLED, FIRTH_LOGITS),
)
