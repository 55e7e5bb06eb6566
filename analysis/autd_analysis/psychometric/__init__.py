"""Psychometric functions along factors of three or more numbers, per participant and over participants."""

from collections.abc import Sequence

from autd_analysis.psychometric.figure import draw_first_panel_on, figures
from autd_analysis.psychometric.numbers import PsychometricResults, all_psychometric_results
from autd_analysis.psychometric.tables import BY_PARTICIPANT, OVER_PARTICIPANTS
from autd_analysis.psychometric.words import DEFINITIONS
from autd_analysis.subject import Subject

PSYCHOMETRIC = Subject[Sequence[PsychometricResults]](
    name="psychometric",
    title="Psychometric functions",
    compute=lambda trials, _results: all_psychometric_results(trials),
    definitions=DEFINITIONS,
    tables=(OVER_PARTICIPANTS, BY_PARTICIPANT),
    figures=figures,
    plot=draw_first_panel_on,
)
