"""How well trials were timed, in sentences."""

from collections.abc import Iterator

from autd_analysis.data.trials import Trials
from autd_analysis.timing.numbers import LATE_S, TimeSummary, disturbances, onset_times

_DISTURBANCES = {
    "presses_before_onset": "a press before the onset",
    "presses_late": "a press after the response window",
    "underruns": "a gap in the masking noise",
}


def timing_sentences(trials: Trials) -> tuple[str, ...]:
    """Return what a reader should know of the timing: lateness, the onset's bracket, disturbances.

    Parameters
    ----------
    trials
        The study's trials.
    """
    times = {summary.name: summary for summary in onset_times(trials)}
    return (*_onsets(times["onset_lateness"]), *_bracket(times), *_disturbed(trials))


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


def _disturbed(trials: Trials) -> Iterator[str]:
    counted = [count for count in disturbances(trials) if count.total is not None]
    if counted:
        parts = (f"{_DISTURBANCES[count.name]} in {count.trials_with}" for count in counted)
        yield f"In {max(count.trials for count in counted)} trials: {', '.join(parts)}."
