"""The tables around the planned comparisons: differences, adjustments, interactions, pooled tests."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Protocol as Interface

from autd_analysis.adjustment import METHODS as ADJUSTMENTS
from autd_analysis.adjustment import Method, adjusted
from autd_analysis.comparisons import ComparisonResult
from autd_analysis.design import Condition
from autd_analysis.interaction import MOST_FLIPPED, TREND_INTERVAL, Interaction, Trend
from autd_analysis.intervals import Interval, newcombe_interval
from autd_analysis.pooled import PooledTests
from autd_analysis.rates import ParticipantRate
from autd_analysis.study import Results
from autd_analysis.tables.table import (
    COMPARED,
    PARTICIPANT,
    Declared,
    ResultTable,
    interval_columns,
    joined,
    why_no_interval,
)
from autd_analysis.wording import levels_text
from autd_trials.protocol.schema import Level
from autd_trials.tables import Column, of

NEWCOMBE_INTERVAL = "95 % Newcombe interval, trials taken as independent"


class _At(Interface):
    @property
    def at(self) -> Condition: ...


class _Over(Interface):
    @property
    def over(self) -> str: ...


@dataclass(frozen=True)
class _OfComparison:
    """A row about a planned comparison."""

    result: ComparisonResult

    @property
    def factor(self) -> str:
        return self.result.factor

    @property
    def first(self) -> Level:
        return self.result.first

    @property
    def second(self) -> Level:
        return self.result.second

    @property
    def at(self) -> Condition:
        return self.result.at


@dataclass(frozen=True)
class _Difference(_OfComparison):
    """A participant's difference; counts (felt, trials) are None where several conditions are compared."""

    participant: str
    difference: Fraction
    counts: tuple[tuple[int, int] | None, tuple[int, int] | None]

    @property
    def interval(self) -> Interval | None:
        first, second = self.counts
        return newcombe_interval(first, second) if first and second else None


@dataclass(frozen=True)
class _Adjusted(_OfComparison):
    test: str
    tests: int
    p: float | None
    by_method: Mapping[Method, float | None] = field(hash=False)


