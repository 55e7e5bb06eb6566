"""All trials of a study as one table (``trials.tsv``): what every result is computed from, row by row."""

from collections.abc import Mapping, Sequence
from typing import Any

from autd_analysis.data.trials import Trials
from autd_trials.protocol.schema import Level
from autd_trials.tables import Column, Value, describe, require_reserved, tsv

Row = Mapping[Any, Any]

ABOUT = "All trials of all participants, as they were read: what the other tables are made from."


def trials_tsv(trials: Trials) -> str:
    """Return all trials, one row for every attempt, as tab-separated text."""
    rows: Sequence[Row] = trials.table.to_dict("records")
    return tsv(trial_columns(trials), rows)


def trials_sidecar(trials: Trials) -> dict[str, Any]:
    """Return the description of the columns, as BIDS has it."""
    return describe(trial_columns(trials))


def trial_columns(trials: Trials) -> tuple[Column[Row], ...]:
    """Return the columns of all trials; those in which nothing is known are left out."""
    names = [factor.name for factor in trials.design.factors]
    if trials.design.method is not None:
        names.append(trials.design.method.varies)
    levels = [_level(name, trials) for name in names]
    known = [column for column in _TRAILING if _is_known(column, trials)]
    simulated = Column[Row](
        "simulated",
        "Whether participants were simulated; if yes, these are not human data.",
        lambda _row: trials.simulated,
    )
    return (*_LEADING, *levels, *known, simulated)


def _level(name: str, trials: Trials) -> Column[Row]:
    factor = next((factor for factor in trials.design.factors if factor.name == name), None)
    about = (
        f"Level of the factor {name}; n/a where a trial has none."
        if factor is not None
        else f"What the adaptive method chose as {name}; n/a in catch trials."
    )
    return Column(name, about, lambda row: _value(row[name]), levels=factor.describe if factor else {})


def _is_known(column: Column[Row], trials: Trials) -> bool:
    return column.name == "response" or bool(
        trials.table[_SOURCE.get(column.name, column.name)].notna().any()
    )


def _value(cell: Any) -> Value:
    """Return a cell of the data frame; None where it is missing."""
    import pandas as pd

    if pd.isna(cell):
        return None
    level: Level = cell
    return level


def _whole(cell: Any) -> Value:
    value = _value(cell)
    return value if value is None else int(value)


_SOURCE = {"response_time": "response_time_s"} | {
    name: f"{name}_s" for name in ("onset_lateness", "start_margin", "silent_before", "emitting_after")
}
"""The columns of `Trials.table` whose name has their unit, as that of the tables of a session has not."""


def _timing(name: str, description: str) -> Column[Row]:
    return Column(name, description, lambda row: _value(row[_SOURCE[name]]), units="s")


def _counted(name: str, description: str) -> Column[Row]:
    return Column(name, description, lambda row: _whole(row[name]))


_LEADING: tuple[Column[Row], ...] = (
    Column("participant", "The participant's label.", lambda row: row["participant"]),
    Column("session", "The session's label.", lambda row: row["session"]),
    Column("block", "Number of the block in its session.", lambda row: int(row["block"])),
    Column("trial", "Number of the trial in its session.", lambda row: int(row["trial"])),
    Column(
        "attempt", "Which attempt at this trial the row is about, from 1.", lambda row: int(row["attempt"])
    ),
    Column(
        "trial_type",
        "Whether there was something to feel.",
        lambda row: row["trial_type"],
        levels={
            "stimulus": "A stimulus was presented.",
            "catch": "Nothing was presented.",
            "practice": "Practice, which does not count.",
        },
    ),
    Column(
        "trial_status",
        "Whether the attempt ran to its end.",
        lambda row: row["trial_status"],
        levels={"complete": "It did.", "interrupted": "It was cut short, and does not count."},
    ),
    Column(
        "used",
        "Whether results count the row: complete, answered, and no practice.",
        lambda row: bool(row["used"]),
        levels={"yes": "It counts.", "no": "It does not."},
    ),
)

_TRAILING: tuple[Column[Row], ...] = (
    Column(
        "response",
        "The answer; n/a where there is none.",
        lambda row: None if _value(row["felt"]) is None else ("felt" if row["felt"] else "not_felt"),
        levels={"felt": "Felt, or a right answer.", "not_felt": "Not felt, or a wrong answer."},
    ),
    _timing("response_time", "From the onset to the answer."),
    _timing("onset_lateness", "Actual onset minus planned onset."),
    _timing("start_margin", "What was left between the accepted start command and the onset."),
    _timing("silent_before", "How long before the onset the array was last read back as silent."),
    _timing("emitting_after", "How long after the onset the array was first read back as emitting."),
    _counted("presses_before_onset", "Presses from the beginning of the trial to its onset."),
    _counted("presses_late", "Presses after the response window."),
    _counted("underruns", "Gaps in the masking noise during the trial."),
)

require_reserved((*_LEADING, *_TRAILING))
