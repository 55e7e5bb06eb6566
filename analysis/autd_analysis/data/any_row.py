"""One line of any table as a trial: what its cells mean, and messages that name its place."""

from collections.abc import Mapping, Sequence

from autd_analysis.data.design import StudyFactor
from autd_analysis.data.trial_table import TrialRow, trial_timing
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Level
from autd_trials.tables import MISSING_WORDS, number

_FELT = {
    "felt": True,
    "1": True,
    "1.0": True,
    "true": True,
    "yes": True,
    "not_felt": False,
    "0": False,
    "0.0": False,
    "false": False,
    "no": False,
}
_SIMULATED = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}


def trial_row(where: str, cells: Mapping[str, str], line: int, factors: Sequence[StudyFactor]) -> TrialRow:
    """Return a line's trial.

    Parameters
    ----------
    where
        The line's place, for messages.
    cells
        Its cells under our names, as in `autd_analysis.data.any_table.KNOWN`, and under those of the factors.
    line
        Its number among the lines, which is the trial's where the table has none.
    factors
        The factors.

    Raises
    ------
    UsageError
        A cell makes no sense.
    """
    trial_type = cells.get("trial_type") or "stimulus"
    status = cells.get("trial_status") or "complete"
    if trial_type not in ("stimulus", "catch", "practice"):
        raise UsageError(f"trial_type is {trial_type!r}", where=where, do="write stimulus, catch or practice")
    if status not in ("complete", "interrupted"):
        raise UsageError(f"trial_status is {status!r}", where=where, do="write complete or interrupted")
    if cells["participant"].lower() in MISSING_WORDS:
        raise UsageError("the participant is missing", where=where)
    return TrialRow(
        participant=cells["participant"],
        session=cells.get("session") or "1",
        block=_count("block", cells, where, default=1),
        trial=_count("trial", cells, where, default=line),
        attempt=1,
        trial_type=trial_type,
        trial_status=status,
        felt=_answer(cells["response"], where),
        response_time_s=_quantity("response_time", cells, where),
        levels={factor.name: _level(factor, cells[factor.name], trial_type, where) for factor in factors},
        timing=trial_timing(
            lambda name: _quantity(name, cells, where), lambda name: _whole(name, cells, where)
        ),
    )


def _answer(text: str, where: str) -> bool | None:
    if text.lower() in MISSING_WORDS:
        return None
    if text.lower() not in _FELT:
        raise UsageError(
            f"response is {text!r}, which is no yes or no",
            where=where,
            do=f"write one of {', '.join(_FELT)}, or n/a",
        )
    return _FELT[text.lower()]


def _level(factor: StudyFactor, text: str, trial_type: str, where: str) -> Level | None:
    if text.lower() in MISSING_WORDS:
        if trial_type != "stimulus":
            return None
        raise UsageError(
            f"{factor.name} is missing", where=where, do="only catch and practice trials may lack it"
        )
    return factor.parse(text)


def is_simulated(where: str, cells: Mapping[str, str]) -> bool:
    """Return whether a line says that a simulated participant answered."""
    text = cells.get("simulated", "").lower()
    if text not in _SIMULATED and text not in MISSING_WORDS:
        raise UsageError(f"simulated is {text!r}", where=where, do="write yes or no")
    return _SIMULATED.get(text, False)


def _count(name: str, cells: Mapping[str, str], where: str, *, default: int) -> int:
    whole = _whole(name, cells, where)
    return default if whole is None else whole


def _whole(name: str, cells: Mapping[str, str], where: str) -> int | None:
    """Return a cell as a whole number, also as 3.0, which pandas writes; None if it is missing."""
    value = _quantity(name, cells, where)
    if value is not None and (value < 0 or not value.is_integer()):
        raise UsageError(f"{name} is {cells[name]!r}", where=where, do="give a whole number")
    return None if value is None else int(value)


def _quantity(name: str, cells: Mapping[str, str], where: str) -> float | None:
    """Return a cell as a number; None if it is missing."""
    text = cells.get(name, "")
    if text.lower() in MISSING_WORDS:
        return None
    value = number(text)
    if value is None:
        raise UsageError(f"{name} is {text!r}", where=where, do="give a number, with a decimal point, or n/a")
    return value
