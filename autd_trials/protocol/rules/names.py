"""Names, levels and texts that tables, figures, data sets and other programs can take as they are."""

import unicodedata
from collections.abc import Iterator

from pydantic_core import InitErrorDetails

from autd_trials.protocol.conditions import Location
from autd_trials.protocol.rules.fault import fault, unknown
from autd_trials.protocol.schema import Factor, Level, Protocol, StimulusSpec
from autd_trials.tables import MISSING_WORDS, RESERVED_NAMES, level_text, number
from autd_trials.yamlfile import did_you_mean

SMALLEST_LEVEL, LARGEST_LEVEL = 1e-6, 1e9

_MISSING_WORDS = MISSING_WORDS | {"none", "null", "nil", "nat"}
_NUMBER_WORDS = frozenset({"inf", "infinity"})
_TRUTH_WORDS = frozenset({"true", "false", "t", "f", "yes", "no", "y", "n", "on", "off"})
_DEVICE_NAMES = frozenset(
    {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(10))}
)
_ONE_LINE = ("title", "license", "institution_name", "institution_address", "department", "ethics_approval")
_TURNING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def name_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    """Yield names, levels and texts that would be misread after they left the protocol."""
    if protocol.name.casefold() in _DEVICE_NAMES:
        yield fault(("name",), f"{protocol.name!r} is no name of a folder on Windows; use another one")
    for name in protocol.targets:
        yield from _word_faults(name, ("targets", name))
    yield from _factor_faults(protocol)
    yield from _text_faults(protocol)


def _factor_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    within, between = protocol.factors.within_block, protocol.factors.between_blocks
    fields = StimulusSpec.model_fields
    for place, factors in (("within_block", within), ("between_blocks", between)):
        for name, factor in factors.items():
            location = ("factors", place, name)
            yield from _factor_name_faults(name, location)
            yield from _level_faults(factor, location)
            yield from _sentence_faults(factor, location)
    for name in within:
        if name in between:
            message = f"{name!r} cannot vary both within and between blocks"
            yield fault(("factors", "between_blocks", name), message)
        if name not in fields:
            message = (
                f"nothing can vary {name!r} from trial to trial: within a block only the stimulus changes"
            )
            allowed = f"; allowed: {', '.join(sorted(fields))}"
            yield fault(("factors", "within_block", name), message + allowed + did_you_mean(name, fields))


def _factor_name_faults(name: str, location: Location) -> Iterator[InitErrorDetails]:
    if name in RESERVED_NAMES:
        yield fault(location, f"{name!r} is a column of the tables already; name the factor otherwise")
    yield from _word_faults(name, location)


def _word_faults(word: str, location: Location) -> Iterator[InitErrorDetails]:
    """Yield a word that programs take for something else than a word."""
    folded = word.casefold()
    if folded in _MISSING_WORDS:
        meaning = "a missing value"
    elif folded in _NUMBER_WORDS or number(word) is not None:
        meaning = "a number"
    elif folded in _TRUTH_WORDS:
        meaning = "true or false"
    else:
        return
    yield fault(location, f"{word!r} would be read as {meaning} by other programs; use another word")


def _level_faults(factor: Factor, location: Location) -> Iterator[InitErrorDetails]:
    """Yield levels of two kinds, and levels that are one to whoever reads them."""
    before: dict[str, Level] = {}
    for index, level in enumerate(factor.levels):
        place = (*location, "levels", index)
        if isinstance(level, str) != isinstance(factor.levels[0], str):
            yield fault(place, "numbers and words do not mix in one factor")
        look = level.casefold() if isinstance(level, str) else f"{level + 0.0:.6g}"
        if look in before:
            yield fault(place, _same(level, before[look]))
        before.setdefault(look, level)
        if isinstance(level, str):
            yield from _word_faults(level, place)
        elif level != 0 and not SMALLEST_LEVEL <= abs(level) <= LARGEST_LEVEL:
            message = f"the level {level:g} is not within {SMALLEST_LEVEL:g} to {LARGEST_LEVEL:g}"
            yield fault(place, f"{message}; choose another unit")


def _same(level: Level, other: Level) -> str:
    if level == other:
        return f"the level {level_text(level)} is given twice"
    what = "capitals" if isinstance(level, str) else "the seventh digit"
    return f"the levels {level_text(other)} and {level_text(level)} differ only in {what}; put them apart"


def _sentence_faults(factor: Factor, location: Location) -> Iterator[InitErrorDetails]:
    """Yield sentences about no level."""
    spelled = [level_text(level) for level in factor.levels]
    for level, sentence in factor.describe.items():
        place = (*location, "describe", level)
        if level not in spelled:
            yield fault(place, unknown("level", level, spelled))
        yield from _line_faults(sentence, place)


def _text_faults(protocol: Protocol) -> Iterator[InitErrorDetails]:
    study = protocol.study
    for key in _ONE_LINE:
        yield from _line_faults(getattr(study, key), ("study", key))
    for index, author in enumerate(study.authors):
        yield from _line_faults(author, ("study", "authors", index))
    texts = {
        ("description",): protocol.description,
        ("instructions",): protocol.instructions,
        ("response", "question"): protocol.response.question,
    }
    for location, text in texts.items():
        yield from _character_faults(text, location)


def _line_faults(text: str, location: Location) -> Iterator[InitErrorDetails]:
    if len(text.strip().splitlines()) > 1:
        yield fault(location, "this text has several lines; write it in one")
    yield from _character_faults(text, location)


def _character_faults(text: str, location: Location) -> Iterator[InitErrorDetails]:
    """Yield what cannot be seen: no character at all, or one that turns the text around it."""
    if not any(unicodedata.category(character)[0] in "LNPS" for character in text):
        yield fault(location, "nothing of this text can be seen; write some")
    for character in sorted(_TURNING.intersection(text)):
        message = f"contains U+{ord(character):04X}, which turns the text around it; remove it"
        yield fault(location, f"this text {message}")
