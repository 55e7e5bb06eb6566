"""Interactions and trends in words."""

from collections.abc import Iterator, Mapping

from autd_analysis.data.trials import Trials
from autd_analysis.interactions.numbers import Interactions
from autd_analysis.report.wording import (
    Labels,
    format_interval,
    format_number,
    format_rate,
    p_equals,
    study_labels,
)
from autd_analysis.subject import Shown

DEFINITIONS: Mapping[str, str] = {
    "interaction": (
        "Interaction of a planned comparison with the other factor: Hotelling's T squared of participants' "
        "differences, and exact sign flips of each participant's contrasts (squared length of their sum); "
        "trend: least-squares slope of each participant's differences over octaves of the other factor, "
        "paired t and exact sign-flip test. Not planned, not adjusted."
    ),
}
"""How each quantity was found."""


def words(found: Interactions, trials: Trials) -> Shown:
    """Return interactions and trends as lines for a terminal."""
    lines = tuple(_lines(found, study_labels(trials.design)))
    heading = "Does the difference depend on the other factor? (not planned, not adjusted)"
    return Shown(summary=(heading, *lines) if lines else ())


def _lines(all_found: Interactions, labels: Labels) -> Iterator[str]:
    for found in all_found.interactions:
        tests = []
        if found.f is not None and found.df is not None and found.f_p is not None:
            tests.append(f"F({found.df[0]}, {found.df[1]}) = {format_number(found.f)}, {p_equals(found.f_p)}")
        if found.sign_flip_p is not None:
            tests.append(f"sign-flip {p_equals(found.sign_flip_p)}")
        yield (
            f"  {labels.difference(found.contrast)}, the same at all {found.over}? "
            f"{'; '.join(tests) or 'not testable'}"
        )
    for trend in all_found.trends:
        test = f", {p_equals(trend.paired_t.p)}" if trend.paired_t else ""
        yield (
            f"  {labels.difference(trend.contrast)}, per {trend.unit} of {trend.over} it changes by "
            f"{format_rate(trend.mean)} {format_interval(trend.interval)}{test}"
        )
