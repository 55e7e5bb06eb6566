"""The tables around the planned comparisons: differences, adjustments, interactions, pooled tests."""

from collections.abc import Iterator, Sequence

from analysis.adjustment import METHODS as ADJUSTMENTS
from analysis.adjustment import adjusted
from analysis.comparisons import ComparisonResult
from analysis.design import format_level
from analysis.interaction import MOST_FLIPPED, TREND_INTERVAL, Interaction, Trend
from analysis.intervals import newcombe_interval
from analysis.pooled import PooledTests
from analysis.rates import ParticipantRate
from analysis.study import Results
from analysis.tables.table import (
    ENDS,
    PARTICIPANT,
    ResultTable,
    Row,
    Value,
    end_cells,
    interval_cells,
    result_table,
    why_no_interval,
)
from analysis.wording import levels_text
from autd_trials.records.table import Column

NEWCOMBE_INTERVAL = "95 % Newcombe interval, trials taken as independent"

_COMPARED = (
    Column("factor", "The factor compared."),
    Column("first", "The level subtracted from."),
    Column("second", "The level subtracted."),
)
_AT = Column("at", "The level of the other factor at which they were compared; n/a if over all trials.")
_OVER = Column("over", "The other factor, on whose levels the difference may depend.")
_DIFFERENCE = Column("difference", "Rate at first minus rate at second.")
_ADJUSTED = (
    *_COMPARED,
    _AT,
    Column("test", "Which test."),
    Column("tests", "Number of tests of this kind that were made."),
    Column("p", "p as it is, two-sided."),
    *(Column(f"p_{name}", f"Adjusted: {about}.") for name, about in ADJUSTMENTS.items()),
)
_INTERACTION = (
    *_COMPARED,
    _OVER,
    Column("participants", "Number of participants with the difference at every level."),
    Column("hotelling_t2", "Hotelling's T squared of the differences' contrasts; n/a: too few participants."),
    Column("f", "The same as F."),
    Column("f_df1", "First degrees of freedom of F."),
    Column("f_df2", "Second degrees of freedom of F."),
    Column("f_p", "p of F, not adjusted."),
    Column("sign_flip_p", "Exact p of flipping each participant's contrasts, not adjusted."),
    Column("sign_flip_least_p", "Smallest p that this test could have given."),
)
_TREND = (
    *_COMPARED,
    _OVER,
    Column("slope", "Mean over participants of the least-squares slope of the difference."),
    Column("per", "What the slope is per: octave (doubling) or unit of the other factor."),
    *ENDS,
    Column("participants", "Number of participants with the difference at every level."),
    Column("t", "Paired t of the slopes against zero."),
    Column("t_df", "Its degrees of freedom."),
    Column("t_p", "Its p, not adjusted."),
    Column("sign_flip_p", "p of the exact sign-flip test of the slopes, not adjusted."),
)
_POOLED = (
    *_COMPARED,
    _AT,
    Column("felt_first", "Felt at first, all participants together."),
    Column("trials_first", "Trials at first."),
    Column("felt_second", "Felt at second."),
    Column("trials_second", "Trials at second."),
    Column("chi_squared_p", "Pearson's chi-squared test of all answers, no continuity correction."),
    Column("fisher_p", "Fisher's exact test of all answers."),
    Column("cmh_p", "Cochran-Mantel-Haenszel test over participants, no continuity correction."),
    Column("cmh_exact_p", "The same, exact and conditional."),
    Column("odds_ratio", "Common odds ratio of Mantel and Haenszel; n/a if 0 or infinite."),
    Column("odds_ratio_low", "Lower end of its 95 % interval (Robins, Breslow and Greenland)."),
    Column("odds_ratio_high", "Upper end of its 95 % interval."),
    Column("mcnemar_p", "McNemar's exact test; n/a unless everybody has one answer at each level."),
    Column("mcnemar_mid_p", "The same, mid-p."),
)


def more_comparison_tables(results: Results) -> tuple[ResultTable, ...]:
    """Return these tables; the pooled tests only if they were asked for."""
    simulated = results.simulated
    tables = (
        result_table(
            "differences_by_participant",
            "Each participant's difference of rates in the planned comparisons.",
            (PARTICIPANT, *_COMPARED, _AT, _DIFFERENCE, *ENDS),
            _difference_rows(results.participant_rates, results.comparisons),
            simulated=simulated,
        ),
        result_table(
            "adjusted_p",
            "The p of the planned comparisons, adjusted for their number in several ways. The planned one is "
            "Holm's; choosing among them by their result is not.",
            _ADJUSTED,
            _adjusted_rows(results.comparisons),
            simulated=simulated,
        ),
        result_table(
            "interactions",
            "Whether a difference is the same at all levels of the other factor; not planned, not adjusted.",
            _INTERACTION,
            map(_interaction_row, results.interactions),
            simulated=simulated,
        ),
        result_table(
            "trends",
            "How a difference changes with a numeric factor; not planned, not adjusted.",
            _TREND,
            map(_trend_row, results.trends),
            simulated=simulated,
        ),
    )
    if results.pooled is None:
        return tables
    pooled = result_table(
        "pooled",
        "Tests that take people for alike in how much the condition matters to them. Where they are not, "
        "these p are too small.",
        _POOLED,
        map(_pooled_row, results.pooled),
        simulated=simulated,
    )
    return (*tables, pooled)


