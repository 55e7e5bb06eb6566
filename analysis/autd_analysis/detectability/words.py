"""d' in words."""

from collections.abc import Mapping

from autd_analysis.data.trials import Trials
from autd_analysis.detectability.numbers import DetectabilityResults
from autd_analysis.subject import Shown

DEFINITIONS: Mapping[str, str] = {
    "detectability": (
        "d' = z(hits) - z(false alarms) with the log-linear correction (counts + 1/2 over trials + 1), hits "
        "of a condition against the catch trials of its kind of block; undefined without catch trials."
    ),
}
"""How each quantity was found."""
_METHODS = (
    "d' is z(hit rate) minus z(false-alarm rate) with the log-linear correction (1/2 added to counts, 1 to "
    "numbers of trials)."
)


def words(found: DetectabilityResults, _trials: Trials) -> Shown:
    """Return how d' was found, where it was."""
    return Shown(methods=_METHODS if found.participants else "")
