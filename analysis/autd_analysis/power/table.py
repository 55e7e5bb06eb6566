"""The table of a power analysis."""

from collections.abc import Sequence

from autd_analysis.power.run import PowerRow
from autd_trials.tables import Column, of, tsv


def power_tsv(rows: Sequence[PowerRow], *, alpha: float, seed: int, population: str) -> str:
    """Return what became of the simulated studies as tab-separated text.

    Parameters
    ----------
    rows
        A row for each size, comparison and test.
    alpha, seed, population
        The level of significance, the seed of everything, and who was drawn: the same in every row.
    """
    asked: tuple[Column[PowerRow], ...] = (
        Column("alpha", "Level of significance.", lambda _row: alpha),
        Column("seed", "Seed of everything.", lambda _row: seed),
        Column("population", "Who was drawn.", lambda _row: population),
    )
    return tsv((*_COLUMNS, *asked), rows)


def _rounded(share: float | None) -> float | None:
    return None if share is None else round(share, 6)


_COLUMNS: tuple[Column[PowerRow], ...] = (
    Column("participants", "Participants of each study.", lambda row: row.participants),
    Column("comparison", "The planned comparison.", lambda row: row.comparison),
    Column("test", "The test.", lambda row: row.test),
    Column("studies", "Simulated studies.", lambda row: row.studies),
    Column("power", "Share that found the difference.", lambda row: _rounded(row.power)),
    Column(
        "power_interval_low",
        "Lower end of its Wilson 95 % Monte Carlo interval.",
        of(lambda row: row.power_interval, lambda ends: _rounded(ends.low)),
    ),
    Column(
        "power_interval_high",
        "Upper end of it.",
        of(lambda row: row.power_interval, lambda ends: _rounded(ends.high)),
    ),
    Column("power_holm", "The share after Holm's adjustment.", lambda row: _rounded(row.power_holm)),
    Column(
        "false_positives",
        "Share that found a difference where there is none.",
        lambda row: _rounded(row.false_positives),
    ),
    Column(
        "false_positives_interval_low",
        "Lower end of its Wilson 95 % Monte Carlo interval.",
        of(lambda row: row.false_positives_interval, lambda ends: _rounded(ends.low)),
    ),
    Column(
        "false_positives_interval_high",
        "Upper end of it.",
        of(lambda row: row.false_positives_interval, lambda ends: _rounded(ends.high)),
    ),
    Column("not_tested", "Share in which the test could not be made.", lambda row: _rounded(row.not_tested)),
    Column("interval_width", "Mean width of the 95 % interval.", lambda row: _rounded(row.interval_width)),
    Column("interval", "Which interval that is.", lambda row: row.interval),
)
