"""Trials from a path, as a person writes it in a notebook."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path

from autd_analysis.data.any_table import TableRequest, read_any_table
from autd_analysis.data.trials import Trials, read_trials
from autd_trials.protocol.schema import Comparison


def read_study(folder: str | PathLike[str]) -> Trials:
    """Read the trials of a study that `run-protocol` recorded.

    Parameters
    ----------
    folder
        The study's folder, as ``data/chest``.

    Returns
    -------
    Trials
        The trials as a data frame (`Trials.table`), the design, and what is odd about them.

    Raises
    ------
    UsageError
        As `autd_analysis.data.trials.read_trials`.
    """
    return read_trials(Path(folder))


def read_table(
    file: str | PathLike[str],
    columns: Mapping[str, str] | None = None,
    levels: Mapping[str, Sequence[str]] | None = None,
    compare: Iterable[Sequence[str]] = (),
) -> Trials:
    """Read the trials of any table of answers.

    Parameters
    ----------
    file
        A CSV or TSV, or BIDS' ``*_events.tsv``.
    columns
        The table's column for each thing: ``participant``, ``response`` and the factors by their names,
        perhaps ``session``, ``trial``, ``trial_type``; those of these names if None.
    levels
        A factor's levels in order, as the table writes them; as they come if left out.
    compare
        What is compared within participants: factor, first level, second level, and perhaps the other factor
        at each of whose levels.

    Returns
    -------
    Trials
        As of `read_study`.

    Raises
    ------
    UsageError
        As `autd_analysis.data.any_table.read_any_table`.
    """
    # Not validated: a protocol's rules for names of levels are not those of anybody's table.
    comparisons = tuple(
        Comparison.model_construct(
            factor=factor, first=first, second=second, at_each=other[0] if other else None
        )
        for factor, first, second, *other in compare
    )
    return read_any_table(Path(file), TableRequest(columns or {}, levels or {}, comparisons))