def _difference_rows(
    rates: Sequence[ParticipantRate], comparisons: Sequence[ComparisonResult]
) -> Iterator[Row]:
    counts = {(rate.participant, frozenset(rate.condition)): (rate.felt, rate.n) for rate in rates}
    for result in comparisons:
        for participant, difference in result.differences:
            cells = [
                counts.get((participant, frozenset({(result.factor, level), *result.at})))
                for level in (result.first, result.second)
            ]
            single = cells[0] is not None and cells[1] is not None
            interval = newcombe_interval(cells[0], cells[1]) if cells[0] and cells[1] else None
            yield {
                "participant": participant,
                **_compared_cells(result),
                "at": levels_text(result.at),
                "difference": float(difference),
                **interval_cells(interval, NEWCOMBE_INTERVAL),
                "notes": None if single else "mean over conditions, so no interval",
            }


def _adjusted_rows(comparisons: Sequence[ComparisonResult]) -> Iterator[Row]:
    tests: dict[str, list[float | None]] = {
        "sign_flip": [result.sign_flip.p if result.sign_flip else None for result in comparisons],
        "paired_t": [result.paired_t.p if result.paired_t else None for result in comparisons],
        "mixed_model": [result.mixed_model.p if result.mixed_model else None for result in comparisons],
    }
    for test, p_values in tests.items():
        by_method = {method: adjusted(p_values, method) for method in ADJUSTMENTS}
        for place, (result, p) in enumerate(zip(comparisons, p_values, strict=True)):
            yield {
                **_compared_cells(result),
                "at": levels_text(result.at),
                "test": test,
                "tests": len(p_values) - p_values.count(None),
                "p": p,
                **{f"p_{method}": values[place] for method, values in by_method.items()},
                "notes": "not testable, so not counted" if p is None else None,
            }


def _interaction_row(found: Interaction) -> Row:
    return {
        **_compared_cells(found),
        "over": found.over,
        "participants": found.participants,
        "hotelling_t2": found.t2,
        "f": found.f,
        "f_df1": found.df[0] if found.df else None,
        "f_df2": found.df[1] if found.df else None,
        "f_p": found.f_p,
        "sign_flip_p": found.sign_flip_p,
        "sign_flip_least_p": found.sign_flip_floor,
        "notes": "; ".join(_interaction_notes(found)) or None,
    }


def _interaction_notes(found: Interaction) -> Iterator[str]:
    if found.df is None:
        yield "T squared needs more participants than levels, who differ"
    if found.sign_flip_p is None and found.participants > MOST_FLIPPED:
        yield f"the sign patterns of more than {MOST_FLIPPED} participants are too many to go through"


def _trend_row(found: Trend) -> Row:
    return {
        **_compared_cells(found),
        "over": found.over,
        "slope": found.mean,
        "per": found.unit,
        **interval_cells(found.interval, TREND_INTERVAL),
        "participants": found.participants,
        "t": found.paired_t.t if found.paired_t else None,
        "t_df": found.paired_t.df if found.paired_t else None,
        "t_p": found.paired_t.p if found.paired_t else None,
        "sign_flip_p": found.sign_flip.p if found.sign_flip else None,
        "notes": None if found.interval else why_no_interval(found.participants),
    }


def _pooled_row(found: PooledTests) -> Row:
    return {
        **_compared_cells(found),
        "at": levels_text(found.at),
        "felt_first": found.felt_first,
        "trials_first": found.n_first,
        "felt_second": found.felt_second,
        "trials_second": found.n_second,
        "chi_squared_p": found.chi_squared_p,
        "fisher_p": found.fisher_p,
        "cmh_p": found.cmh_p,
        "cmh_exact_p": found.cmh_exact_p,
        "odds_ratio": found.odds_ratio,
        **end_cells("odds_ratio", found.odds_ratio_interval),
        "mcnemar_p": found.mcnemar_p,
        "mcnemar_mid_p": found.mcnemar_mid_p,
    }


def _compared_cells(found: ComparisonResult | Interaction | Trend | PooledTests) -> dict[str, Value]:
    return {
        "factor": found.factor,
        "first": format_level(found.first),
        "second": format_level(found.second),
    }
