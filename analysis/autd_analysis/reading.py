"""Trials from a path, as a person writes it in a notebook."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path

from autd_analysis.data.foreign.request import (
    Choice,
    TableRequest,
    parse_choices,
    parse_columns,
    parse_comparison,
    parse_words,
)
from autd_analysis.data.foreign.tables import read_tables, table_paths
from autd_analysis.data.trials import Trials, read_trials
from autd_trials.protocol.schema import Comparison
from autd_trials.tables import level_text

Typed = str | Sequence[str]
Chosen = Typed | Mapping[str, object]


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
    paths: str | Path | Sequence[str | Path],
    *,
    columns: str | Mapping[str, str],
    levels: Mapping[str, Sequence[object]] | None = None,
    compare: Typed | Sequence[Comparison] = (),
    yes: object = (),
    catch: Chosen = (),
    exclude: Chosen = (),
    ignore: Typed = (),
    participant: str | None = None,
    encoding: str | None = None,
) -> Trials:
    """Read a table of answers, as ``autd-trials analyse`` does with the options of the same names.

    Parameters
    ----------
    paths
        One file, several, or a pattern such as ``"data/*.csv"``: CSV or TSV, also with semicolons, decimal
        commas, in UTF-16 or Latin-1, or packed by gzip. Files are read as one table; without a column of
        participants their names say whose answers they have.
    columns
        The table's column for each of our names, as ``{"participant": "who", "hz": "freq", ...}`` or
        ``"participant=who,response=felt,hz=freq"``. What is none of
        `autd_analysis.data.foreign.columns.KNOWN` is a factor. ``felt`` and ``n`` instead of ``response``
        are counts: so many of so many trials in a line.
    levels
        The order of factors' levels.
    compare
        What to compare within participants, as ``"clothing=inner,outer@hz"``.
    yes
        The answers that mean felt (or right); all others then do not.
    catch
        What makes a line a catch trial, as ``{"amplitude": 0}`` or ``"amplitude=0"``.
    exclude
        Lines that are left out, as ``{"participant": ["P3", "P7"]}`` or ``"phase=practice"``.
    ignore
        Columns of which it is not said that they were not read.
    participant
        Whose answers these are, if the table does not say so.
    encoding
        The files' encoding, if it is not found.

    Returns
    -------
    Trials
        The trials; its `warnings` say what was not read, not counted, or taken for something.

    Raises
    ------
    UsageError
        A table cannot be read, lacks a column, or has answers, levels or trials that make no sense.
    """
    listed = [paths] if isinstance(paths, str | Path) else list(paths)
    request = TableRequest(
        columns=parse_columns(columns) if isinstance(columns, str) else dict(columns),
        levels={name: tuple(map(_typed, words)) for name, words in (levels or {}).items()},
        comparisons=tuple(
            parse_comparison(each) if isinstance(each, str) else each
            for each in ([compare] if isinstance(compare, str) else compare)
        ),
        yes=_several(yes),
        catch=_choices(catch, "--catch"),
        exclude=_choices(exclude, "--exclude"),
        ignore=_several(ignore),
        participant=participant,
        encoding=encoding,
    )
    return read_tables(table_paths(listed), request)


def _several(words: object) -> tuple[str, ...]:
    if isinstance(words, str):
        return parse_words([words])
    return tuple(map(_typed, words)) if isinstance(words, Iterable) else (_typed(words),)


def _typed(word: object) -> str:
    """Return a word or number of Python as it is typed."""
    is_number = isinstance(word, int | float) and not isinstance(word, bool)
    return level_text(word) if is_number else str(word)  # type: ignore[arg-type]


def _choices(chosen: Chosen, option: str) -> tuple[Choice, ...]:
    if isinstance(chosen, Mapping):
        return tuple((name, word) for name, words in chosen.items() for word in _several(words))
    return parse_choices([chosen] if isinstance(chosen, str) else chosen, option)
