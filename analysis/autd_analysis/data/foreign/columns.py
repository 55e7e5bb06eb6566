"""Which column of somebody's table is what: as it was said, or refused with columns that would do."""

import difflib
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from autd_analysis.data.design import refuse_reserved
from autd_analysis.data.foreign.request import TableRequest, columns_option, words_option
from autd_analysis.data.foreign.words import ANSWERS, TRIAL_TYPES
from autd_analysis.data.trial_table import TABLE_SUFFIX
from autd_trials.errors import UsageError
from autd_trials.tables import FOREIGN_MISSING_WORDS, RESERVED_NAMES, Table, number

COUNTS = ("felt", "n")
"""Of a table with a line for several trials: how many were felt, of how many."""

KNOWN = (
    "participant",
    "response",
    *COUNTS,
    "session",
    "block",
    "trial",
    "trial_type",
    "trial_status",
    "response_time",
    "response_time_ms",
    "onset_lateness",
    "start_margin",
    "silent_before",
    "emitting_after",
    "presses_before_onset",
    "presses_late",
    "underruns",
    "simulated",
)
"""What a table may have besides factors; participants and answers (or counts) are needed. Times are in s."""

_OF_ONE_TRIAL = frozenset(KNOWN) - {"participant", *COUNTS, "session", "block", "trial_type", "simulated"}
_MAY_BE_ONE = frozenset({"session", "block", "trial"})
_ENDINGS = re.compile(r"(\.(csv|tsv|txt|dat|gz))+$", re.IGNORECASE)
_DATES = re.compile(r"\d{4}[-_.]\d{1,2}[-_.]\d{1,2}|\d{1,2}h\d{2}[.\d]*|(?:19|20)\d{6}(?:T?\d{4,6})?")
_ALIKE = {
    "participant": re.compile(
        r"(participant|subject|subj|versuchsperson|vpn|vpcode|proband|observer|person|respondent).*"
        r"|sub(id|nr|no)?|vp(nr|id)?|pp(n|id)?|[ps]?id|who|name|code"
    ),
    "session": re.compile(r"sess(ion)?(id|nr|no)?|sitzung|day|visit"),
    "block": re.compile(r"(block|blk)(id|nr|no|number)?"),
    "response": re.compile(
        r".*(response|answer|correct|accuracy|antwort|reaktion|reaction)|felt|resp|detected|.*(acc|corr)|hit"
        r"|perceived|seen|heard|yes"
    ),
    "felt": re.compile(r"k|n?(felt|hits?|yes|correct|detected|positives?|successes)"),
    "n": re.compile(r"n|(n|num|no)?(of)?(trials|total|presentations|stimuli)"),
}
"""What columns of participants and answers are often called, in small letters without signs."""

_TELLS_OTHERWISE = re.compile(
    r"^(n|nr|no)$|trial|durchgang|index|time|rt$|rtms|date|order|response|answer|keys?$|corr|^column\d"
)
"""What columns that are no factors are often called."""

_MOST_FACTOR_LEVELS = 30
_MOST_FACTORS = 3


def refuse_nonsense(request: TableRequest) -> None:
    """Raise UsageError for what no table can make good: asked before any is read."""
    names = factor_names(request)
    clash = [name for name in names if name in RESERVED_NAMES]
    renamed = {free_name(name) if name in clash else name: column for name, column in request.columns.items()}
    refuse_reserved(names, "--columns", f"call it otherwise: {columns_option(renamed)}")
    for name, column in request.columns.items():
        others = [ours for ours, theirs in request.columns.items() if theirs == column and ours != name]
        if others and not {name, *others} <= _MAY_BE_ONE:
            rest = {ours: theirs for ours, theirs in request.columns.items() if ours not in others}
            raise UsageError(
                f"the column {column} is named for {name} and for {others[0]}",
                where="--columns",
                do=f"name it once: {columns_option(rest)}",
            )
    counted = [name for name in COUNTS if name in request.columns]
    if counted and "response" in request.columns:
        raise UsageError(
            f"both response and {counted[0]} are named: a line is one trial or several",
            where="--columns",
            do=f"leave one out: {columns_option(_without(request.columns, COUNTS))}",
        )
    single = [name for name in request.columns if name in _OF_ONE_TRIAL]
    if len(counted) == len(COUNTS) and single:
        raise UsageError(
            f"a line of counts has no {single[0]}",
            where="--columns",
            do=f"leave it out: {columns_option(_without(request.columns, single))}",
        )
    for column in request.ignore:
        if column in request.columns.values():
            raise UsageError(
                f"{column} is to be ignored and is named in --columns", where="--ignore", do="say one of both"
            )


