"""What words for answers, types and status of trials mean over all lines; a refusal where they do not."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence

from autd_analysis.data.foreign.request import TableRequest, choice_option, columns_option, words_option
from autd_analysis.data.foreign.row import Line
from autd_analysis.data.foreign.words import TRIAL_STATUS, TRIAL_TYPES, answers, few, is_missing
from autd_trials.errors import UsageError
from autd_trials.tables import number

_LIKE_CATCH = re.compile(
    r"^(1|true|yes)$|catch|no|blank|absent|null|sham|empty|zero|ohne|kein", re.IGNORECASE
)


def trial_types(lines: Sequence[Line]) -> dict[str, str]:
    """Return what each word for a type of trial means."""
    found = Counter(line.cells["trial_type"] for line in lines)
    types = {word: TRIAL_TYPES.get(word.lower(), "") for word in found}
    types |= {word: "stimulus" for word in found if is_missing(word)}
    unknown = sorted(word for word, kind in types.items() if not kind)
    if unknown:
        first = next(line for line in lines if line.cells["trial_type"] in unknown)
        catch = min(unknown, key=lambda word: (not _LIKE_CATCH.search(word), found[word]))
        raise UsageError(
            f"trial_type is {', '.join(map(repr, unknown[:5]))}",
            where=first.where,
            do="write stimulus, catch or practice, or say which is that of catch trials: "
            f"{choice_option('--catch', 'trial_type', catch)}",
        )
    return types


def refuse_status(lines: Sequence[Line], request: TableRequest) -> None:
    """Raise UsageError if a word for the status of a trial is not understood."""
    found = dict.fromkeys(line.cells["trial_status"] for line in lines)
    unknown = [word for word in found if word.lower() not in TRIAL_STATUS]
    if unknown:
        rest = {ours: theirs for ours, theirs in request.columns.items() if ours != "trial_status"}
        first = next(line for line in lines if line.cells["trial_status"] in unknown)
        raise UsageError(
            f"trial_status is {few([repr(word) for word in unknown])}",
            where=first.where,
            do="write complete or interrupted, or leave it out: "
            + (
                columns_option(rest)
                if len(unknown) == len(found)
                else choice_option("--exclude", "trial_status", *unknown)
            ),
        )


def understood_answers(lines: Sequence[Line], request: TableRequest) -> dict[str, bool | None]:
    """Return what each answer means."""
    found = Counter(line.cells["response"] for line in lines)
    understood = answers(found, request.yes)
    unknown = [word for word in found if word not in understood]
    if unknown:
        first = next(line for line in lines if line.cells["response"] in unknown)
        if not request.yes and _are_rates(found):
            raise UsageError(
                f"response is {few([repr(word) for word in unknown])}, which is no answer but a rate",
                where=first.where,
                do="give a line a trial, or counts: felt=COLUMN,n=COLUMN in --columns",
            )
        stray = sum(found[word] for word in unknown) * 10 < len(lines) and len(unknown) <= 5
        advice = (
            f"write 1, 0 or n/a, or leave such lines out: {first.excluding('response')}"
            if stray
            else f"say which mean felt, as in {words_option('--yes', [_likely_yes(unknown)])}"
        )
        raise UsageError(
            f"response is {few([repr(word) for word in unknown])}, which is no yes or no",
            where=first.where,
            do=advice,
        )
    if request.yes and True not in understood.values():
        words = [word for word, meaning in understood.items() if meaning is not None]
        raise UsageError(
            f"no answer is {' or '.join(request.yes)}; they are {few(words) or 'all missing'}",
            where="--yes",
            do=f"name some of them, as in {words_option('--yes', [_likely_yes(words)])}" if words else None,
        )
    return understood


def _are_rates(found: Iterable[str]) -> bool:
    """Return whether answers are shares of trials."""
    values = [number(word) for word in found]
    shares = [value for value in values if value is not None and 0 <= value <= 1]
    return len(shares) == len(values) and len(set(shares) - {0, 1}) > 1


def _likely_yes(words: Sequence[str]) -> str:
    """Return which of the answers may mean felt: the largest number, or the first word."""
    numbers = [word for word in words if number(word) is not None]
    return (
        max(numbers, key=lambda word: number(word) or 0) if len(numbers) == len(words) else sorted(words)[0]
    )
