"""What the words in somebody's table mean: labels that are one, answers, levels that are numbers."""

import re
import unicodedata
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

from autd_trials.protocol.schema import Level
from autd_trials.tables import FOREIGN_MISSING_WORDS, MISSING_WORDS, level_text, quantity

_RIGHT = {
    **dict.fromkeys(("correct", "richtig", "korrekt"), True),
    **dict.fromkeys(("incorrect", "wrong"), False),
}
ANSWERS = {
    **dict.fromkeys(("felt", "detected", "1", "1.0", "true", "yes", "y"), True),
    **dict.fromkeys(("not_felt", "not felt", "not detected", "0", "0.0", "false", "no", "n"), False),
    **dict.fromkeys(("ja", "wahr", "vrai", "oui", "vero", "verdadero", "verdadeiro", "\u306f\u3044"), True),
    **dict.fromkeys(("nein", "falsch", "faux", "non", "falso", "\u3044\u3044\u3048"), False),
    **_RIGHT,
}
"""What answers mean, in small letters: whether something was felt, or the answer was right."""

TRIAL_TYPES = {
    **dict.fromkeys(("stimulus", "stim", "signal"), "stimulus"),
    **dict.fromkeys(("catch", "blank", "noise"), "catch"),
    **dict.fromkeys(("practice", "training"), "practice"),
}
"""What words for the type of a trial mean, in small letters."""

TRIAL_STATUS = {
    **dict.fromkeys((*MISSING_WORDS, "complete", "completed"), "complete"),
    "interrupted": "interrupted",
}
"""What words for the status of a trial mean, in small letters."""

SPREADSHEET_ERROR = re.compile(r"#[A-Z\u00c4\u00d6\u00dc/0-9_]+[!?]", re.IGNORECASE)
"""What a spreadsheet writes where it cannot compute a cell."""

_MOST_NAMED = 5
_WHOLE_LABEL = re.compile(r"[+-]?[0-9]{1,40}(\.[0-9]{1,40})?")
_MONTH = r"(jan|feb|m(a|\u00e4)r|mrz|apr|ma(i|y)|jun|jul|aug|sep|o(c|k)t|nov|de(c|z))[a-z]*\.?"
_DATE = re.compile(
    rf"\d{{1,2}}[-. ]+{_MONTH}([-. ]+\d{{2,4}})?|{_MONTH}[-. ]+\d{{1,4}}|\d{{1,2}}[./]\d{{1,2}}[./]\d{{2,4}}"
    r"|\d{4}-\d\d-\d\d.*",
    re.IGNORECASE,
)
_RIGHT_OR_WRONG = frozenset(("correct", "iscorrect", "accuracy", "acc", "richtig", "korrekt", "corr"))


def plain_words(text: str) -> str:
    """Return a cell's text in one spelling of its signs, with single spaces."""
    return " ".join(text.split() if text.isascii() else unicodedata.normalize("NFC", text).split())


def is_missing(text: str) -> bool:
    """Return whether a cell of words says that it has none."""
    return text.lower() in MISSING_WORDS


def is_same(cell: str, value: str) -> bool:
    """Return whether a cell says a value that was typed: the same word or number, or that it is missing."""
    if is_missing(cell) or is_missing(value):
        return is_missing(cell) and is_missing(value)
    if cell.casefold() == value.casefold():
        return True
    found, asked = quantity(cell), quantity(value.replace(",", ".") if value.count(",") == 1 else value)
    if found is None or asked is None:
        return False
    return found[0] == asked[0] and asked[1] in ("", found[1])


def one_label(labels: Iterable[str]) -> dict[str, str]:
    """Return the label of each spelling: those that read as one number are one, as 1, 01 and 1.0.

    A spelling that is alone keeps its zeros in front.
    """
    spellings: dict[Decimal, list[str]] = defaultdict(list)
    found = {label: label for label in labels}
    for label in found:
        if _WHOLE_LABEL.fullmatch(label):
            spellings[Decimal(label)].append(label)
    for value, words in spellings.items():
        shortest = format(value, "f")
        shortest = shortest.rstrip("0").rstrip(".") if "." in shortest else shortest
        for word in words:
            alone = len(words) == 1
            found[word] = re.sub(r"\.0+$", "", word) if alone else shortest
    return found


def joined_labels(what: str, labels: Mapping[str, str]) -> Iterator[str]:
    """Yield a sentence if several spellings were taken as one."""
    groups: dict[str, list[str]] = defaultdict(list)
    for spelling, label in labels.items():
        groups[label].append(spelling)
    joined = [
        f"{' and '.join(sorted(words))} (as {label})" for label, words in groups.items() if len(words) > 1
    ]
    if joined:
        more = f" and {len(joined) - 5} more" if len(joined) > 5 else ""
        yield f"{what} that read as one number are taken as one: {'; '.join(joined[:5])}{more}"