def more_comparison_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return these tables; the pooled tests only if they were asked for."""
    tables = (
        DIFFERENCES.made(results, _differences(results.participant_rates, results.comparisons)),
        ADJUSTED_P.made(results, _adjusted(results.comparisons)),
        INTERACTIONS.made(results, results.interactions),
        TRENDS.made(results, results.trends),
    )
    return tables if results.pooled is None else (*tables, POOLED.made(results, results.pooled))


def _differences(
    rates: Sequence[ParticipantRate], comparisons: Sequence[ComparisonResult]
) -> Iterator[_Difference]:
    counts = {(rate.participant, frozenset(rate.condition)): (rate.felt, rate.n) for rate in rates}
    for result in comparisons:
        for participant, difference in result.differences:
            first, second = (
                counts.get((participant, frozenset({(result.factor, level), *result.at})))
                for level in (result.first, result.second)
            )
            yield _Difference(result, participant, difference, (first, second))


def _adjusted(comparisons: Sequence[ComparisonResult]) -> Iterator[_Adjusted]:
    tests: dict[str, list[float | None]] = {
        "sign_flip": [result.sign_flip.p if result.sign_flip else None for result in comparisons],
        "paired_t": [result.paired_t.p if result.paired_t else None for result in comparisons],
        "mixed_model": [result.mixed_model.p if result.mixed_model else None for result in comparisons],
    }
    for test, p_values in tests.items():
        by_method = {method: adjusted(p_values, method) for method in ADJUSTMENTS}
        for place, (result, p) in enumerate(zip(comparisons, p_values, strict=True)):
            its = {method: values[place] for method, values in by_method.items()}
            yield _Adjusted(result, test, result.family, p, its)


def _interaction_notes(found: Interaction) -> Iterator[str]:
    if found.df is None:
        yield "T squared needs more participants than levels, who differ"
    if found.sign_flip_p is None and found.participants > MOST_FLIPPED:
        yield f"the sign patterns of more than {MOST_FLIPPED} participants are too many to go through"


def _by_method(method: Method) -> Callable[[_Adjusted], float | None]:
    return lambda row: row.by_method[method]


_AT: Column[_At] = Column(
    "at",
    "The level of the other factor at which they were compared; n/a if over all trials.",
    lambda row: levels_text(row.at),
)
_OVER: Column[_Over] = Column(
    "over", "The other factor, on whose levels the difference may depend.", lambda row: row.over
)
DIFFERENCES = Declared[_Difference](
    "differences_by_participant",
    "Each participant's difference of rates in the planned comparisons.",
    (
        PARTICIPANT,
        *COMPARED,
        _AT,
        Column("difference", "Rate at first minus rate at second.", lambda row: float(row.difference)),
        *interval_columns(NEWCOMBE_INTERVAL),
    ),
    notes=lambda row: "mean over conditions, so no interval" if None in row.counts else None,
)
ADJUSTED_P = Declared[_Adjusted](
    "adjusted_p",
    "The p of the planned comparisons, adjusted for their number in several ways. The planned one is "
    "Holm's; choosing among them by their result is not.",
    (
        *COMPARED,
        _AT,
        Column("test", "Which test.", lambda row: row.test),
        Column(
            "tests",
            "Number of tests of this kind: all that were planned, made or not.",
            lambda row: row.tests,
        ),
        Column("p", "p as it is, two-sided.", lambda row: row.p),
        *(
            Column(f"p_{method}", f"Adjusted: {about}.", _by_method(method))
            for method, about in ADJUSTMENTS.items()
        ),
    ),
    notes=lambda row: "not testable, but counted" if row.p is None else None,
)
INTERACTIONS = Declared[Interaction](
    "interactions",
    "Whether a difference is the same at all levels of the other factor; not planned, not adjusted.",
    (
        *COMPARED,
        _OVER,
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
TRENDS = Declared[Trend](
    "trends",
    "How a difference changes with a numeric factor; not planned, not adjusted.",
    (
        *COMPARED,
        _OVER,
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
POOLED = Declared[PooledTests](
    "pooled",
    "Tests that take people for alike in how much the condition matters to them. Where they are not, "
    "these p are too small.",
    (
        *COMPARED,
        _AT,
        Column("felt_first", "Felt at first, all participants together.", lambda found: found.felt_first),
        Column("trials_first", "Trials at first.", lambda found: found.n_first),
        Column("felt_second", "Felt at second.", lambda found: found.felt_second),
        Column("trials_second", "Trials at second.", lambda found: found.n_second),
        Column(
            "chi_squared_p",
            "Pearson's chi-squared test of all answers, no continuity correction.",
            lambda found: found.chi_squared_p,
        ),
        Column("fisher_p", "Fisher's exact test of all answers.", lambda found: found.fisher_p),
        Column(
            "cmh_p",
            "Cochran-Mantel-Haenszel test over participants, no continuity correction.",
            lambda found: found.cmh_p,
        ),
        Column("cmh_exact_p", "The same, exact and conditional.", lambda found: found.cmh_exact_p),
        Column(
            "odds_ratio",
            "Common odds ratio of Mantel and Haenszel; n/a if 0 or infinite.",
            lambda found: found.odds_ratio,
        ),
        Column(
            "odds_ratio_low",
            "Lower end of its 95 % interval (Robins, Breslow and Greenland).",
            of(lambda found: found.odds_ratio_interval, lambda ends: ends.low),
        ),
        Column(
            "odds_ratio_high",
            "Upper end of its 95 % interval.",
            of(lambda found: found.odds_ratio_interval, lambda ends: ends.high),
        ),
        Column(
            "mcnemar_p",
            "McNemar's exact test; n/a unless everybody has one answer at each level.",
            lambda found: found.mcnemar_p,
        ),
        Column("mcnemar_mid_p", "The same, mid-p.", lambda found: found.mcnemar_mid_p),
    ),
)
