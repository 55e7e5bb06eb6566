"""How factors, levels and numbers are written in figures and texts."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autd_analysis.basics.intervals import Interval
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.data.design import Condition, describe_condition
from autd_trials.protocol.schema import Level
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from autd_analysis.data.trials import Trials

MINUS = "\N{MINUS SIGN}"
_UNITS = {"hz": "Hz", "s": "s", "ms": "ms", "mm": "mm", "db": "dB", "pa": "Pa"}
_LONGEST_NAME = 24  # characters of a comparison's name in a figure
_NAMES = {"modulation_hz": "Modulation frequency (Hz)"}


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


def levels_text(condition: Condition) -> str | None:
    """Return a condition for a table's cell, as in ``modulation_hz 25; clothing inner``; None if empty."""
    return "; ".join(f"{name} {level_text(level)}" for name, level in condition) or None


def size_words(trials: "Trials") -> str:
    """Return how many participants and counted trials there are."""
    counted, people = int(trials.table["used"].sum()), len(trials.participants)
    return f"{people} participant{'s' * (people != 1)}, {counted} trial{'s' * (counted != 1)}"


def comparison_names(results: Sequence[ComparisonResult]) -> list[str]:
    """Return a short name for each comparison: where it was made if that tells all apart, else its number."""
    if numbered(results):
        return [str(number) for number in range(1, len(results) + 1)]
    return [_place(result) for result in results]


def numbered(results: Sequence[ComparisonResult]) -> bool:
    """Return whether the comparisons are numbered: they are of different things, or their names are long."""
    different = len({(result.factor, result.first, result.second) for result in results}) > 1
    return different or any(len(_place(result)) > _LONGEST_NAME for result in results)


def _place(result: ComparisonResult) -> str:
    return ", ".join(level_label(level) for _, level in result.at) or "overall"


def comparison_label(result: ComparisonResult) -> str:
    """Return what was compared and where, in full."""
    return (
        f"{difference_label(result)} at {describe_condition(result.at)}"
        if result.at
        else difference_label(result)
    )


def difference_label(result: ComparisonResult) -> str:
    """Return what was subtracted from what, as in ``inner - (inner + outer)``."""
    first, second = (
        f"({label})" if "+" in label else label
        for label in (compared_label(result, result.first), compared_label(result, result.second))
    )
    return f"{first} {MINUS} {second}"


def compared_label(result: ComparisonResult, level: Level) -> str:
    """Return a compared level; a bare number comes with its factor's name."""
    return compared_level(result.factor, level)


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
