"""How factors, levels and numbers are written in figures and texts."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autd_analysis.basics.intervals import Interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Condition, describe_condition
from autd_trials.protocol.schema import Level
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from autd_analysis.data.trials import Trials

MINUS = "\N{MINUS SIGN}"
_UNITS = {"hz": "Hz", "s": "s", "ms": "ms", "mm": "mm", "db": "dB", "pa": "Pa"}
_LONGEST_NAME = 24  # characters of a contrast's name in a figure
_NAMES = {"modulation_hz": "Modulation frequency (Hz)"}
_COUNTS = [
    "no",
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
]


def factor_label(name: str) -> str:
    """Return a factor's name for an axis: ``duration_s`` as ``Duration (s)``."""
    stem, _, last = name.rpartition("_")
    words = f"{stem} ({_UNITS[last]})" if stem and last in _UNITS else name
    return _NAMES.get(name, words[:1].upper() + words[1:].replace("_", " "))


def level_label(level: Level) -> str:
    """Return a level for a figure: ``inner_outer`` as ``inner + outer``."""
    return level_text(level).replace("_", " + ")


def shortened(text: str, characters: int) -> str:
    """Return a text that has at most so many characters."""
    return text if len(text) <= characters else f"{text[: characters - 1].rstrip()}\N{HORIZONTAL ELLIPSIS}"


def size_words(trials: "Trials") -> str:
    """Return how many participants and counted trials there are."""
    counted, people = int(trials.table["used"].sum()), len(trials.participants)
    return f"{people} participant{'s' * (people != 1)}, {counted} trial{'s' * (counted != 1)}"


def contrast_names(contrasts: Sequence[Contrast]) -> list[str]:
    """Return a short name for each contrast: where it was made if that tells all apart, else its number."""
    if numbered(contrasts):
        return [str(number) for number in range(1, len(contrasts) + 1)]
    return [_place(contrast) for contrast in contrasts]


def numbered(contrasts: Sequence[Contrast]) -> bool:
    """Return whether the contrasts are numbered: they are of different things, or their names are long."""
    different = len({contrast.overall for contrast in contrasts}) > 1
    return different or any(len(_place(contrast)) > _LONGEST_NAME for contrast in contrasts)


def _place(contrast: Contrast) -> str:
    return ", ".join(level_label(level) for _, level in contrast.at) or "overall"


def contrast_label(contrast: Contrast) -> str:
    """Return what was compared and where, in full."""
    difference = difference_label(contrast)
    return f"{difference} at {describe_condition(contrast.at)}" if contrast.at else difference


def difference_label(contrast: Contrast) -> str:
    """Return what was subtracted from what, as in ``inner - (inner + outer)``."""
    first, second = (f"({label})" if "+" in label else label for label in compared_labels(contrast))
    return f"{first} {MINUS} {second}"


def compared_labels(contrast: Contrast) -> tuple[str, str]:
    """Return the two levels; a bare number comes with its factor's name."""
    return compared_level(contrast.factor, contrast.first), compared_level(contrast.factor, contrast.second)


def compared_level(factor: str, level: Level) -> str:
    """Return a level of a factor; a bare number comes with the factor's name."""
    return level_label(level) if isinstance(level, str) else f"{factor} {level_text(level)}"


def format_p(p: float | None) -> str:
    """Return a p value with two significant digits; "n/a" if there is none."""
    if p is None:
        return "n/a"
    if p < 0.0001:
        return "< .0001"
    text = f"{p:.2g}" if p < 0.995 else "1"
    return text.removeprefix("0")


def p_equals(p: float | None) -> str:
    """Return a p value as an equation, as in ``p = .031`` or ``p < .0001``."""
    text = format_p(p)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def format_rate(rate: float | None) -> str:
    """Return a rate or a difference of rates with two decimals."""
    # 0 is added so that what rounds to nothing has no sign.
    return "n/a" if rate is None else f"{round(rate, 2) + 0:.2f}".replace("-", MINUS)


def format_interval(interval: Interval | None) -> str:
    """Return an interval as ``[0.20, 0.35]``; ``[n/a]`` if there is none."""
    return "[n/a]" if interval is None else f"[{format_rate(interval.low)}, {format_rate(interval.high)}]"


def place_words(condition: Condition) -> str:
    """Return a condition in a sentence, as in ``at modulation frequency 25 Hz and clothing inner``."""
    return f"at {and_words([_level(name, level) for name, level in condition])}" if condition else ""


def _level(name: str, level: Level) -> str:
    words, unit = words_and_unit(name)
    return f"{words} {level_label(level)}{unit}"


def words_and_unit(name: str) -> tuple[str, str]:
    """Return a factor's name in a sentence and, with a blank before it, its unit; "" without one."""
    words, _, unit = factor_label(name).partition(" (")
    return words[:1].lower() + words[1:], f" {unit.removesuffix(')')}" if unit else ""


def counted_words(number: int, thing: str) -> str:
    """Return how many there are, as in ``three participants``."""
    words = _COUNTS[number] if number < len(_COUNTS) else str(number)
    return f"{words} {thing}{'s' * (number != 1)}"


def was(number: int) -> str:
    """Return the verb that goes with a number of things."""
    return "was" if number == 1 else "were"


def and_words(parts: Sequence[str]) -> str:
    """Return parts as a list in a sentence."""
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]


def upper_first(text: str) -> str:
    """Return a text with which a sentence can begin."""
    return text[:1].upper() + text[1:]
