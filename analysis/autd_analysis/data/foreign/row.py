"""One line of any table as a trial: what its cells mean, and messages that name its place."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from autd_analysis.data.foreign.request import choice_option
from autd_analysis.data.foreign.words import SPREADSHEET_ERROR, TRIAL_STATUS, is_missing
from autd_analysis.data.trial_table import TrialRow, trial_timing
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Level
from autd_trials.tables import FOREIGN_MISSING_WORDS, number

_SIMULATED = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}


@dataclass(frozen=True)
class Line:
    """A line of a table.

    Attributes
    ----------
    where
        Its place, for messages.
    file
        The number of its file.
    cells
        Its cells under our names, as in `autd_analysis.data.foreign.columns.KNOWN`, and under the factors'.
    others
        All its cells under the table's names.
    """

    where: str
    file: int
    cells: Mapping[str, str]
    others: Mapping[str, str]

    def named(self, name: str) -> str | None:
        """Return the cell under our name or the table's; None if there is none."""
        return self.cells.get(name, self.others.get(name))

    def excluding(self, name: str) -> str:
        """Return what is typed to leave this line out, and those like it."""
        return choice_option("--exclude", name, self.cells[name] or "n/a")


@dataclass(frozen=True)
class Meaning:
    """What words mean over all lines.

    Attributes
    ----------
    participants, sessions
        The label of each spelling.
    trial_types
        The type of each word: stimulus, catch or practice.
    answers
        Whether each answer means felt; None where there is none.
    levels
        For each factor the level of each word; None where there is none.
    conditions
        For each factor those levels that are conditions, not of catch trials alone.
    """

    participants: Mapping[str, str]
    sessions: Mapping[str, str]
    trial_types: Mapping[str, str]
    answers: Mapping[str, bool | None]
    levels: Mapping[str, Mapping[str, Level | None]]
    conditions: Mapping[str, Collection[Level]]


def trial_row(line: Line, count: int, meaning: Meaning) -> TrialRow:
    """Return a line's trial.

    Parameters
    ----------
    line
        The line.
    count
        Its number among the lines, which is the trial's where the table has none.
    meaning
        What its words mean.

    Raises
    ------
    UsageError
        A cell makes no sense.
    """
    cells = line.cells
    trial_type = meaning.trial_types[cells["trial_type"]]
    if is_missing(cells["participant"]):
        raise UsageError(
            "the participant is missing",
            where=line.where,
            do=f"write it, or leave such lines out: {line.excluding('participant')}",
        )
    return TrialRow(
        participant=meaning.participants[cells["participant"]],
        session=meaning.sessions[cells["session"]],
        block=_count("block", line, default=1),
        trial=_count("trial", line, default=count),
        attempt=1,
        trial_type=trial_type,
        trial_status=TRIAL_STATUS[cells["trial_status"].lower()],
        felt=meaning.answers[cells["response"]],
        response_time_s=_response_time_s(line),
        levels={
            name: level if level in meaning.conditions[name] else None
            for name, of in meaning.levels.items()
            for level in [_level(name, line, trial_type, of)]
        },
        timing=trial_timing(lambda name: _quantity(name, line), lambda name: _whole(name, line)),
    )


def is_simulated(line: Line) -> bool:
    """Return whether a line says that a simulated participant answered."""
    text = line.cells.get("simulated", "").lower()
    if text not in _SIMULATED and not is_missing(text):
        raise UsageError(f"simulated is {text!r}", where=line.where, do="write yes or no")
    return _SIMULATED.get(text, False)


def counts(line: Line) -> tuple[int, int]:
    """Return how many of how many trials of a line were felt.

    Raises
    ------
    UsageError
        These are no such counts.
    """
    felt, trials = _whole("felt", line), _whole("n", line)
    if felt is None or trials is None:
        missing = "felt" if felt is None else "n"
        raise UsageError(
            f"{missing} is missing",
            where=line.where,
            do=f"write it, or leave such lines out: {line.excluding(missing)}",
        )
    if felt > trials:
        raise UsageError(
            f"{felt} of {trials} trials are felt",
            where=line.where,
            do=f"see which column is which, or leave such lines out: {line.excluding('felt')}",
        )
    return felt, trials


def _level(name: str, line: Line, trial_type: str, levels: Mapping[str, Level | None]) -> Level | None:
    text = line.cells[name]
    if SPREADSHEET_ERROR.fullmatch(text):
        raise UsageError(
            f"{name} is {text}, an error of a spreadsheet",
            where=line.where,
            do=f"write the level, or leave such lines out: {line.excluding(name)}",
        )
    level = levels[text]
    if level is None and trial_type == "stimulus":
        raise UsageError(
            f"{name} is missing",
            where=line.where,
            do=f"write it, as only catch and practice trials may lack it, or leave such lines out: "
            f"{line.excluding(name)}",
        )
    return level


def _response_time_s(line: Line) -> float | None:
    if "response_time_ms" not in line.cells:
        return _quantity("response_time", line)
    milliseconds = _quantity("response_time_ms", line)
    return None if milliseconds is None else milliseconds / 1000


def _count(name: str, line: Line, *, default: int) -> int:
    whole = _whole(name, line)
    return default if whole is None else whole


def _whole(name: str, line: Line) -> int | None:
    """Return a cell as a whole number, also as 3.0, which pandas writes; None if it is missing."""
    value = _quantity(name, line)
    if value is not None and (value < 0 or not value.is_integer()):
        raise UsageError(
            f"{name} is {line.cells[name]!r}",
            where=line.where,
            do=f"give a whole number, or leave such lines out: {line.excluding(name)}",
        )
    return None if value is None else int(value)


def _quantity(name: str, line: Line) -> float | None:
    """Return a cell as a number; None if it is missing."""
    text = line.cells.get(name, "")
    if not text or text.lower() in FOREIGN_MISSING_WORDS:
        return None
    value = number(text)
    if value is None:
        raise UsageError(
            f"{name} is {text!r}",
            where=line.where,
            do="give a number, with a decimal point, or n/a; or leave such lines out: "
            f"{line.excluding(name)}",
        )
    return value
