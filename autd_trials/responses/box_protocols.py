"""What serial button boxes send, declared in a rig file and parsed byte by byte."""

import math
import re
from dataclasses import dataclass
from itertools import groupby
from typing import Annotated, ClassVar, Literal, Protocol

from pydantic import Field, field_validator

from autd_trials.model import Model
from autd_trials.responses.pattern import Pattern

LONGEST_LINE_BYTES = 256
"""A longer line is no message; only its beginning is kept."""

LARGEST_DEVICE_TIME_S = 1e9
_SHOWN_BYTES = 40

_BYTE = r"^([!-~]|0x[0-9a-fA-F]{2})$"
_Byte = Annotated[str, Field(pattern=_BYTE)]


@dataclass(frozen=True)
class Report:
    """A press as a box sent it; `device_time_s` is the box's own stamp, its zero the box's own."""

    button: str
    device_time_s: float | None = None


@dataclass(frozen=True)
class Garbage:
    """Bytes that are no message that the protocol knows, and why they are none."""

    data: bytes
    why: str

    def __str__(self) -> str:
        more = "..." if len(self.data) > _SHOWN_BYTES else ""
        return f"{self.data[:_SHOWN_BYTES]!r}{more}: {self.why}"


Message = Report | Garbage


class Parser(Protocol):
    """Turns a box's bytes into messages, the same however they are chunked; never raises, keeps little."""

    @property
    def pending(self) -> bool:
        """Whether a message has begun and not ended."""

    def feed(self, data: bytes) -> list[Message]:
        """Add bytes; return the messages that are complete, oldest first."""

    def flush(self) -> list[Message]:
        """Give up waiting for the end of what is pending."""


class _Protocol(Model):
    message_bytes: ClassVar[int]
    """Typical length of a message, for the time it takes on the line."""

    baud: int = Field(115200, ge=300, le=4_000_000, description="Speed of the line in bits per second.")


class LineProtocol(_Protocol):
    """One line a press, ended by CR, LF or both; an Arduino that prints ``B1 12345``, say.

    `press` must match the whole line. Its group ``button`` names the button; its group ``ms`` or ``us``, if
    it has one, is the box's own time. Expressions are those of `autd_trials.responses.pattern.Pattern`.
    """

    message_bytes: ClassVar[int] = 16

    kind: Literal["line"] = "line"
    press: str = Field(
        r"(?P<button>B\d+)( +(?P<ms>\d+))?",
        description="Regular expression of a press; group 'button', and 'ms' or 'us' for its own time.",
    )
    ignore: tuple[str, ...] = Field(
        (),
        max_length=20,
        description="Regular expressions of lines that are no presses and mean nothing (a heartbeat).",
    )

    @field_validator("press")
    @classmethod
    def _names_a_button(cls, press: str) -> str:
        if "button" not in Pattern(press).names:
            raise ValueError("the expression needs a group (?P<button>...)")
        return press

    @field_validator("ignore")
    @classmethod
    def _are_expressions(cls, ignore: tuple[str, ...]) -> tuple[str, ...]:
        for expression in ignore:
            Pattern(expression)
        return ignore

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        return _LineParser(Pattern(self.press), [Pattern(expression) for expression in self.ignore])


class SingleByteProtocol(_Protocol):
    """One byte a press. Bytes of releases, and others that mean nothing, are named in `ignore`."""

    message_bytes: ClassVar[int] = 1

    kind: Literal["single_byte"] = "single_byte"
    buttons: dict[_Byte, Annotated[str, Field(min_length=1)]] = Field(
        min_length=1, description="Byte (one character, or 0x41) to button name."
    )
    ignore: tuple[_Byte, ...] = Field(
        (), description="Bytes that are no presses and mean nothing (releases)."
    )

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        buttons = {_byte_value(byte): button for byte, button in self.buttons.items()}
        return _SingleByteParser(buttons, frozenset(map(_byte_value, self.ignore)))


class XidProtocol(_Protocol):
    """Cedrus XID response pads: six bytes a press and six a release, with the pad's time in ms.

    The layout is that of pyxid2 1.0.9, the maker's own library: ``k``; then port in bits 0 and 1, pressed in
    bit 4, button in bits 5 to 7 (0 is button 8); then the time as 32 bits, little-endian. It was not tried on
    a real pad. Releases are ignored. Buttons are numbered as the pad sends them, ``1`` to ``8``, and not by
    their position on it.
    """

    message_bytes: ClassVar[int] = 6

    kind: Literal["xid"] = "xid"

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        return _XidParser()