def _without(columns: Mapping[str, str], left_out: Collection[str]) -> dict[str, str]:
    return {name: column for name, column in columns.items() if name not in left_out}


def factor_names(request: TableRequest) -> list[str]:
    """Return the names of the factors."""
    return [name for name in request.columns if name not in KNOWN]


def columns_of(table: Table, request: TableRequest) -> dict[str, str]:
    """Return the table's column for each of our names, also of those that need not be named.

    Raises
    ------
    UsageError
        A column is not there, or one that is needed is not named.
    """
    wanted = dict.fromkeys((*request.columns.values(), *request.ignore))
    unknown = [column for column in wanted if column not in table.header]
    if unknown:
        raise _unknown(table, request, unknown)
    understood = [name for name in KNOWN if name not in COUNTS] if is_bids(table.path) else ["simulated"]
    if any(name in request.columns for name in COUNTS):
        understood = [name for name in understood if name != "response" and name not in _OF_ONE_TRIAL]
    columns = {name: name for name in understood if name in table.header and name not in wanted}
    return columns | dict(request.columns)


def is_bids(path: Path) -> bool:
    """Return whether a file is a table of events, as BIDS calls it."""
    return bare_stem(path).endswith(bare_stem(Path(TABLE_SUFFIX)))


def require_columns(
    table: Table, columns: Mapping[str, str], request: TableRequest, *, names_tell: bool
) -> None:
    """Raise UsageError if something that is needed is not named.

    Parameters
    ----------
    table, columns, request
        The table, its columns under our names, and what was asked for.
    names_tell
        Whether participants are known from the files' names.
    """

    def missing(what: str, *, ask_participant: bool, otherwise: str = "") -> UsageError:
        found = suggested(table, columns, ask_participant=ask_participant)
        typed = {
            name: theirs for name, theirs in found.items() if name in request.columns or name not in columns
        }
        return UsageError(
            f"{what}; the columns are {', '.join(table.header)}",
            where=str(table.path),
            do=f"say what they are, perhaps {columns_option(typed)}{otherwise}",
        )

    unknown = request.participant is None and not names_tell
    if "participant" not in columns and unknown:
        raise missing("no column is named for participant", ask_participant=True)
    if "participant" not in columns and names_tell and not is_bids(table.path):
        looks = next((name for name in table.header if _is_alike(name, "participant")), None)
        if looks is not None and looks not in request.ignore and looks not in columns.values():
            raise missing(
                f"participants would be taken from the files' names, but there is a column {looks}",
                ask_participant=True,
                otherwise=f", or {words_option('--ignore', [*request.ignore, looks])} to take the names",
            )
    counted = [name for name in COUNTS if name in columns]
    if "response" not in columns and len(counted) < len(COUNTS):
        first = next((name for name in COUNTS if name not in counted), "response")
        raise missing(f"no column is named for {first if counted else 'response'}", ask_participant=unknown)
    if all(name in KNOWN for name in columns):
        raise missing("no factor is named", ask_participant=unknown)


