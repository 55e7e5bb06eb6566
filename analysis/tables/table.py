"""A table of results, and what the tables have in common."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from analysis.design import StudyFactor
from analysis.intervals import Interval
from autd_trials.errors import UsageError
from autd_trials.records.table import Column

Value = str | float | bool | None
Row = Mapping[str, Value]

PARTICIPANT = Column("participant", "The participant's label.")
SIMULATED = Column(
    "simulated", "Whether participants were simulated: if yes, these are no data about people."
)
NOTES = Column("notes", "What could not be computed, and why.")
ENDS = (
    Column("interval_low", "Lower end of the interval; n/a where none can be given."),
    Column("interval_high", "Upper end of the interval; n/a where none can be given."),
    Column("interval", "Kind of the interval."),
)
NO_CATCH_TRIALS: Row = {"trials": 0, "notes": "undefined: the study has no catch trials"}

_SIGNIFICANT_DIGITS = 10
_ITERATED_DIGITS = 5


@dataclass(frozen=True)
class ResultTable:
    """A table of results.

    Attributes
    ----------
    name
        The file's name without its ending.
    about
        What the table holds.
    columns
        The columns in order, each described; `simulated` and `notes` are in every table.
    rows
        Cells by column; None is missing or undefined.
    """

    name: str
    about: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]


def result_table(
    name: str,
    about: str,
    columns: Sequence[Column],
    rows: Iterable[Row],
    *,
    simulated: bool,
    or_else: Row | None = None,
) -> ResultTable:
    """Return a table with its numbers rounded; where there are no rows, with `or_else` as its only one."""
    names = [column.name for column in (*columns, NOTES, SIMULATED)]
    twice = sorted({each for each in names if names.count(each) > 1})
    if twice:
        raise UsageError(
            f"a factor is called {', '.join(twice)}, as is a column of the results",
            do="call the factor otherwise: in --columns, or in the protocol before the study",
        )
    made = list(rows) or ([or_else] if or_else else [])
    rounded = ({key: _rounded(value) for key, value in row.items()} for row in made)
    return ResultTable(
        name, about, (*columns, NOTES, SIMULATED), tuple({**row, "simulated": simulated} for row in rounded)
    )


def factor_columns(factors: Sequence[StudyFactor]) -> tuple[Column, ...]:
    """Return the columns of factors."""
    return tuple(
        Column(factor.name, "Level of this factor; n/a: over all its levels together.") for factor in factors
    )


def end_cells(name: str, interval: Interval | None) -> dict[str, Value]:
    """Return the cells `name_low` and `name_high`."""
    return {
        f"{name}_low": interval.low if interval else None,
        f"{name}_high": interval.high if interval else None,
    }


def interval_cells(interval: Interval | None, kind: str) -> dict[str, Value]:
    """Return the cells of a table's main interval."""
    return {**end_cells("interval", interval), "interval": kind}


def iterated(value: float | None) -> float | None:
    """Round what an iteration or a quadrature gave: machines agree in fewer digits there."""
    return None if value is None else float(f"{value:.{_ITERATED_DIGITS}g}")


def iterated_interval(interval: Interval | None) -> Interval | None:
    """Round both ends of an interval that an iteration gave."""
    if interval is None:
        return None
    return Interval(*(float(f"{end:.{_ITERATED_DIGITS}g}") for end in (interval.low, interval.high)))


def why_no_interval(participants: int) -> str:
    """Return why there is no interval over participants."""
    if participants > 1:
        return "no interval: all participants have the same value"
    return f"no interval over {participants} participant(s)"


def _rounded(value: Value) -> Value:
    # The last digits of a float may differ between machines; the tables shall not.
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if isinstance(value, float) else value
