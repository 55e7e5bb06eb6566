"""Keys of a terminal: telling them apart in its character stream, and editing one line with them."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

ESCAPE = "\x1b"
ENTER = "\n"
INTERRUPT = "\x03"
"""Ctrl-C, where a terminal sends it as a key and not as a signal."""

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

# A key as the kitty protocol ("CSI u") reports it: its character, the one on the standard layout, modifiers,
# and whether it was let go; and as xterm's modifyOtherKeys does.
_REPORTED = (
    re.compile(
        r"\x1b\[(?P<code>\d{1,7})(?::\d*)?(?::(?P<base>\d{1,7}))?"
        r"(?:;(?P<modifiers>\d{0,4})(?::(?P<event>\d))?)?(?:;[\d:]*)?u"
    ),
    re.compile(r"\x1b\[27;(?P<modifiers>\d{1,4});(?P<code>\d{1,7})~"),
)
_SHIFT, _CTRL, _LOCKS, _RELEASED = 1, 4, 64 | 128, "3"
_LATIN = "qwertyuiopasdfghjklzxcvbnm"
_SAME_PLACES = (
    "йцукенгшщзфывапролдячсмить",  # Russian
    ";ςερτυθιοπασδφγηξκλζχψωβνμ",  # Greek
    "/'קראטוןםפשדגכעיחלךזסבהנמצ",  # Hebrew
    "ضصثقفغعهخحشسيبلاتنمئءؤرﻻىة",  # Arabic
    "ㅂㅈㄷㄱㅅㅛㅕㅑㅐㅔㅁㄴㅇㄹㅎㅗㅓㅏㅣㅋㅌㅊㅍㅠㅜㅡ",  # Korean
    "たていすかんなにらせちとしはきくまのりつさそひこみも",  # Japanese kana
    "йцукенгшщзфівапролдячсмить",  # Ukrainian
    "љњертзуиопасдфгхјклѕџцвбнм",  # Serbian
    "ضصثقفغعهخحشسیبلاتنمظطزرذدپ",  # Persian
    "ㅃㅉㄸㄲㅆㅛㅕㅑㅒㅖㅁㄴㅇㄹㅎㅗㅓㅏㅣㅋㅌㅊㅍㅠㅜㅡ",  # Korean, shifted
    "ๆไำพะัีรนยฟหกดเ้่าสผปแอิืท",  # Thai
    "ㄆㄊㄍㄐㄔㄗㄧㄛㄟㄣㄇㄋㄎㄑㄕㄘㄨㄜㄠㄈㄌㄏㄒㄖㄙㄩ",  # Chinese Zhuyin
    "ქწერტყუიოპასდფგჰჯკლზხცვბნმ",  # Georgian
    "ौैाीूबहगदजोे्िुपरकतॆंमनवलस",  # Hindi InScript
)
"""Written down from the published layouts, not tried on keyboards of each kind.

Where two of them have a letter in different places, the first one counts.
"""

_BY_PLACE = {
    letter: latin
    for layout in reversed(_SAME_PLACES)
    for letter, latin in zip(layout, _LATIN, strict=True)
    if unicodedata.category(letter)[0] in "LM"
}
_KATAKANA_TO_HIRAGANA = ord("ァ") - ord("ぁ")


def plain_key(text: str) -> str:
    r"""Return the key of a Latin keyboard that is meant, whatever the layout, Caps Lock or input method.

    Wide and other compatibility forms become plain ones, letters small, and a letter of a script that is not
    Latin becomes the Latin one in the same place. Other keys stay as they are.

    >>> plain_key("A"), plain_key("\u3000"), plain_key("ф"), plain_key("\x1b[32u"), plain_key("\x1b[A")
    ('a', ' ', 'a', ' ', '\x1b[A')
    """
    text = _reported(text)
    if len(text) != 1:
        return text
    if text == "\0":  # Ctrl with the space bar
        return " "
    if text.lower() in _BY_PLACE:  # before it is made plain, which takes some letters apart
        return _BY_PLACE[text.lower()]
    simple = plain_character(text)
    hiragana = chr(ord(simple) - _KATAKANA_TO_HIRAGANA) if "ァ" <= simple <= "ヶ" else simple
    return _BY_PLACE.get(hiragana, simple)


def plain_character(text: str) -> str:
    """Return a character without its case and width; by what it says, not by where it lies."""
    simple = unicodedata.normalize("NFKC", _reported(text)).lower()
    return simple if len(simple) == 1 else text


def is_release(text: str) -> bool:
    """Return whether a terminal says that a key was let go."""
    found = _REPORTED[0].fullmatch(text)
    return found is not None and found["event"] == _RELEASED


def _reported(text: str) -> str:
    """Return the character of a key that a terminal reported by its code; others as they are."""
    found = next((match for pattern in _REPORTED if (match := pattern.fullmatch(text))), None)
    if found is None:
        return text
    parts = found.groupdict()
    code, modifiers = int(parts.get("base") or parts["code"]), int(parts["modifiers"] or 1) - 1
    if code > 0x10FFFF or modifiers & ~(_SHIFT | _CTRL | _LOCKS):
        return text  # with Alt, say, it is another key
    if modifiers & _CTRL:
        return chr(ord(chr(code).upper()) & 0x1F) if code < 0x80 else text
    return chr(code).replace("\r", ENTER)


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
