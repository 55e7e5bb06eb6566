"""A table of results: declared once, with how its rows and columns are got; and what declarations share."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Generic, TypeVar
from typing import Protocol as Interface

from autd_analysis.basics.intervals import Interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Condition, Design, StudyFactor
from autd_analysis.data.trials import Trials
from autd_trials.tables import Column, Value, level_text, of, require_reserved

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[str, Value]
Found = TypeVar("Found", contravariant=True)
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

    def to_frame(self) -> "pd.DataFrame":
        """Return the table as a data frame; what is missing or undefined is missing there."""
        import pandas as pd

        return pd.DataFrame(list(self.rows), columns=[column.name for column in self.columns])


@dataclass(frozen=True)
class Declared(Generic[Found, Of]):
    """A table as it is declared: what its rows are about, what its columns mean, and how both are got.

    Attributes
    ----------
    name, about
        As in `ResultTable`.
    rows
        Returns what the rows are about, from what a subject found.
    columns
        The columns behind those of the factors, but for `notes` and `simulated`.
    notes
        Returns what could not be computed in a row, and why.
    leading
        The columns before those of the factors.
    condition
        Returns a row's level of each factor; None in a table without columns of factors.
    factors
        Returns the factors that have columns.
    undefined
        What the only row says if there are none.
    """

    name: str
    about: str
    rows: Callable[[Found], Iterable[Of]]
    columns: tuple[Column[Of], ...]
    notes: Callable[[Of], str | None] = lambda _row: None
    leading: tuple[Column[Of], ...] = ()
    condition: Callable[[Of], Condition] | None = None
    factors: Callable[[Design], Sequence[StudyFactor]] = lambda design: design.factors
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

    def made(self, found: Found, trials: Trials) -> ResultTable:
        """Return the table of what was found, with its numbers rounded."""
        levels = (
            [_factor_column(factor.name, self.condition) for factor in self.factors(trials.design)]
            if self.condition
            else []
        )
        columns = (*self.leading, *levels, *self.columns, *self._last(simulated=trials.simulated))
        exact = {column.name for column in levels}
        made = [
            {
                column.name: value if column.name in exact else _rounded(value)
                for column in columns
                for value in [column.get(row)]
            }
            for row in self.rows(found)
        ]
        if not made and self.undefined is not None:
            made = [
                dict.fromkeys((column.name for column in columns), None)
                | {"notes": self.undefined, "simulated": trials.simulated}
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
                "Whether participants were simulated; if yes, these are not human data.",
                lambda _row: simulated,
            ),
        )


class _OfParticipant(Interface):
    @property
    def participant(self) -> str: ...


class _WithInterval(Interface):
    @property
    def interval(self) -> Interval | None: ...


class _Compares(Interface):
    @property
    def contrast(self) -> Contrast | None: ...


class _Counted(Interface):
    @property
    def participants(self) -> int: ...

    @property
    def trials(self) -> int: ...


PARTICIPANT: Column[_OfParticipant] = Column(
    "participant", "The participant's label.", lambda row: row.participant
)
COMPARED: tuple[Column[_Compares], ...] = (
    Column(
        "factor",
        "The factor compared; n/a: none is.",
        of(lambda row: row.contrast, lambda contrast: contrast.factor),
    ),
    Column(
        "first",
        "The level subtracted from.",
        of(lambda row: row.contrast, lambda contrast: level_text(contrast.first)),
    ),
    Column(
        "second",
        "The level subtracted.",
        of(lambda row: row.contrast, lambda contrast: level_text(contrast.second)),
    ),
)
AT: Column[_Compares] = Column(
    "at",
    "The level of the other factor at which they were compared; n/a if over all trials.",
    of(
        lambda row: row.contrast,
        lambda contrast: "; ".join(f"{name} {level_text(level)}" for name, level in contrast.at) or None,
    ),
)
PARTICIPANTS: Column[_Counted] = Column(
    "participants", "Number of participants whose responses determine it.", lambda row: row.participants
)
TRIALS: Column[_Counted] = Column("trials", "Number of their trials counted.", lambda row: row.trials)
LOW = "Lower end of the interval; n/a where none can be given."
HIGH = "Upper end of the interval; n/a where none can be given."
READING = "The estimate in words."
NO_CATCH_TRIALS = "undefined: the study has no catch trials"
NOTHING_COMPARED = "the protocol plans no comparison"


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
