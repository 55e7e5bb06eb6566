"""Thresholds, where an adaptive method chose the levels, and the planned comparisons of them."""

from autd_analysis.data.trials import Trials
from autd_analysis.subject import NotApplicable, Others, Subject
from autd_analysis.thresholds.comparisons import Thresholds, all_thresholds
from autd_analysis.thresholds.figure import draw_thresholds_on, figures
from autd_analysis.thresholds.tables import BY_PARTICIPANT, COMPARISONS, OVER_PARTICIPANTS
from autd_analysis.thresholds.words import DEFINITIONS, words


def _compute(trials: Trials, _results: Others) -> Thresholds | NotApplicable:
    method = trials.design.method
    return all_thresholds(trials, method) if method else NotApplicable("no adaptive method chose the levels")


THRESHOLDS = Subject[Thresholds](
    name="thresholds",
    title="Thresholds",
    compute=_compute,
    definitions=DEFINITIONS,
    tables=(OVER_PARTICIPANTS, BY_PARTICIPANT, COMPARISONS),
    words=words,
    figures=figures,
    plot=draw_thresholds_on,
)
