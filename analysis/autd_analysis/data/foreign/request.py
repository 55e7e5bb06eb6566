"""How a table is to be read, and how that is typed: parsed from a command line and spelled back to one."""

import csv
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison
from autd_trials.tables import level_text

Choice = tuple[str, str]
"""A column, by our name or the table's, and what its cells say."""


@dataclass(frozen=True)
class TableRequest:
    """How to read a table.

    Attributes
    ----------
    columns
        The table's column for each of our names: those in `autd_analysis.data.foreign.columns.KNOWN`, and
        factors. A column `simulated` is always read.
    levels
        Order of a factor's levels; those that are not named are refused. Others: as numbers, or by the
        alphabet.
    comparisons
        What to compare.
    yes
        The answers that mean felt (or correct); all others then mean that it was not. Without them words such
        as yes and no, 1 and 0 are understood.
    catch
        Lines in which one of these holds are catch trials.
    exclude
        Lines in which one of these holds are left out.
    ignore
        Columns of the table that are not read, and not said to be not read.
    participant
        Whose answers these are, where the table does not say so.
    encoding
        The files' encoding, where it is known.
    guess_known
        Whether the rate of right guesses was said, so that it need not be asked for.
    """

    columns: Mapping[str, str]
    levels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    comparisons: tuple[Comparison, ...] = ()
    yes: tuple[str, ...] = ()
    catch: tuple[Choice, ...] = ()
    exclude: tuple[Choice, ...] = ()
    ignore: tuple[str, ...] = ()
    participant: str | None = None
    encoding: str | None = None
    guess_known: bool = False


def parse_columns(text: str) -> dict[str, str]:
    """Read ``NAME=COLUMN,NAME,...``; a name alone is a column of that name.

    >>> parse_columns('response=felt,"clothing=what, exactly",hz')
    {'response': 'felt', 'clothing': 'what, exactly', 'hz': 'hz'}

    Raises
    ------
    UsageError
        It is something else, or names one twice.
    """
    columns: dict[str, str] = {}
    for part in _words(text):
        name, _, column = (word.strip() for word in part.partition("="))
        if not name or ("=" in part and not column):
            raise UsageError(f"--columns has {part!r}", do="write NAME=COLUMN, as in clothing=cloth")
        if name in columns:
            raise UsageError(f"--columns names {name} twice", do="name each once")
        columns[name] = column or name
    return columns


def parse_levels(texts: Iterable[str], option: str = "--levels") -> dict[str, list[str]]:
    """Read ``FACTOR=LEVEL,LEVEL,...`` of several factors.

    Raises
    ------
    UsageError
        It is something else, or names one twice.
    """
    levels: dict[str, list[str]] = {}
    for text in texts:
        name, words = _named(text, option, "clothing=inner,outer")
        if name in levels or len(set(words)) < len(words):
            raise UsageError(f"{option} names {name}, or a word for it, twice", do="name each once")
        levels[name] = words
    return levels


def parse_choices(texts: Iterable[str], option: str) -> tuple[Choice, ...]:
    """Read ``COLUMN=VALUE,VALUE,...`` of several columns."""
    choices: list[Choice] = []
    for text in texts:
        name, words = _named(text, option, "participant=P3,P7")
        choices += [(name, word) for word in words]
    return tuple(dict.fromkeys(choices))


def parse_words(texts: Iterable[str]) -> tuple[str, ...]:
    """Read ``WORD,WORD,...``, perhaps several times."""
    return tuple(dict.fromkeys(word for text in texts for word in _words(text)))


