"""The tables of interactions and trends."""

from collections.abc import Iterator

from autd_analysis.interactions.numbers import (
    MOST_FLIPPED,
    TREND_INTERVAL,
    Interaction,
    Interactions,
    Trend,
)
from autd_analysis.report.table import COMPARED, Declared, interval_columns, joined, why_no_interval
from autd_trials.tables import Column, of

_ABOUT_OVER = "The other factor, on whose levels the difference may depend."


def _interaction_notes(found: Interaction) -> Iterator[str]:
    if found.df is None:
        yield "T squared needs more participants than levels, who differ"
    if found.sign_flip_p is None and found.participants > MOST_FLIPPED:
        yield f"the sign patterns of more than {MOST_FLIPPED} participants are too many to go through"


INTERACTIONS = Declared[Interactions, Interaction](
    "interactions",
    "Whether a difference is the same at all levels of the other factor; not planned, not adjusted.",
    rows=lambda found: found.interactions,
    columns=(
        *COMPARED,
        Column("over", _ABOUT_OVER, lambda found: found.over),
        Column(
            "participants",
            "Number of participants with the difference at every level.",
            lambda found: found.participants,
        ),
        Column(
            "hotelling_t2",
            "Hotelling's T squared of the differences' contrasts; n/a: too few participants.",
            lambda found: found.t2,
        ),
        Column("f", "The same as F.", lambda found: found.f),
        Column("f_df1", "First degrees of freedom of F.", of(lambda found: found.df, lambda df: df[0])),
        Column("f_df2", "Second degrees of freedom of F.", of(lambda found: found.df, lambda df: df[1])),
        Column("f_p", "p of F, not adjusted.", lambda found: found.f_p),
        Column(
            "sign_flip_p",
            "Exact p of flipping each participant's contrasts, not adjusted.",
            lambda found: found.sign_flip_p,
        ),
        Column(
            "sign_flip_least_p",
            "Smallest p that this test could have given.",
            lambda found: found.sign_flip_floor,
        ),
    ),
    notes=lambda found: joined(_interaction_notes(found)),
)
TRENDS = Declared[Interactions, Trend](
    "trends",
    "How a difference changes with a numeric factor; not planned, not adjusted.",
    rows=lambda found: found.trends,
    columns=(
        *COMPARED,
        Column("over", _ABOUT_OVER, lambda found: found.over),
        Column(
            "slope",
            "Mean over participants of the least-squares slope of the difference.",
            lambda found: found.mean,
        ),
        Column(
            "per",
            "What the slope is per: octave (doubling) or unit of the other factor.",
            lambda found: found.unit,
        ),
        *interval_columns(TREND_INTERVAL),
        Column(
            "participants",
            "Number of participants with the difference at every level.",
            lambda found: found.participants,
        ),
        Column(
            "t",
            "Paired t of the slopes against zero.",
            of(lambda found: found.paired_t, lambda test: test.t),
        ),
        Column("t_df", "Its degrees of freedom.", of(lambda found: found.paired_t, lambda test: test.df)),
        Column("t_p", "Its p, not adjusted.", of(lambda found: found.paired_t, lambda test: test.p)),
        Column(
            "sign_flip_p",
            "p of the exact sign-flip test of the slopes, not adjusted.",
            of(lambda found: found.sign_flip, lambda test: test.p),
        ),
    ),
    notes=lambda found: why_no_interval(found.interval, found.participants),
)