def suggested(table: Table, columns: Mapping[str, str], *, ask_participant: bool = True) -> dict[str, str]:
    """Return columns under our names with which a table can be read, as far as their names and cells show.

    Parameters
    ----------
    table
        The table.
    columns
        Those that were named; they stay.
    ask_participant
        Whether participants must have a column.
    """
    found = dict(columns)
    free = [name for name in table.header if name not in found.values()]
    words = {name: set(map(str.lower, table.column(name))) - FOREIGN_MISSING_WORDS for name in free}

    def take(ours: str, fits: Callable[[str], bool]) -> None:
        theirs = next(filter(fits, free), None)
        if ours not in found and theirs is not None:
            found[ours] = theirs
            free.remove(theirs)

    counts = [name for name in free if words[name] and all(map(_is_count, words[name]))]
    pair = {ours: next((name for name in counts if _is_alike(name, ours)), None) for ours in COUNTS}
    counted = any(name in found for name in COUNTS) or (
        "response" not in found and None not in pair.values() and not _are_answers(words[pair["felt"] or ""])
    )
    if ask_participant:
        take("participant", lambda theirs: _is_alike(theirs, "participant"))
    for name in COUNTS if counted else ():
        take(name, lambda theirs, ours=name: theirs in counts and _is_alike(theirs, ours))  # type: ignore[misc]
        take(name, lambda theirs: theirs in counts)
    if not counted:
        take("response", lambda theirs: _is_alike(theirs, "response") and _are_answers(words[theirs]))
        take("response", lambda theirs: _are_answers(words[theirs]))
        take("response", lambda theirs: _is_alike(theirs, "response"))
    if ask_participant:
        take("participant", lambda theirs: 1 < len(words[theirs]) <= len(table.rows) / 2)
        take("participant", lambda theirs: len(words[theirs]) > 0)
    if not counted:
        take("response", lambda theirs: len(words[theirs]) == 2)  # such as left and right
    if all(name in KNOWN for name in found):
        take("session", lambda theirs: _is_alike(theirs, "session"))
        take("block", lambda theirs: theirs in counts and _is_alike(theirs, "block"))
        take("trial_type", lambda theirs: words[theirs] != set() and words[theirs] <= TRIAL_TYPES.keys())
        some = [name for name in free if words[name]] or free
        several = [name for name in some if 1 < len(words[name]) <= _MOST_FACTOR_LEVELS]
        informative = [name for name in several if _is_informative(name)]
        for name in informative[:_MOST_FACTORS] or (several or some)[:1]:
            found[free_name(name)] = name
    return found


def free_name(name: str) -> str:
    """Return a name like another that no column of the tables has."""
    return name if name not in RESERVED_NAMES and name not in KNOWN else f"{name}_level"


def participants_from_names(paths: Sequence[Path]) -> list[str] | None:
    """Return whose answers each file has, as its name says: as BIDS has it, or by the first word that varies.

    Dates and times are no such words. Where no word varies, the names as a whole.

    Parameters
    ----------
    paths
        The files, more than one; or one of a BIDS name.

    Returns
    -------
    list of str or None
        None for one file without a BIDS name.
    """
    stems = [bare_stem(path) for path in paths]
    labels = [re.match(r"sub-([A-Za-z0-9]+)(?=_|$)", stem) for stem in stems]
    if all(labels):
        return [label[1] for label in labels if label]
    if len(paths) == 1:
        return None
    parts = [re.findall(r"[^_\-. ]+", _DATES.sub("", stem)) for stem in stems]
    for words in zip(*parts, strict=False):
        if len(set(words)) > 1:
            return list(words)
    return stems


def bare_stem(path: Path) -> str:
    """Return a file's name without what its ending says of its form."""
    return _ENDINGS.sub("", path.name) or path.name


def _unknown(table: Table, request: TableRequest, unknown: Sequence[str]) -> UsageError:
    free = [name for name in table.header if name not in request.columns.values()]
    ignored = [name for name in request.ignore if name in unknown]
    if ignored:
        others = [name for name in request.ignore if name not in unknown]
        close = _closest(ignored[0], free)
        advice = (
            f"ignore others, perhaps {words_option('--ignore', [*others, close])}"
            if close
            else "take it out of --ignore"
        )
    else:
        columns = {ours: theirs for ours, theirs in request.columns.items() if theirs not in unknown}
        for ours, theirs in request.columns.items():
            if theirs in unknown and (close := _closest(theirs, free)):
                columns[ours] = close
                free.remove(close)
        advice = f"name others, perhaps {columns_option(suggested(table, columns))}"
    return UsageError(
        f"there is no column {', '.join(map(repr, ignored or unknown))}"
        f"{' to ignore (--ignore)' if ignored else ''}; the columns are {', '.join(table.header)}",
        where=table.where_header,
        do=advice,
    )


def _closest(name: str, names: Sequence[str]) -> str | None:
    by_key = {_key(each): each for each in reversed(names)}
    found = difflib.get_close_matches(_key(name), list(by_key), n=1)
    return by_key[found[0]] if found else None


def _is_alike(name: str, ours: str) -> bool:
    return _ALIKE[ours].fullmatch(_key(name)) is not None


def _key(name: str) -> str:
    return re.sub(r"[\W_]+", "", name.casefold())


def _are_answers(words: Collection[str]) -> bool:
    return bool(words) and all(word in ANSWERS for word in words)


def _is_count(word: str) -> bool:
    value = number(word)
    return value is not None and value >= 0 and value.is_integer()


def _is_informative(name: str) -> bool:
    """Return whether a column's name does not say that it is something else than a factor."""
    return name not in RESERVED_NAMES and not _TELLS_OTHERWISE.search(_key(name))
