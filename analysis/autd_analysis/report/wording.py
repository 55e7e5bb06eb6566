"""How factors, levels and numbers are written in figures and texts."""

import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from typing import TYPE_CHECKING

from autd_analysis.basics.intervals import Interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Condition, Design, StudyFactor
from autd_trials.protocol.schema import Level
from autd_trials.tables import level_text

if TYPE_CHECKING:
    from autd_analysis.data.trials import Trials

MINUS = "\N{MINUS SIGN}"
THIN = "\N{NARROW NO-BREAK SPACE}"
"""Between a number and its unit."""

_UNITS = {"hz": "Hz", "s": "s", "ms": "ms", "mm": "mm", "db": "dB", "pa": "Pa"}
_TITLES = {"modulation_hz": "Modulation frequency (Hz)"}
_WITH_UNIT = re.compile(r"(.+) \(([^()]+)\)")
_LONGEST_LABEL = 32
"""Characters of a protocol's description of a level that serves as its label; longer ones are sentences."""
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
_ISOLATE, _POP = "\N{FIRST STRONG ISOLATE}", "\N{POP DIRECTIONAL ISOLATE}"
_RIGHT_TO_LEFT = {"R", "AL", "AN", "RLE", "RLO", "RLI"}

SIMULATED = "SIMULATED PARTICIPANTS: not human data"
"""What stands on everything that was made from simulated participants."""


@dataclass(frozen=True)
class Labels:
    """What the factors of a study and their levels are called, each level of a factor differently.

    Names that are written from right to left are isolated, so that they turn no number beside them round.

    Attributes
    ----------
    titles
        Factors, with their unit in brackets where they have one.
    levels
        The levels of each factor.
    """

    titles: Mapping[str, str]
    levels: Mapping[str, Mapping[Level, str]]

    def title(self, name: str) -> str:
        """Return a factor's name for an axis: ``duration_s`` as ``Duration (s)``."""
        return isolated(self.titles.get(name) or _title(name))

    def words(self, name: str) -> str:
        """Return a factor's name within a sentence, without its unit: ``duration``."""
        words, _ = self._words_and_unit(name)
        return isolated(words if words[1:2].isupper() else words[:1].lower() + words[1:])

    def named(self, name: str) -> str:
        """Return a factor's name within a label: ``duration in s``."""
        _, unit = self._words_and_unit(name)
        return f"{self.words(name)} in {unit}" if unit else self.words(name)

    def level(self, name: str, level: Level) -> str:
        """Return a level for a place where its factor is named."""
        return isolated(self.levels.get(name, {}).get(level, level_text(level)))

    def quantity(self, name: str, level: Level) -> str:
        """Return a level, a number with its unit: ``25 Hz``."""
        _, unit = self._words_and_unit(name)
        bare = isinstance(level, float | int) and self._bare(name, level)
        return f"{self.level(name, level)}{THIN}{unit}" if bare and unit else self.level(name, level)

    def strip(self, name: str, level: Level) -> str:
        """Return a level with its factor, for a heading: ``Clothing: inner``."""
        words, _ = self._words_and_unit(name)
        return f"{isolated(words)}: {self.quantity(name, level)}"

    def stated(self, name: str, level: Level) -> str:
        """Return a level within a sentence, with its factor where that would not be clear."""
        label, quantity = self.level(name, level), self.quantity(name, level)
        number = isinstance(level, float | int) and self._bare(name, level)
        elsewhere = (
            quantity == self.quantity(other, each)
            for other, its_levels in self.levels.items()
            if other != name
            for each in its_levels
        )
        alone = (not number or quantity != label) and not any(elsewhere)
        return quantity if alone else f"{self.words(name)} {quantity}"

    def condition(self, condition: Condition) -> str:
        """Return a condition within a sentence, as in ``25 Hz, inner``; empty for the empty one."""
        return ", ".join(self.stated(name, level) for name, level in condition)

    def sides(self, contrast: Contrast) -> tuple[str, str]:
        """Return the two levels of a contrast within a sentence."""
        return self.stated(contrast.factor, contrast.first), self.stated(contrast.factor, contrast.second)

    def difference(self, contrast: Contrast) -> str:
        """Return what is subtracted from what, as in ``inner - (inner + outer)``."""
        joined = {"+", "-", MINUS}
        return f" {MINUS} ".join(
            f"({side})" if joined & {*side.split()} else side for side in self.sides(contrast)
        )

    def contrast(self, contrast: Contrast) -> str:
        """Return what is compared and where, in full."""
        difference = self.difference(contrast)
        return f"{difference}, {self.condition(contrast.at)}" if contrast.at else difference

    def place(self, condition: Condition) -> str:
        """Return a condition as ``at modulation frequency 25 Hz and clothing inner``; empty for none."""
        parts = [f"{self.words(name)} {self.quantity(name, level)}" for name, level in condition]
        return f"at {and_words(parts)}" if parts else ""

    def _bare(self, name: str, level: Level) -> bool:
        """Return whether a level is called by its number."""
        return self.levels.get(name, {}).get(level, level_text(level)) == level_text(level)

    def _words_and_unit(self, name: str) -> tuple[str, str]:
        title = self.titles.get(name) or _title(name)
        found = _WITH_UNIT.fullmatch(title)
        return (found[1], found[2]) if found else (title, "")


