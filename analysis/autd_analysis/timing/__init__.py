"""Whether stimuli came when they were planned, and how fast people answered."""

from autd_analysis.subject import Subject
from autd_analysis.timing.figure import draw_medians_on, figures
from autd_analysis.timing.numbers import Timing, timing
from autd_analysis.timing.tables import BY_PARTICIPANT, OVER_PARTICIPANTS
from autd_analysis.timing.tables import TIMING as TIMING_TABLE
from autd_analysis.timing.words import DEFINITIONS, words

TIMING = Subject[Timing](
    name="timing",
    title="Timing and response times",
    compute=lambda trials, _results: timing(trials),
    definitions=DEFINITIONS,
    tables=(TIMING_TABLE, OVER_PARTICIPANTS, BY_PARTICIPANT),
    words=words,
    figures=figures,
    plot=draw_medians_on,
)