def parse_comparison(text: str) -> Comparison:
    """Read ``FACTOR=FIRST,SECOND`` or ``FACTOR=FIRST,SECOND@OTHER``.

    Raises
    ------
    UsageError
        It is something else.
    """
    compared, other = text, None
    if found := re.fullmatch(r'(.*?)@([^"@]*)', text, re.DOTALL):
        compared, other = found[1], found[2].strip()
    factor, levels = _named(compared, "--compare", "clothing=inner,both@modulation_hz")
    if len(levels) != 2:
        raise UsageError(f"--compare has {text!r}", do="name two levels: clothing=inner,both@modulation_hz")
    # Not validated: a protocol's rules for names of levels are not those of anybody's table.
    return Comparison.model_construct(factor=factor, first=levels[0], second=levels[1], at_each=other or None)


def columns_option(columns: Mapping[str, str]) -> str:
    """Return what is typed for `TableRequest.columns`, to be read by a shell."""
    parts = (name if name == column else f"{name}={column}" for name, column in columns.items())
    return f"--columns {shlex.quote(_listed(parts))}"


def levels_option(factor: str, levels: Iterable[str]) -> str:
    """Return what is typed for the order of a factor's levels."""
    return f"--levels {shlex.quote(f'{factor}={_listed(levels)}')}"


def comparison_option(comparison: Comparison) -> str:
    """Return what is typed for a comparison."""
    at = f"@{comparison.at_each}" if comparison.at_each else ""
    levels = _listed([level_text(comparison.first), level_text(comparison.second)])
    return f"--compare {shlex.quote(f'{comparison.factor}={levels}{at}')}"


def choice_option(option: str, name: str, *values: str) -> str:
    """Return what is typed for values of a column in `TableRequest.catch` or `TableRequest.exclude`."""
    return f"{option} {shlex.quote(f'{name}={_listed(values)}')}"


def words_option(option: str, words: Iterable[str]) -> str:
    """Return what is typed for `TableRequest.yes` or `TableRequest.ignore`."""
    return f"{option} {shlex.quote(_listed(words))}"


def command(paths: Sequence[Path], request: TableRequest) -> str:
    """Return what a person types, in the files' folder, to have them read so."""
    options = [columns_option(request.columns)] if request.columns else []
    options += [levels_option(name, levels) for name, levels in request.levels.items()]
    options += [comparison_option(each) for each in request.comparisons]
    options += [words_option("--yes", request.yes)] if request.yes else []
    options += [choice_option("--catch", *each) for each in request.catch]
    options += [choice_option("--exclude", *each) for each in request.exclude]
    options += [words_option("--ignore", request.ignore)] if request.ignore else []
    options += [f"--participant {shlex.quote(request.participant)}"] if request.participant else []
    options += [f"--encoding {shlex.quote(request.encoding)}"] if request.encoding else []
    return " ".join(["autd-trials analyse", *map(shlex.quote, _names(paths)), *options])


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the files' names; of many the pattern that gives just these, if there is one."""
    names = [path.name for path in paths]
    folder = paths[0].parent
    pattern = f"*{paths[0].suffix}"
    if len(paths) > 2 and sorted(folder.glob(pattern)) == sorted(paths):
        return [pattern]
    return names


def _words(text: str) -> list[str]:
    """Return words separated by commas; those that hold a comma are in double quotes."""
    try:
        parts = next(csv.reader([text], skipinitialspace=True, strict=True), [])
    except csv.Error as error:
        raise UsageError(
            f"{text!r} cannot be read: {error}", do='put words that hold a comma in quotes, as "a, b",c'
        ) from error
    return [part.strip() for part in parts if part.strip()]


def _named(text: str, option: str, example: str) -> tuple[str, list[str]]:
    """Read ``NAME=WORD,WORD``."""
    name, _, rest = text.partition("=")
    words = _words(rest)
    if not name.strip() or not words or rest.rstrip().endswith(","):
        raise UsageError(f"{option} has {text!r}", do=f"write NAME=WORD, as in {option} {example}")
    return name.strip(), words


def _listed(words: Iterable[str]) -> str:
    return ",".join(
        '"' + word.replace('"', '""') + '"' if re.search(r'[,"@]', word) else word for word in words
    )
