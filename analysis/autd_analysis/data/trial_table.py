"""Reading one trial table (``*_events.tsv``), strictly: what is not understood is refused with its line."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from autd_analysis.data.design import StudyFactor
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Level
from autd_trials.tables import MISSING, level_text, number, read_table

TABLE_SUFFIX = "_events.tsv"

_NAME = re.compile(r"(?P<sub>sub-(?P<participant>[A-Za-z0-9]+))_(?P<ses>ses-(?P<session>[A-Za-z0-9]+))_.+")
_REQUIRED = ("trial_type", "trial", "block", "trial_status", "response")
_ANSWERS = {"felt": True, "not_felt": False, MISSING: None}


@dataclass(frozen=True)
class TrialTiming:
    """How well a trial was timed and what disturbed it; None where the table does not say.

    Attributes
    ----------
    onset_lateness_s
        Actual minus planned onset.
    start_margin_s
        What was left between the accepted start command and the onset.
    silent_before_s, emitting_after_s
        The array was last read back as silent so long before the onset, and first as emitting so long after.
    presses_before_onset, presses_late
        Presses outside the response window.
    underruns
        Gaps in the masking noise.
    """

    onset_lateness_s: float | None = None
    start_margin_s: float | None = None
    silent_before_s: float | None = None
    emitting_after_s: float | None = None
    presses_before_onset: int | None = None
    presses_late: int | None = None
    underruns: int | None = None


@dataclass(frozen=True)
class TrialRow:
    """One attempt at one trial; `felt` and `response_time_s` are None where there is no answer or press."""

    participant: str
    session: str
    block: int
    trial: int
    attempt: int
    trial_type: str
    trial_status: str
    felt: bool | None
    response_time_s: float | None
    levels: Mapping[str, Level | None]
    timing: TrialTiming = TrialTiming()

    @property
    def used(self) -> bool:
        """Whether the analysis counts it: complete, answered, and no practice."""
        return self.trial_status == "complete" and self.felt is not None and self.trial_type != "practice"


def trial_timing(number: Callable[[str], float | None], count: Callable[[str], int | None]) -> TrialTiming:
    """Return a trial's timing from what reads a column's number and a column's count."""
    return TrialTiming(
        onset_lateness_s=number("onset_lateness"),
        start_margin_s=number("start_margin"),
        silent_before_s=number("silent_before"),
        emitting_after_s=number("emitting_after"),
        presses_before_onset=count("presses_before_onset"),
        presses_late=count("presses_late"),
        underruns=count("underruns"),
    )


def read_trial_table(
    table: Path, factors: Sequence[StudyFactor], chosen: str | None = None
) -> tuple[TrialRow, ...]:
    """Read a trial table.

    Parameters
    ----------
    table
        The file; its name gives participant and session.
    factors
        The study's factors, each a column of the table.
    chosen
        The column of the quantity whose level an adaptive method chose, if there is one.

    Returns
    -------
    tuple of TrialRow
        In the file's order.

    Raises
    ------
    UsageError
        The file cannot be read or is not such a table, or trials are complete in it more than once.
    """
    participant, session = _entities(table)
    rows: list[TrialRow] = []
    completed: dict[int, str] = {}
    named = [*(factor.name for factor in factors), *([chosen] if chosen else [])]
    text = read_table(table, "trial table", separator="\t")
    text.require([*_REQUIRED, *named], "make the table again from the raw log: autd-trials export STUDY")
    for where, cells in text.records():
        cell = _Cells(cells, where)
        row = _trial_row(cell, factors, participant, session, chosen)
        if row.trial_status == "complete" and row.trial in completed:
            raise UsageError(
                f"trial {row.trial} is complete twice, here and in {completed[row.trial]}",
                where=where,
                do="make the table again from the raw log: autd-trials export STUDY",
            )
        if row.trial_status == "complete":
            completed[row.trial] = where
        rows.append(row)
    return tuple(rows)


def _entities(table: Path) -> tuple[str, str]:
    """Return participant and session of a table, which folder and file name must agree on."""
    match = _NAME.fullmatch(table.name.removesuffix(TABLE_SUFFIX))
    if match is None or (match["sub"], match["ses"]) != (table.parts[-4], table.parts[-3]):
        raise UsageError(
            "the file's name does not fit its folder",
            where=str(table),
            do="name it sub-XX/ses-YY/beh/sub-XX_ses-YY_task-NAME_run-N_events.tsv",
        )
    return match["participant"], match["session"]


@dataclass(frozen=True)
class _Cells:
    """The cells of one row, read with messages that name the row's place."""

    cells: Mapping[str, str]
    where: str

    def integer(self, column: str, *, default: int | None = None) -> int:
        text = self.cells.get(column, MISSING)
        if text == MISSING and default is not None:
            return default
        if not re.fullmatch(r"[0-9]{1,9}", text):
            raise self._error(column, "a whole number")
        return int(text)

    def count(self, column: str) -> int | None:
        return None if self.cells.get(column, MISSING) == MISSING else self.integer(column)

    def number(self, column: str) -> float | None:
        text = self.cells.get(column, MISSING)
        if text == MISSING:
            return None
        value = number(text)
        if value is None:
            raise self._error(column, "a number or n/a")
        return value

    def word(self, column: str, *allowed: str) -> str:
        text = self.cells[column]
        if text not in allowed:
            raise self._error(column, " or ".join(allowed))
        return text

    def level(self, factor: StudyFactor) -> Level:
        level = factor.parse(self.cells[factor.name])
        if level is None:
            allowed = ", ".join(map(level_text, factor.levels))
            raise self._error(factor.name, f"a level of the protocol: {allowed}")
        return level

    def _error(self, column: str, expected: str) -> UsageError:
        text = self.cells.get(column, MISSING)
        return UsageError(f"{column} is {text!r}, expected {expected}", where=self.where)


def _trial_row(
    cell: _Cells, factors: Sequence[StudyFactor], participant: str, session: str, chosen: str | None
) -> TrialRow:
    trial_type = cell.word("trial_type", "stimulus", "catch")
    level = {chosen: cell.number(chosen) if trial_type == "stimulus" else None} if chosen else {}
    return TrialRow(
        participant=participant,
        session=session,
        block=cell.integer("block"),
        trial=cell.integer("trial"),
        attempt=cell.integer("attempt", default=1),
        trial_type=trial_type,
        trial_status=cell.word("trial_status", "complete", "interrupted"),
        felt=_ANSWERS[cell.word("response", *_ANSWERS)],
        response_time_s=cell.number("response_time"),
        levels={
            # A catch trial has no stimulus, so it has no level of what varies from stimulus to stimulus.
            factor.name: None if trial_type == "catch" and factor.within_block else cell.level(factor)
            for factor in factors
        }
        | level,
        timing=trial_timing(cell.number, cell.count),
    )
