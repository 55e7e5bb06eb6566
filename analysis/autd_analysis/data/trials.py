"""A study's trial tables as one tidy data frame, with everything odd about them reported."""

import dataclasses
import math
import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from autd_analysis.data.checks import record_warnings, session_warnings, trial_warnings
from autd_analysis.data.design import Design, study_design
from autd_analysis.data.sessions import LoggedSession, read_sessions
from autd_analysis.data.trial_table import TABLE_SUFFIX, TrialRow, TrialTiming, read_trial_table
from autd_trials.errors import UsageError
from autd_trials.records.problem import Problem
from autd_trials.records.verify import verify_study

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Trials:
    """The trials of a study.

    Attributes
    ----------
    design
        Factors and planned comparisons.
    table
        One row per attempt at a trial: participant, session, block, trial, attempt, trial_type (stimulus or
        catch), trial_status (complete or interrupted), felt (True, False or missing), response_time_s, `used`
        (whether the analysis counts the row: complete and answered), the fields of
        `autd_analysis.data.trial_table.TrialTiming`, and one column per factor (None where a catch trial does
        not have it) and for what an adaptive method chose.
    simulated
        Whether any session was made by a simulated participant.
    warnings
        What a reader of the results should know about the data; nothing is left out in silence.
    inputs
        The files that were read: trial tables, then logs.
    logged
        The sessions as their raw logs have them; none for a table of whoever recorded it.
    ordered
        Whether it is known in which order trials came.
    problems
        What is wrong with the study's records; what the records do not explain is among the warnings too.
    command
        What makes these results again, the folder or file by its bare name.
    """

    design: Design
    table: "pd.DataFrame"
    simulated: bool
    warnings: tuple[str, ...]
    inputs: tuple[Path, ...]
    logged: tuple[LoggedSession, ...] = ()
    ordered: bool = True
    command: str = ""
    problems: tuple[Problem, ...] = ()

    @property
    def participants(self) -> tuple[str, ...]:
        """The participants' labels, in order."""
        return tuple(sorted(set(self.table["participant"])))

    def stimuli_per_condition(self) -> set[int]:
        """Return the numbers of stimuli counted per participant and condition; 0 where there is none."""
        stimuli = self.table[self.table["used"] & (self.table["trial_type"] == "stimulus")]
        keys = ["participant", *(factor.name for factor in self.design.factors)]
        counts = stimuli.groupby(keys, observed=True).size()
        cells = len(self.participants) * math.prod(len(factor.levels) for factor in self.design.factors)
        return {int(count) for count in counts} | ({0} if len(counts) < cells else set())

    @property
    def sessions(self) -> int:
        """The number of sessions that have trials."""
        return len(self.table[["participant", "session"]].drop_duplicates())


def read_trials(study: Path) -> Trials:
    """Read all trials of a study.

    Parameters
    ----------
    study
        The study's folder (BIDS): trial tables in ``sub-*/ses-*/beh/*_events.tsv``, raw logs in
        ``sourcedata/sub-*/ses-*/*_log.jsonl``.

    Returns
    -------
    Trials
        The trials and what is odd about them.

    Raises
    ------
    UsageError
        There is nothing to analyse; a file is damaged; trials are there twice; or the sessions were recorded
        with protocols of different factors.
    """
    tables = _find_tables(study)
    sessions, never_begun = _find_sessions(study)
    problems = tuple(verify_study(study))
    design = study_design(sessions)
    chosen = design.method.varies if design.method else None
    rows = {table: read_trial_table(table, design.factors, chosen) for table in tables}
    if not any(row.used for its_rows in rows.values() for row in its_rows):
        raise UsageError(
            "the study has no complete trial", where=str(study), do="record a session first: run-protocol"
        )
    return Trials(
        design=design,
        table=data_frame((row for its_rows in rows.values() for row in its_rows), design),
        simulated=any(session.start.simulated for session in sessions),
        warnings=(
            *record_warnings(problems),
            *session_warnings(sessions, never_begun, tables),
            *trial_warnings(sessions, rows, design),
        ),
        inputs=(*tables, *(session.log for session in sessions)),
        logged=sessions,
        problems=problems,
        command=shlex.join(["autd-trials", "analyse", study.resolve().name]),
    )


def _find_tables(study: Path) -> tuple[Path, ...]:
    if not study.is_dir():
        raise UsageError(
            "there is no such folder", where=str(study), do="give a study's folder: DATA/PROTOCOL"
        )
    tables = sorted(study.glob(f"sub-*/ses-*/beh/*{TABLE_SUFFIX}"))
    if not tables:
        inside = sorted(folder.parent.name for folder in study.glob("*/sourcedata"))
        raise UsageError(
            "no trial tables (sub-*/ses-*/beh/*_events.tsv) are in this folder",
            where=str(study),
            do=f"give one of the studies in it: {', '.join(inside)}"
            if inside
            else "record a session (run-protocol), or make the tables from the logs (autd-trials export)",
        )
    return tuple(tables)


def _find_sessions(study: Path) -> tuple[tuple[LoggedSession, ...], tuple[Path, ...]]:
    sessions, never_begun = read_sessions(study)
    if not sessions:
        raise UsageError(
            "no raw logs (sourcedata/sub-*/ses-*/*_log.jsonl) are in this study, so its factors, its planned "
            "comparisons and whether it is simulated are not known",
            where=str(study),
            do="put the logs back where the runner wrote them",
        )
    return sessions, never_begun


def data_frame(rows: Iterable[TrialRow], design: Design) -> "pd.DataFrame":
    """Return rows as the data frame that `Trials` describes; no factor has the name of another column."""
    import pandas as pd

    frame = pd.DataFrame.from_records([{**_cells(row), **row.levels} for row in rows])
    numbers = ("response_time_s", *(field.name for field in dataclasses.fields(TrialTiming)))
    frame = frame.astype({"felt": "boolean", **dict.fromkeys(numbers, "float64")})
    return frame.astype(dict.fromkeys((factor.name for factor in design.factors), "object"))


def _cells(row: TrialRow) -> dict[str, object]:
    """Return the cells of a row but for its levels."""
    return {
        "participant": row.participant,
        "session": row.session,
        "block": row.block,
        "trial": row.trial,
        "attempt": row.attempt,
        "trial_type": row.trial_type,
        "trial_status": row.trial_status,
        "felt": row.felt,
        "response_time_s": row.response_time_s,
        "used": row.used,
        **vars(row.timing),
    }
