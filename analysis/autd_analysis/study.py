"""The analysis of a study: the one list of subjects, and each one's outcome in its order."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from autd_analysis.comparisons import COMPARISONS
from autd_analysis.data.trials import Trials, read_trials
from autd_analysis.detectability import DETECTABILITY
from autd_analysis.interactions import INTERACTIONS
from autd_analysis.models import MODELS
from autd_analysis.order import ORDER
from autd_analysis.psychometric import PSYCHOMETRIC
from autd_analysis.psychometric.options import DEFAULT, PsychometricOptions
from autd_analysis.rates import RATES
from autd_analysis.results import Outcome, Results
from autd_analysis.sensitivity import SENSITIVITY
from autd_analysis.subject import Found, Impossible, NotApplicable, NotComputed, Subject, failure
from autd_analysis.thresholds import THRESHOLDS
from autd_analysis.timing import TIMING
from autd_trials.errors import TrialsError, UsageError

SUBJECTS: tuple[Subject[Any], ...] = (
    RATES,
    COMPARISONS,
    INTERACTIONS,
    DETECTABILITY,
    ORDER,
    MODELS,
    SENSITIVITY,
    THRESHOLDS,
    PSYCHOMETRIC,
    TIMING,
)
"""All subjects, in the order in which they are computed and shown: each after those that it needs."""

Progress = Callable[[float], None]


def analyse(
    study: Trials | Path | str,
    only: Iterable[str] | None = None,
    without: Iterable[str] | None = None,
    *,
    psychometric: PsychometricOptions = DEFAULT,
    subjects: tuple[Subject[Any], ...] = SUBJECTS,
    progress: Progress = lambda _share: None,
) -> Results:
    """Analyse a study.

    Parameters
    ----------
    study
        Trials that were read, or a study's folder.
    only
        The names of the subjects wanted, such as ``rates``; all if None.
    without
        The names of subjects that are not.
    psychometric
        The form of psychometric functions, and how their guess and lapse rates are found.
    subjects
        All that there are.
    progress
        Told the share of subjects that are done, 0 to 1.

    Returns
    -------
    Results
        The same files give the same results. A subject that cannot be computed, or in which this program
        makes an error, leaves a remark and no gap in the others.

    Raises
    ------
    UsageError
        There is no such study or subject; else as `autd_analysis.data.trials.read_trials`.
    """
    trials = study if isinstance(study, Trials) else read_trials(Path(study))
    only, without = None if only is None else list(only), list(without or ())
    wanted = _wanted(subjects, only, without)
    computed = _with_needs(subjects, wanted)
    results = Results(trials, choice=_options(only, without), options={PSYCHOMETRIC.name: psychometric})
    for place, subject in enumerate(computed, start=1):
        outcome = _outcome(subject, results, asked=subject in wanted)
        results = replace(results, outcomes=(*results.outcomes, outcome))
        progress(place / len(computed))
    return results


def _wanted(
    subjects: tuple[Subject[Any], ...], only: list[str] | None, without: list[str]
) -> list[Subject[Any]]:
    names = [subject.name for subject in subjects]
    for name in [*(only or ()), *without]:
        if name not in names:
            raise UsageError(f"there is no subject {name!r}", do=f"name some of {', '.join(names)}")
    chosen = names if only is None else only
    return [subject for subject in subjects if subject.name in chosen and subject.name not in without]


def _with_needs(subjects: tuple[Subject[Any], ...], wanted: list[Subject[Any]]) -> list[Subject[Any]]:
    """Return all that must be computed, in the list's order."""
    needed = list(wanted)
    for subject in needed:  # which grows as it is gone through
        needed.extend(need for need in subject.needs if need not in needed)
    return [subject for subject in subjects if subject in needed]


def _options(only: list[str] | None, without: list[str]) -> tuple[str, ...]:
    return (
        *(("--only", ",".join(only)) if only is not None else ()),
        *(("--without", ",".join(without)) if without else ()),
    )


def _outcome(subject: Subject[Found], results: Results, *, asked: bool) -> Outcome[Found]:
    """Compute a subject and make its tables and words."""
    found = _found(subject, results)
    if isinstance(found, NotComputed):
        return Outcome(subject, found, shown=found, asked=asked)
    try:
        tables = tuple(table.made(found, results.trials) for table in subject.tables)
        return Outcome(subject, found, tables, subject.words(found, results.trials), asked)
    except Exception as error:
        return Outcome(subject, found, shown=failure(subject.name, error), asked=asked)


def _missing_need(subject: Subject[Any], results: Results) -> NotComputed | None:
    for outcome in results.outcomes:
        if outcome.subject in subject.needs and isinstance(outcome.found, NotComputed):
            cause = outcome.found.cause
            kind = NotApplicable if isinstance(outcome.found, NotApplicable) else Impossible
            return kind(f"it needs {outcome.subject.name} ({cause})")
    return None


def _found(subject: Subject[Found], results: Results) -> Found | NotComputed:
    missing = _missing_need(subject, results)
    if missing is not None:
        return missing
    try:
        return subject.compute(results.trials, results)
    except TrialsError as error:
        return Impossible(error.what)
    except Exception as error:
        return failure(subject.name, error)