def study_labels(design: Design) -> Labels:
    """Return the labels of a study: what a person said, else the protocol's short descriptions, else names.

    Parameters
    ----------
    design
        The study's design.
    """
    titles = {factor.name: _printable(factor.title or _title(factor.name)) for factor in design.factors}
    doubled = {name for name, title in titles.items() if list(titles.values()).count(title) > 1}
    return Labels(
        titles={name: _printable(name) if name in doubled else title for name, title in titles.items()},
        levels={factor.name: _level_labels(factor) for factor in design.factors},
    )


def isolated(text: str) -> str:
    """Return a text that is, or may be, from right to left between marks that keep what is beside it.

    Unicode's bidirectional algorithm (UAX 9, 2.4.2): isolates are characters without width.
    """
    if text.startswith(_ISOLATE) or not any(
        unicodedata.bidirectional(each) in _RIGHT_TO_LEFT for each in text
    ):
        return text
    return f"{_ISOLATE}{text}{_POP}"


def lines_isolated(lines: Sequence[str]) -> list[str]:
    """Return the lines of a broken text so that each closes the isolates it opens."""
    whole, within = [], False
    for line in lines:
        opened = f"{_ISOLATE if within else ''}{line}"
        within = opened.count(_ISOLATE) > opened.count(_POP)
        whole.append(f"{opened}{_POP if within else ''}")
    return whole


def size_words(trials: "Trials") -> str:
    """Return how many participants and counted trials there are."""
    counted, people = int(trials.table["used"].sum()), len(trials.participants)
    return f"{people} participant{'s' * (people != 1)}, {counted} trial{'s' * (counted != 1)}"


def direction(difference: float) -> int:
    """Return the sign of a difference as it is printed: 0 for what is 0.00 on paper."""
    shown = round(difference, 2)
    return (shown > 0) - (shown < 0)


def format_p(p: float | None) -> str:
    """Return a p value as journals print it, with three decimals; "n/a" if there is none.

    >>> format_p(0.0042), format_p(0.00002), format_p(0.9999), format_p(1.0)
    ('.004', '< .001', '> .999', '1')
    >>> format_p(0.0625)
    '.063'
    """
    if p is None:
        return "n/a"
    if p < 0.001:
        return "< .001"
    if p > 0.9995:
        return "1" if p == 1 else "> .999"
    # Least p of exact tests are halves at the last digit, .0625 say: they go up, as everybody does it.
    return str(Decimal(p).quantize(Decimal("0.001"), ROUND_HALF_UP)).removeprefix("0")


def p_equals(p: float | None) -> str:
    """Return a p value as an equation, as in ``p = .031`` or ``p < .001``."""
    text = format_p(p)
    return f"p {text}" if text[0] in "<>" else f"p = {text}"


def format_rate(rate: float | None) -> str:
    """Return a rate, a difference of rates or a correlation: two decimals, no zero before the point.

    >>> format_rate(0.354), format_rate(-0.2), format_rate(1.0), format_rate(-0.001)
    ('.35', '\N{MINUS SIGN}.20', '1.00', '.00')
    """
    return (
        format_number(rate).replace("0.", ".", 1)
        if rate is not None and abs(rate) < 0.995
        else format_number(rate)
    )


def format_number(number: float | None) -> str:
    """Return a number that may be over 1, with two decimals."""
    # 0 is added so that what rounds to nothing has no sign.
    return "n/a" if number is None else f"{round(number, 2) + 0:.2f}".replace("-", MINUS)


def format_level(level: float | None) -> str:
    """Return an estimated level with three significant digits.

    >>> format_level(0.01112), format_level(43.96)
    ('0.0111', '44')
    """
    return "n/a" if level is None else level_text(float(f"{level:.3g}")).replace("-", MINUS)


def format_interval(interval: Interval | None, written: Callable[[float | None], str] = format_rate) -> str:
    """Return an interval as ``[.20, .35]``; ``[n/a]`` if there is none."""
    return "[n/a]" if interval is None else f"[{written(interval.low)}, {written(interval.high)}]"


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


def _title(name: str) -> str:
    stem, _, last = name.rpartition("_")
    words = f"{stem} ({_UNITS[last]})" if stem and last in _UNITS else name
    return _TITLES.get(name, words[:1].upper() + words[1:].replace("_", " "))


def _level_labels(factor: StudyFactor) -> dict[Level, str]:
    """Return what levels are called; two that would be called the same keep their own spelling."""
    described = {
        level: factor.describe.get(level_text(level), "").strip().removesuffix(".") for level in factor.levels
    }
    short = all(0 < len(text) <= _LONGEST_LABEL for text in described.values())
    chosen = {
        level: _printable(factor.labels.get(level) or (described[level] if short else level_text(level)))
        for level in factor.levels
    }
    taken = list(chosen.values())
    return {
        level: label if taken.count(label) == 1 else _printable(level_text(level))
        for level, label in chosen.items()
    }


def _printable(text: str) -> str:
    """Return a text in one line, without characters that show nothing or control something."""
    kept = (
        "\N{REPLACEMENT CHARACTER}" if unicodedata.category(each) in ("Cc", "Cs", "Co", "Cn") else each
        for each in " ".join(text.split())
    )
    marks = {*"\u200e\u200f\u061c\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"}
    return "".join(each for each in kept if each not in marks)
