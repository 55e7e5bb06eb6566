"""Psychometric functions along factors of three or more numbers, per participant and over participants."""

from collections.abc import Sequence

from autd_analysis.psychometric.figure import draw_first_panel_on, figures
from autd_analysis.psychometric.misfit import misfits
from autd_analysis.psychometric.numbers import PsychometricResults, all_psychometric_results
from autd_analysis.psychometric.options import DEFAULT
from autd_analysis.psychometric.tables import BY_PARTICIPANT, OVER_PARTICIPANTS
from autd_analysis.psychometric.words import DEFINITIONS
from autd_analysis.subject import Shown, Subject

PSYCHOMETRIC = Subject[Sequence[PsychometricResults]](
    name="psychometric",
    title="Psychometric functions",
    compute=lambda trials, results: all_psychometric_results(
        trials, results.options.get("psychometric", DEFAULT)
    ),
    definitions=DEFINITIONS,
    tables=(OVER_PARTICIPANTS, BY_PARTICIPANT),
    words=lambda found, _trials: Shown(remarks=tuple(misfits(found))),
    figures=figures,
    plot=draw_first_panel_on,
)
