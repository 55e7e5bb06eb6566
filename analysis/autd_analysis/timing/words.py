"""How well trials were timed, in sentences."""

from collections.abc import Iterator, Mapping

from autd_analysis.data.trials import Trials
from autd_analysis.subject import Shown
from autd_analysis.timing.numbers import LATE_S, TimeSummary, Timing

DEFINITIONS: Mapping[str, str] = {
    "timing": (
        "Onset lateness is the actual minus the planned onset, and an onset is late over 1 ms; of complete "
        "stimulus trials in real time, as nothing can be late in virtual time."
    ),
    "response_time": (
        "From the onset to the first press, of stimuli that were felt; a participant's median and quartiles "
        "(interpolated linearly), and the mean of the participants' medians with Student's 95% t interval."
    ),
}
"""How each quantity was found."""
_DISTURBANCES = {
    "presses_before_onset": "a press before the onset",
    "presses_late": "a press after the response window",
    "underruns": "a gap in the masking noise",
}


def words(found: Timing, _trials: Trials) -> Shown:
    """Return how well trials were timed, as a paragraph for a manuscript."""
    return Shown(paragraphs=(" ".join(timing_sentences(found)),))


def timing_sentences(found: Timing) -> tuple[str, ...]:
    """Return what a reader should know of the timing: lateness, the onset's bracket, disturbances.

    Parameters
    ----------
    found
        All that is known of the times.
    """
    times = {summary.name: summary for summary in found.onsets}
    return (*_onsets(times["onset_lateness"]), *_bracket(times), *_disturbed(found))


def _onsets(lateness: TimeSummary) -> Iterator[str]:
    if lateness.values_s:
        left_out = f" ({lateness.note})" if lateness.note else ""
        yield (
            f"{lateness.late} of {lateness.trials} onsets were later than {1000 * LATE_S:g} ms; the largest "
            f"lateness was {1000 * lateness.values_s[-1]:.3g} ms{left_out}."
        )
    else:
        yield f"Onset lateness was {lateness.note}."


def _bracket(times: dict[str, TimeSummary]) -> Iterator[str]:
    silent, emitting = times["silent_before"], times["emitting_after"]
    if silent.median_s is not None and emitting.median_s is not None:
        yield (
            f"The array was read back as silent {1000 * silent.median_s:.3g} ms before the onset (median) "
            f"and as emitting {1000 * emitting.median_s:.3g} ms after it."
        )


def _disturbed(found: Timing) -> Iterator[str]:
    counted = [count for count in found.disturbances if count.total is not None]
    if counted:
        parts = (f"{_DISTURBANCES[count.name]} in {count.trials_with}" for count in counted)
        yield f"In {max(count.trials for count in counted)} trials: {', '.join(parts)}."
