"""A table of results: declared once, and made from results; and what the declarations have in common."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Generic, TypeVar
from typing import Protocol as Interface

from autd_analysis.basics.intervals import Interval
from autd_analysis.data.design import Condition, StudyFactor
from autd_analysis.study import Results
from autd_trials.protocol.schema import Level
from autd_trials.tables import Column, Value, level_text, of, require_reserved

Row = Mapping[str, Value]
Of = TypeVar("Of")

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
        Each row's value in every column; None is missing or undefined.
    """

    name: str
    about: str
    columns: tuple[Column[Row], ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Declared(Generic[Of]):
    """A table as it is declared: what its columns mean, and how they are got from what a row is about.

    Attributes
    ----------
    name, about
        As in `ResultTable`.
    columns
        The columns behind those of the factors, but for `notes` and `simulated`.
    notes
        Returns what could not be computed in a row, and why.
    leading
        The columns before those of the factors.
    condition
        Returns a row's level of each factor; None in a table without columns of factors.
    undefined
        What the only row says if there are none.
    """

    name: str
    about: str
    columns: tuple[Column[Of], ...]
    notes: Callable[[Of], str | None] = lambda _row: None
    leading: tuple[Column[Of], ...] = ()
    condition: Callable[[Of], Condition] | None = None
    undefined: str | None = None

    def __post_init__(self) -> None:
        names = [column.name for column in self.fixed_columns(simulated=False)]
        if len(set(names)) < len(names):
            raise ValueError(f"{self.name} has columns of the same name: {names}")
        if self.condition is not None:
            require_reserved(self.fixed_columns(simulated=False))

    def fixed_columns(self, *, simulated: bool) -> tuple[Column[Of], ...]:
        """Return all columns but those of the factors."""
        return (*self.leading, *self.columns, *self._last(simulated=simulated))

    def made(
        self, results: Results, rows: Iterable[Of], factors: Sequence[StudyFactor] | None = None
    ) -> ResultTable:
        """Return the table with its numbers rounded.

        Parameters
        ----------
        results
            Whose factors, and whether they are simulated.
        rows
            What the rows are about.
        factors
            The factors that have columns; all if None.
        """
        shown = results.trials.design.factors if factors is None else factors
        levels = [_factor_column(factor.name, self.condition) for factor in shown] if self.condition else []
        columns = (*self.leading, *levels, *self.columns, *self._last(simulated=results.simulated))
        exact = {column.name for column in levels}
        made = [
            {
                column.name: value if column.name in exact else _rounded(value)
                for column in columns
                for value in [column.get(row)]
            }
            for row in rows
        ]
        if not made and self.undefined is not None:
            made = [
                dict.fromkeys((column.name for column in columns), None)
                | {"notes": self.undefined, "simulated": results.simulated}
            ]
        of_rows = tuple(
            Column[Row](each.name, each.description, itemgetter(each.name), each.units, each.levels)
            for each in columns
        )
        return ResultTable(self.name, self.about, of_rows, tuple(made))

    def _last(self, *, simulated: bool) -> tuple[Column[Of], ...]:
        return (
            Column("notes", "What could not be computed, and why.", self.notes),
            Column(
                "simulated",
                "Whether participants were simulated: if yes, these are no data about people.",
                lambda _row: simulated,
            ),
        )


class _OfParticipant(Interface):
    @property
    def participant(self) -> str: ...


class _WithInterval(Interface):
    @property
    def interval(self) -> Interval | None: ...


class Compares(Interface):
    """Something about two levels of a factor."""

    @property
    def factor(self) -> str:
        """The factor."""

    @property
    def first(self) -> Level:
        """The level subtracted from."""

    @property
    def second(self) -> Level:
        """The level subtracted."""


PARTICIPANT: Column[_OfParticipant] = Column(
    "participant", "The participant's label.", lambda row: row.participant
)
COMPARED: tuple[Column[Compares], ...] = (
    Column("factor", "The factor compared.", lambda row: row.factor),
    Column("first", "The level subtracted from.", lambda row: level_text(row.first)),
    Column("second", "The level subtracted.", lambda row: level_text(row.second)),
)
LOW = "Lower end of the interval; n/a where none can be given."
HIGH = "Upper end of the interval; n/a where none can be given."
NO_CATCH_TRIALS = "undefined: the study has no catch trials"


def interval_columns(kind: str, *, iterative: bool = False) -> tuple[Column[_WithInterval], ...]:
    """Return the columns of a table's main interval; `iterative` as for `iterated`."""
    rounded = iterated if iterative else lambda end: end
    return (
        Column("interval_low", LOW, of(lambda row: row.interval, lambda ends: rounded(ends.low))),
        Column("interval_high", HIGH, of(lambda row: row.interval, lambda ends: rounded(ends.high))),
        interval_kind(kind),
    )


def interval_kind(kind: str) -> Column[object]:
    """Return the column that says what the main interval is."""
    return Column("interval", "Kind of the interval.", lambda _row: kind)


def iterated(value: float | None) -> float | None:
    """Round what an iteration or a quadrature gave: machines agree in fewer digits there."""
    return None if value is None else float(f"{value:.{_ITERATED_DIGITS}g}")


def why_no_interval(interval: Interval | None, participants: int) -> str | None:
    """Return why there is no interval over participants; None if there is one."""
    if interval is not None:
        return None
    if participants > 1:
        return "no interval: all participants have the same value"
    return f"no interval over {participants} participant(s)"


def joined(notes: Iterable[str]) -> str | None:
    """Return notes as one; None if there are none."""
    return "; ".join(notes) or None


def _factor_column(name: str, condition: Callable[[Of], Condition]) -> Column[Of]:
    return Column(
        name,
        "Level of this factor; n/a: over all its levels together.",
        lambda row: dict(condition(row)).get(name),
    )


def _rounded(value: Value) -> Value:
    # The last digits of a float may differ between machines; the tables shall not.
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if isinstance(value, float) else value