def answers(found: Collection[str], yes: Collection[str]) -> dict[str, bool | None]:
    """Return what each answer means; None where there is none. What is not understood is left out.

    Parameters
    ----------
    found
        The answers as they are written.
    yes
        Those that mean felt; if there are any, all others mean not felt, and if there are no others, that
        there is no answer does.
    """
    meaning: dict[str, bool | None] = {}
    for word in found:
        if yes and any(is_same(word, each) for each in yes):
            meaning[word] = True
        elif word.lower() in FOREIGN_MISSING_WORDS:
            meaning[word] = None
        elif yes:
            meaning[word] = False
        elif word.lower() in ANSWERS:
            meaning[word] = ANSWERS[word.lower()]
    if yes and False not in meaning.values():  # whoever felt nothing pressed nothing
        meaning = {word: bool(means) for word, means in meaning.items()}
    return meaning


def are_right_or_wrong(column: str, found: Iterable[str]) -> bool:
    """Return whether answers are right or wrong, rather than felt or not: by their column or their words."""
    key = re.sub(r"[\W_]+", "", column.casefold())
    return (
        key in _RIGHT_OR_WRONG
        or key.endswith(("acc", "corr", "correct"))
        or any(w.lower() in _RIGHT for w in found)
    )


@dataclass(frozen=True)
class Levels:
    """The levels that a factor's words are.

    Attributes
    ----------
    of
        The level of each word; None of words that say that there is none.
    unit
        The unit that all its numbers have behind them.
    remark
        Why what looks like numbers was taken as words; empty if it was not.
    """

    of: dict[str, Level | None]
    unit: str = ""
    remark: str = ""

    @property
    def ordered(self) -> tuple[Level, ...]:
        """The levels by size; words as a person counts, c2 before c10."""
        return tuple(
            sorted(dict.fromkeys(level for level in self.of.values() if level is not None), key=order)
        )

    def level(self, text: str) -> Level | None:
        """Return the level that a person means by a text, with its unit or without; None if it is none."""
        numbers = any(isinstance(level, float) for level in self.of.values())
        if not numbers:
            return text if text in self.of.values() else None
        found = quantity(text.replace(",", ".") if text.count(",") == 1 else text)
        return found[0] if found and found[1] in ("", self.unit) else None


def levels_of(words: Collection[str]) -> Levels:
    """Return the levels that the words in a factor's column are: numbers if all are, else words."""
    missing = {word: None for word in words if is_missing(word)}
    others = [word for word in words if word not in missing]
    found = {word: quantity(word) for word in others}
    strange = [word for word, value in found.items() if value is None]
    # Beside numbers such words say that there is none; beside words, "none" may be a level.
    if (
        strange
        and len(strange) < len(others)
        and all(word.lower() in FOREIGN_MISSING_WORDS for word in strange)
    ):
        missing |= dict.fromkeys(strange)
        others = [word for word in others if word not in missing]
        strange = []
    units = {value[1] for value in found.values() if value is not None}
    sizes = {value[0] for value in found.values() if value is not None}
    if others and not strange and len(units) == 1 and (len(sizes) > 1 or units == {""}):
        numbers: dict[str, Level | None] = {
            word: value[0] for word, value in found.items() if value is not None
        }
        return Levels({**missing, **numbers}, units.pop())
    return Levels({**missing, **{word: word for word in others}}, remark=_no_numbers(others, strange, units))


def _no_numbers(words: Collection[str], strange: Collection[str], units: Collection[str]) -> str:
    dates = sorted(word for word in words if _DATE.fullmatch(word))
    if dates:
        return f"{dates[0]} looks like a date that a spreadsheet made of a number"
    grouped = sorted(
        word for word in strange if re.fullmatch(r"[+-]?[\d.,' ]*\d[.,']\d[\d.,' ]*\D{0,8}", word)
    )
    if grouped:
        return f"it is not clear whether signs in {max(grouped, key=len)} are decimal or group thousands"
    if not strange and len(words) > 1:
        shown = [unit or "none" for unit in sorted(units)]
        return f"they have different units: {', '.join(shown[:5])}"
    if strange and len(words) - len(strange) > 1:
        return f"{sorted(strange)[0]} is no number"
    return ""


def order(level: Level) -> tuple[int, float, list[tuple[float, str]], str]:
    """Return a key that sorts numbers by size, and words after them as a person counts."""
    if isinstance(level, float):
        return 0, level, [], ""
    parts = re.split(r"([0-9]{1,15})", level.casefold())
    counted = [(float(part), "") if part.isascii() and part.isdigit() else (-1.0, part) for part in parts]
    return 1, 0.0, counted, level


def spelled(levels: Iterable[Level]) -> str:
    """Return levels in a row, the first twenty."""
    words = [level_text(level) for level in levels]
    more = f" and {len(words) - 20} more" if len(words) > 20 else ""
    return ", ".join(words[:20]) + more


def few(words: Sequence[str]) -> str:
    """Return words in a row, the first five."""
    more = f" and {len(words) - _MOST_NAMED} more" if len(words) > _MOST_NAMED else ""
    return ", ".join(words[:_MOST_NAMED]) + more
