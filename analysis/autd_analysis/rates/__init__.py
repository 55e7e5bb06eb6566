"""Detection and false-alarm rates, of each participant and over participants."""

from autd_analysis.rates.figure import draw_rates_on, figures
from autd_analysis.rates.numbers import Rates, all_rates
from autd_analysis.rates.tables import FALSE_ALARMS, FALSE_ALARMS_BY_PARTICIPANT, RATES_BY_PARTICIPANT
from autd_analysis.rates.tables import RATES as RATES_TABLE
from autd_analysis.rates.words import DEFINITIONS, words
from autd_analysis.subject import NotApplicable, Subject

RATES = Subject[Rates](
    name="rates",
    title="Detection and false-alarm rates",
    compute=lambda trials, _results: all_rates(trials),
    definitions=DEFINITIONS,
    tables=(RATES_TABLE, RATES_BY_PARTICIPANT, FALSE_ALARMS, FALSE_ALARMS_BY_PARTICIPANT),
    words=words,
    figures=figures,
    plot=draw_rates_on,
)

STEERED = NotApplicable(
    "an adaptive method steered towards the same rate everywhere, so thresholds are compared"
)
"""Why nothing is found by rates where an adaptive method chose the levels."""