BoxProtocol = Annotated[LineProtocol | SingleByteProtocol | XidProtocol, Field(discriminator="kind")]
"""What a rig file says of a box; `kind` tells which."""


class _LineParser:
    def __init__(self, press: Pattern, ignore: list[Pattern]) -> None:
        self._press = press
        self._ignore = ignore
        self._line = bytearray()
        self._too_long = False

    @property
    def pending(self) -> bool:
        return bool(self._line) and not self._too_long

    def feed(self, data: bytes) -> list[Message]:
        *ended, rest = re.split(rb"[\r\n]", data)
        messages: list[Message] = []
        for part in ended:
            messages += self._extend(part)
            messages += self._end_line()
        return messages + self._extend(rest)

    def flush(self) -> list[Message]:
        line, self._line = bytes(self._line), bytearray()
        return [Garbage(line, "no end of line came")] if line and not self._too_long else []

    def _extend(self, part: bytes) -> list[Message]:
        if self._too_long:
            return []
        self._line += part
        if len(self._line) <= LONGEST_LINE_BYTES:
            return []
        begin, self._line, self._too_long = bytes(self._line[:LONGEST_LINE_BYTES]), bytearray(), True
        return [Garbage(begin, f"a line of more than {LONGEST_LINE_BYTES} bytes")]

    def _end_line(self) -> list[Message]:
        line, self._line = bytes(self._line), bytearray()
        too_long, self._too_long = self._too_long, False
        text = line.decode("latin-1").strip(" \t")
        if too_long or not text or any(pattern.fullmatch(text) is not None for pattern in self._ignore):
            return []
        report = self._report(text)
        return [report or Garbage(line, self._why_not(text))]

    def _report(self, text: str) -> Report | None:
        groups = self._press.fullmatch(text)
        if not groups or not groups.get("button"):
            return None
        stamp = next((name for name in ("us", "ms") if name in groups), None)
        if stamp is None:
            return Report(groups["button"])
        try:
            device_time_s = float(groups[stamp]) / (1e6 if stamp == "us" else 1e3)
        except ValueError:  # the rig's expression lets something through that is no number
            return None
        sane = math.isfinite(device_time_s) and abs(device_time_s) <= LARGEST_DEVICE_TIME_S
        return Report(groups["button"], device_time_s) if sane else None

    def _why_not(self, text: str) -> str:
        if not text.isascii() or not text.isprintable():
            return "no text of the box's protocol; perhaps another baud"
        if any(self._press.fullmatch(other) is not None for other in (text.upper(), text.lower())):
            return "a press but for upper or lower case"
        return "no press of the box's protocol"


def _byte_value(byte: str) -> int:
    return int(byte, 16) if len(byte) > 1 else ord(byte)


class _SingleByteParser:
    pending = False

    def __init__(self, buttons: dict[int, str], ignore: frozenset[int]) -> None:
        self._buttons = buttons
        self._ignore = ignore

    def feed(self, data: bytes) -> list[Message]:
        messages: list[Message] = []
        known = [byte for byte in data if byte not in self._ignore]
        for is_press, run in groupby(known, key=self._buttons.__contains__):
            if is_press:
                messages += [Report(self._buttons[byte]) for byte in run]
            else:
                messages.append(Garbage(bytes(run), "no button's byte"))
        return messages

    def flush(self) -> list[Message]:
        return []


class _XidParser:
    _PACKET_BYTES = 6
    _PRESSED = 0x10
    _ALWAYS_CLEAR = 0x0C

    def __init__(self) -> None:
        self._pending = bytearray()

    @property
    def pending(self) -> bool:
        return bool(self._pending)

    def feed(self, data: bytes) -> list[Message]:
        self._pending += data
        messages: list[Message] = []
        start = skipped = 0
        while start + self._PACKET_BYTES <= len(self._pending):
            packet = self._pending[start : start + self._PACKET_BYTES]
            if packet[0] != ord("k") or packet[1] & self._ALWAYS_CLEAR:
                start += 1  # look for the next packet one byte on
                continue
            messages += self._garbage(skipped, start)
            start = skipped = start + self._PACKET_BYTES
            if packet[1] & self._PRESSED:
                button = packet[1] >> 5 or 8
                messages.append(Report(str(button), int.from_bytes(packet[2:], "little") / 1000))
        messages += self._garbage(skipped, start)
        del self._pending[:start]
        return messages

    def flush(self) -> list[Message]:
        messages = self._garbage(0, len(self._pending))
        self._pending.clear()
        return messages

    def _garbage(self, start: int, end: int) -> list[Message]:
        if start == end:
            return []
        return [Garbage(bytes(self._pending[start:end]), "no packet of an XID pad")]
