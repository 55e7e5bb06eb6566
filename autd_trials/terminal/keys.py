"""Keys of a terminal: telling them apart in its character stream, and editing one line with them."""

import re
from dataclasses import dataclass, field
from typing import Literal

from autd_trials.terminal.layouts import keys_of

ESCAPE = "\x1b"
ENTER = "\n"
INTERRUPT = "\x03"
"""Ctrl-C, where the terminal sends it as a key and not as a signal."""

KEY_NAMES = {"space": " ", "enter": ENTER, "tab": "\t"}
"""Names of the keys that print nothing; every other key is named by its character."""

PAUSE, NOTE, ABORT = "p", "n", "a"
CONTROL_KEYS = {PAUSE: "pause", NOTE: "pause for a note", ABORT: "abort"}
"""What steers a session; no answer can be given with these."""

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


# Terminals that tell more than characters: "CSI u" (kitty, foot, WezTerm, tmux) and xterm's modifyOtherKeys.
_CSI_U = re.compile(
    r"\x1b\[(?P<code>\d{1,7})(?::\d*(?::(?P<base>\d{1,7}))?)?"
    r"(?:;(?P<modifiers>\d{0,4})(?::(?P<event>\d))?)?(?:;[\d:]*)?u"
)
_OTHER_KEYS = re.compile(r"\x1b\[27;(?P<modifiers>\d{1,4});(?P<code>\d{1,7})~")
_SHIFT, _CTRL, _LOCKS = 1, 4, 64 | 128
_REPEATED, _RELEASED = "2", "3"


@dataclass(frozen=True)
class Key:
    """One key: a character or a whole escape sequence, and when it arrived on the host's monotonic clock.

    `repeat` is True where the terminal says that the key was held down, None where it does not say anything
    of it. `base` is the key's character on the US layout, where the terminal tells.
    """

    text: str
    time_s: float
    repeat: bool | None = None
    base: str | None = None

    @property
    def keys(self) -> frozenset[str]:
        """The keys that it may be, as the US layout types them (see `layouts.keys_of`)."""
        return frozenset(self.base) if self.base else keys_of(self.text)


def read_key(text: str, time_s: float) -> Key | None:
    """Return a key from what a terminal sent for it (see `KeyDecoder`); None for one that was let go."""
    found = _CSI_U.fullmatch(text) or _OTHER_KEYS.fullmatch(text)
    if found is None:
        return Key(text, time_s)
    parts = found.groupdict()
    if parts.get("event") == _RELEASED:
        return None
    character = _character(parts["code"])
    modifiers = int(parts["modifiers"] or 1) - 1
    if character is None or modifiers & ~(_SHIFT | _CTRL | _LOCKS):
        return Key(text, time_s)  # with Alt, say: another key than its character
    if modifiers & _CTRL:
        character = chr(ord(character.upper()) & 0x1F) if character.isascii() else text
    event = parts.get("event")
    repeat = None if event is None else event == _REPEATED
    base = None if modifiers & _CTRL else _character(parts.get("base") or "")
    return Key(ENTER if character == "\r" else character, time_s, repeat, base)


def _character(code: str) -> str | None:
    number = int(code or -1)
    return chr(number) if 0 <= number <= 0x10FFFF and not 0xE000 <= number <= 0xF8FF else None


def key_of_name(name: str) -> str | None:
    """Return the character of the key with a name (of `KEY_NAMES`, or its own); None if there is none."""
    if name in KEY_NAMES:
        return KEY_NAMES[name]
    return name if len(name) == 1 and name.isprintable() and not name.isspace() else None


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
