"""Methods and results as paragraphs for a manuscript, every number from the results."""

from collections.abc import Iterator, Mapping, Sequence

from autd_analysis.data.design import StudyFactor
from autd_analysis.data.trials import Trials
from autd_analysis.report.recorded_methods import recorded_methods
from autd_analysis.report.wording import (
    Labels,
    and_words,
    counted_words,
    study_labels,
    upper_first,
    was,
)
from autd_analysis.results import Results


def methods_text(results: Results, software: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Return headings and paragraphs for a manuscript's methods: who, what, how it was run and analysed.

    Parameters
    ----------
    results
        The study's results.
    software
        Versions of what was used, by name.
    """
    trials, labels = results.trials, study_labels(results.trials.design)
    versions = ", ".join(f"{name} {version}" for name, version in software.items())
    analysed = (
        *(view.methods for view in results.views if view.methods),
        f"Analyses were made with {versions}.",
    )
    return (
        (
            "Participants and design",
            " ".join((*_people(trials), *_design(trials.design.factors, labels), *_trials(trials))),
        ),
        *recorded_methods(trials),
        ("Statistics", " ".join(analysed)),
    )


def results_text(results: Results) -> tuple[str, ...]:
    """Return paragraphs for a manuscript's results, in the subjects' order.

    Parameters
    ----------
    results
        The study's results.
    """
    return tuple(paragraph for view in results.views for paragraph in view.paragraphs if paragraph)


def _people(trials: Trials) -> Iterator[str]:
    kind = "simulated participant" if trials.simulated else "participant"
    people = upper_first(counted_words(len(trials.participants), kind))
    yield f"{people} took part in {counted_words(trials.sessions, 'session')}."
    if trials.simulated:
        yield "The participants were simulated by a program; these are not human data."


def _design(factors: Sequence[StudyFactor], labels: Labels) -> Iterator[str]:
    varied = [_factor(factor, labels) for factor in factors if len(factor.levels) > 1]
    held = [_factor(factor, labels) for factor in factors if len(factor.levels) == 1]
    if varied:
        yield f"{upper_first(and_words(varied))} {was(len(varied))} varied within participants."
    if held:
        yield f"{upper_first(and_words(held))} {was(len(held))} the same in all trials."
    if not factors:
        yield "All stimuli were alike."


def _factor(factor: StudyFactor, labels: Labels) -> str:
    """Return a factor with its levels, as in ``modulation frequency (25, 50, 100 Hz)``."""
    *others, last = factor.levels
    levels = [*(labels.level(factor.name, level) for level in others), labels.quantity(factor.name, last)]
    return f"{labels.words(factor.name)} ({', '.join(levels)})"


def _trials(trials: Trials) -> Iterator[str]:
    table = trials.table
    used = table["used"]
    counted = int(used.sum())
    catch = int((used & (table["trial_type"] == "catch")).sum())
    per_cell = sorted(trials.stimuli_per_condition())
    each = str(per_cell[0]) if len(per_cell) == 1 else f"{per_cell[0]} to {per_cell[-1]}"
    stimuli = f"{each} of each participant in each condition"
    yield (
        f"{counted} trials were analysed: {counted - catch} with a stimulus, {stimuli}, and {catch} catch "
        "trials without one."
        if catch
        else f"{counted} trials were analysed, {stimuli}; there were no catch trials."
    )
    uncounted = int((~used).sum())
    if uncounted:
        yield f"{upper_first(counted_words(uncounted, 'attempt'))} at a trial {was(uncounted)} not counted."
