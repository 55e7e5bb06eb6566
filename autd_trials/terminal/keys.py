"""Keys of a terminal: telling them apart in its character stream, and editing one line with them."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

ESCAPE = "\x1b"
ENTER = "\n"

CONTROL_KEYS: Mapping[str, str] = {"p": "pause", "n": "note", "a": "abort"}
"""What steers a session while trials run; no response key may be one of these."""

_ERASE = ("\x7f", "\b")
_ERASE_LINE = "\x15"  # Ctrl-U, as in a shell
_LONGEST_LINE = 2000

# ECMA-48: a function key is ESC [ parameters final, or ESC O final; Alt with a key is ESC key.
# A sequence that an impossible character breaks off ends before it.
_KEY = re.compile(
    r"""
      \x1b \[ [ -?]* (?: [@-~] | (?=[^ -~]) )
    | \x1b O (?: [^\x1b] | (?=\x1b) )
    | \x1b (?: [^\[O\x1b] | (?=\x1b) )
    | [^\x1b]
    """,
    re.VERBOSE | re.DOTALL,
)

# A key as the kitty protocol reports it: its character, the one on the standard layout, modifiers.
_REPORTED = re.compile(r"\x1b\[(\d{1,7})(?::\d*)?(?::(\d{1,7}))?(?:;[12]?(?::[12])?)?u")
_LATIN = "qwertyuiopasdfghjklzxcvbnm"
_SAME_PLACES = (
    "йцукенгшщзфывапролдячсмить",  # Russian
    ";ςερτυθιοπασδφγηξκλζχψωβνμ",  # Greek
    "/'קראטוןםפשדגכעיחלךזסבהנמצ",  # Hebrew
    "ضصثقفغعهخحشسيبلاتنمئءؤرﻻىة",  # Arabic
    "ㅂㅈㄷㄱㅅㅛㅕㅑㅐㅔㅁㄴㅇㄹㅎㅗㅓㅏㅣㅋㅌㅊㅍㅠㅜㅡ",  # Korean
    "たていすかんなにらせちとしはきくまのりつさそひこみも",  # Japanese kana
)
_BY_PLACE = {
    letter: latin
    for layout in _SAME_PLACES
    for letter, latin in zip(layout, _LATIN, strict=True)
    if letter.isalpha()
}


def plain_key(text: str) -> str:
    r"""Return the key of a Latin keyboard that is meant, whatever the layout, Caps Lock or input method.

    Wide and other compatibility forms become plain ones, letters small, and a letter of a script that is not
    Latin becomes the Latin one in the same place. Other keys stay as they are.

    >>> plain_key("A"), plain_key("\u3000"), plain_key("ф"), plain_key("\x1b[32u"), plain_key("\x1b[A")
    ('a', ' ', 'a', ' ', '\x1b[A')
    """
    if reported := _REPORTED.fullmatch(text):
        code = int(reported[2] or reported[1])
        text = chr(code).replace("\r", ENTER) if code <= 0x10FFFF else text
    if len(text) != 1:
        return text
    text = _BY_PLACE.get(text.lower(), text)
    simple = unicodedata.normalize("NFKC", text).lower()
    return simple if len(simple) == 1 else text


@dataclass(frozen=True)
class Key:
    """One key: a character or a whole escape sequence, and when it arrived on the host's monotonic clock."""

    text: str
    time_s: float


class KeyDecoder:
    """Splits a terminal's characters into keys, the same however they are chunked.

    Enter is always a newline. An arrow or function key is one key, so that its letters are never taken for
    commands.
    """

    def __init__(self) -> None:
        self._pending = ""

    @property
    def pending(self) -> bool:
        """Whether a sequence has begun and not ended; if nothing follows, `flush` it."""
        return bool(self._pending)

    def feed(self, text: str) -> list[str]:
        """Add characters; return the keys that are complete."""
        self._pending += text.replace("\r", ENTER)
        keys = []
        end = 0
        while match := _KEY.match(self._pending, end):
            keys.append(match[0])
            end = match.end()
        self._pending = self._pending[end:]
        return keys

    def flush(self) -> list[str]:
        """Return what is pending as one key: a lone Esc, as a rule."""
        keys = [self._pending] if self._pending else []
        self._pending = ""
        return keys


@dataclass
class LineEditor:
    """One line of text as it is typed.

    Backspace erases a character, Ctrl-U the line, Enter ends it, Esc cancels it; keys after the end, and keys
    that print nothing, are ignored.
    """

    text: str = ""
    state: Literal["editing", "done", "cancelled"] = field(default="editing", init=False)

    def feed(self, key: str) -> None:
        """Apply one key."""
        if self.state != "editing":
            return
        if key == ENTER:
            self.state = "done"
        elif key == ESCAPE:
            self.state = "cancelled"
        elif key in _ERASE:
            self.text = self.text[:-1]
        elif key == _ERASE_LINE:
            self.text = ""
        elif key.isprintable() and len(self.text) < _LONGEST_LINE:
            self.text += key
