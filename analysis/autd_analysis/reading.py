"""Trials from a path, as a person writes it in a notebook."""

from os import PathLike
from pathlib import Path

from autd_analysis.data.trials import Trials, read_trials


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
