"""Whether a planned difference depends on the other factor: interaction and trend."""

from autd_analysis.comparisons import COMPARISONS
from autd_analysis.interactions.numbers import Interactions, dependence_on_other_factor
from autd_analysis.interactions.tables import INTERACTIONS as INTERACTIONS_TABLE
from autd_analysis.interactions.tables import TRENDS
from autd_analysis.interactions.words import DEFINITIONS, words
from autd_analysis.subject import Subject

INTERACTIONS = Subject[Interactions](
    name="interactions",
    title="Differences over the other factor",
    compute=lambda _trials, results: dependence_on_other_factor(results[COMPARISONS]),
    needs=(COMPARISONS,),
    definitions=DEFINITIONS,
    tables=(INTERACTIONS_TABLE, TRENDS),
    words=words,
)
