"""Words in figures by their measured size: broken into lines, never cut."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from autd_analysis.report.fonts import FIRST, can_be_bold
from autd_analysis.report.wording import lines_isolated

POINTS_PER_INCH = 72
LINE_HEIGHT = 1.25
"""Of a line of text, times the size of its letters."""

# Where a line may end: after a blank or a sign that joins words, and between two characters of a script that
# has no blanks.
_BREAK = re.compile(
    r"(?<=[\s\-_/,;+.\N{EN DASH}])(?=\S)|(?<=[\u3000-\u9fff\uf900-\uffef])(?=[\u3041-\u9fff\uf900-\ufaff])"
)


@dataclass(frozen=True)
class TickLabels:
    """Labels of places along an axis as they fit there.

    Attributes
    ----------
    texts
        The labels, broken into lines.
    size
        Of the letters, in points.
    upright
        Whether they run upwards.
    height_in
        What they take below the axis.
    """

    texts: tuple[str, ...]
    size: float
    upright: bool
    height_in: float


def width_in(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width of a line of text in inches, in the fonts of the figure style that is on.

    Parameters
    ----------
    text
        One line.
    size
        Of the letters, in points.
    bold
        Whether they are bold.
    """
    import matplotlib as mpl

    families = (FIRST,) if bold and can_be_bold(text) else tuple(mpl.rcParams["font.family"])
    return _width_em(text, families, bold and can_be_bold(text)) * size / POINTS_PER_INCH


def bold_face(text: str) -> dict[str, str]:
    """Return the face of a text that is to be bold, as matplotlib takes it; an ordinary one if need be."""
    return {"fontfamily": FIRST, "fontweight": "bold"} if can_be_bold(text) else {}


def broken(text: str, room_in: float, size: float, *, bold: bool = False) -> list[str]:
    """Return a text as lines that fit into a width; a word that is longer is broken wherever it must be."""
    lines: list[str] = []
    for word in (part for whole in _BREAK.split(text) for part in _parts(whole, room_in, size, bold=bold)):
        if lines and width_in(f"{lines[-1]}{word}".rstrip(), size, bold=bold) <= room_in:
            lines[-1] += word
        else:
            lines.append(word)
    return lines_isolated([line.rstrip() for line in lines] or [""])


def all_broken(texts: Iterable[str], room_in: float, size: float) -> tuple[str, ...]:
    """Return texts as lines, each text beginning a new one."""
    return tuple(line for text in texts for line in broken(text, room_in, size))


def line_in(size: float) -> float:
    """Return the height of a line in inches."""
    return LINE_HEIGHT * size / POINTS_PER_INCH


def tick_labels(labels: Sequence[str], place_in: float) -> TickLabels:
    """Return labels as they fit side by side, each at its place: as large as can be, upright if need be.

    Parameters
    ----------
    labels
        One for each place.
    place_in
        The distance of two places in inches.
    """
    room_in = 0.94 * place_in
    for size in (8.0, 7.0, 6.0):
        words = [part for label in labels for part in _BREAK.split(label)]
        if max(width_in(word.rstrip(), size) for word in words) <= room_in:
            texts = [broken(label, room_in, size) for label in labels]
            lines = max(map(len, texts))
            if lines <= _MOST_LINES:
                return TickLabels(tuple(map("\n".join, texts)), size, False, lines * line_in(size))
    return _upright(labels, room_in)


_MOST_LINES = 4
_LONGEST_UPRIGHT_IN = 1.5


def _upright(labels: Sequence[str], room_in: float) -> TickLabels:
    for size in (7.0, 6.0, 5.0, 4.0):
        texts = [broken(label, _LONGEST_UPRIGHT_IN, size) for label in labels]
        if max(map(len, texts)) * line_in(size) <= room_in:
            break
    else:
        texts = [[label] for label in labels]
    height_in = max(width_in(line, size) for lines in texts for line in lines)
    return TickLabels(tuple(map("\n".join, texts)), size, True, height_in)


def _parts(word: str, room_in: float, size: float, *, bold: bool) -> list[str]:
    """Return a word whole if it fits, else as parts that do."""
    if width_in(word.rstrip(), size, bold=bold) <= room_in:
        return [word]
    parts = [""]
    for letter in word:
        if parts[-1] and width_in(parts[-1] + letter.rstrip(), size, bold=bold) > room_in:
            parts.append("")
        parts[-1] += letter
    return parts


@lru_cache(maxsize=20_000)
def _width_em(text: str, families: tuple[str, ...], bold: bool) -> float:
    """Return a width in sizes of the letters."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font = FontProperties(family=list(families), size=100, weight="bold" if bold else "normal")
    return float(TextToPath().get_text_width_height_descent(text, font, ismath=False)[0]) / 100
