"""Which installed fonts can write what figures say, by the characters that they really have."""

import unicodedata
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.font_manager import FontEntry

FIRST = "DejaVu Sans"
"""Comes with matplotlib: the same on every machine."""

_LIKED = ("noto sans", "gothic", "sans")
"""Words of families that go well with the first, best first."""
_NEVER = ("mono", "serif", "mincho", "last resort", "lastresort", "emoji", "stix", "cmex", "cmsy", "cmmi")
_UNDRAWN = {"Cf", "Zs", "Cc"}
_SELECTORS = {*map(chr, range(0xFE00, 0xFE10))}  # of variants; they have no glyph of their own


def families_for(text: str) -> tuple[str, ...]:
    """Return font families that have the characters of a text between them, the first always first.

    Parameters
    ----------
    text
        All that is to be written.
    """
    families = [FIRST]
    lacking = _lacking(text, families)
    for known in (_known_fonts, _all_fonts):
        candidates = known() if lacking else {}
        while lacking and candidates:
            best = max(
                candidates,
                key=lambda family: (len(lacking & _characters(candidates[family])), *_liking(family)),
            )
            if not lacking & _characters(candidates[best]):
                break
            families.append(best)
            lacking -= _characters(candidates.pop(best))
    return tuple(families)


def can_be_bold(text: str) -> bool:
    """Return whether the first font can write a text: those of other scripts often have no bold face."""
    return not _lacking(text, [FIRST])


def unwritable(text: str) -> str:
    """Return the characters of a text that no installed font has, each once, in order."""
    if not _lacking(text, [FIRST]):
        return ""
    lacking = _lacking(text, families_for(text))
    return "".join(each for each in dict.fromkeys(text) if each in lacking)


def _lacking(text: str, families: Iterable[str]) -> set[str]:
    had = frozenset[str]().union(*map(_characters_of, families))
    return {each for each in {*text} - had - _SELECTORS if unicodedata.category(each) not in _UNDRAWN}


def _known_fonts() -> dict[str, str]:
    """Return the file of each upright family of normal weight that matplotlib knows."""
    from matplotlib.font_manager import fontManager

    return _regular(fontManager.ttflist)


def _all_fonts() -> dict[str, str]:
    """Return the same after a look for fonts that were installed since matplotlib last looked."""
    from matplotlib.font_manager import findSystemFonts, fontManager

    known = {Path(entry.fname) for entry in fontManager.ttflist}
    for path in sorted(findSystemFonts()):
        if Path(path) not in known:
            try:
                fontManager.addfont(path)
            except (OSError, RuntimeError):  # no font after all
                continue
    return _regular(fontManager.ttflist)


def _regular(entries: "Iterable[FontEntry]") -> dict[str, str]:
    upright = (
        entry
        for entry in sorted(entries, key=lambda entry: (entry.name, entry.fname))
        if entry.style == "normal" and entry.weight in (400, "normal", "regular", "book")
    )
    return {
        entry.name: entry.fname for entry in upright if not any(word in entry.name.lower() for word in _NEVER)
    }


def _liking(family: str) -> tuple[int, str]:
    """Return how well a family goes with the first; equal ones go by name, so that the choice is one."""
    name = family.lower()
    rank = next((place for place, word in enumerate(_LIKED) if word in name), len(_LIKED))
    return -rank, family


@lru_cache(maxsize=64)
def _characters_of(family: str) -> frozenset[str]:
    from matplotlib.font_manager import FontProperties, findfont

    return _characters(findfont(FontProperties(family=family)))


@lru_cache(maxsize=512)
def _characters(path: str) -> frozenset[str]:
    from matplotlib.ft2font import FT2Font

    try:
        return frozenset(map(chr, FT2Font(path).get_charmap()))
    except (OSError, RuntimeError):  # a file that is no font, or one of bitmaps
        return frozenset()
