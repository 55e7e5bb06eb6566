"""What serial button boxes send, declared in a rig file and parsed byte by byte."""

import math
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Protocol

from pydantic import AfterValidator, Field

from autd_trials.model import Model
from autd_trials.responses.expressions import Expression, compiled

LONGEST_LINE_BYTES = 256
"""A longer line is no press; only its beginning is kept."""

DEFAULT_PRESS = r"(?P<button>B\d+)( +(?P<ms>\d+))?"

_BYTE = r"^([!-~]|0x[0-9a-fA-F]{2})$"
_KEPT_BYTES = 40
_LONGEST_DEVICE_TIME_S = 1e9


@dataclass(frozen=True)
class Report:
    """A press as a box sent it; `device_time_s` is the box's own stamp, its zero the box's own."""

    button: str
    device_time_s: float | None = None


@dataclass(frozen=True)
class Garbage:
    """Bytes that belong to nothing the protocol knows: how many, and the first of them."""

    size: int
    first: bytes


class Parser(Protocol):
    """Turns a box's bytes into reports and garbage, the same however they are chunked; never raises."""

    @property
    def pending(self) -> bool:
        """Whether a message has begun and not ended; if nothing follows, `flush` it."""

    def feed(self, data: bytes) -> list[Report | Garbage]:
        """Add bytes; return what is complete, oldest first."""

    def flush(self) -> list[Garbage]:
        """Give up on a message that has begun: nothing follows."""


Button = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[ -~]*$")]
Byte = Annotated[str, Field(pattern=_BYTE)]


class _Protocol(Model):
    message_bytes: ClassVar[int]
    """Typical length of a message, for the time it takes on the line."""

    baud: int = Field(115200, ge=300, le=4_000_000, description="Speed of the line in bits per second.")
    felt: tuple[Button, ...] | None = Field(
        None,
        min_length=1,
        description="The buttons that mean felt; others are recorded, shown, and do not count. "
        "May be left out where only one button is known: B1 of the default lines, 1 of an XID pad, "
        "the only one of single bytes.",
    )

    @property
    def buttons_felt(self) -> frozenset[str]:
        """The buttons that mean felt; empty if the file does not say."""
        return frozenset(self.felt or ())


def _names_a_button(press: str) -> str:
    if "button" not in compiled(press).groupindex:
        raise ValueError("the expression needs a group (?P<button>...)")
    return press


class LineProtocol(_Protocol):
    """One line a press, ended by CR, LF or both; an Arduino that prints ``B1 12345``, say.

    `press` must match the whole line. Its group ``button`` names the button; its group ``ms`` or ``us``, if
    it has one, is the box's own time.
    """

    message_bytes: ClassVar[int] = 16

    kind: Literal["line"] = "line"
    press: Annotated[Expression, AfterValidator(_names_a_button)] = Field(
        DEFAULT_PRESS,
        description="Regular expression of a press; group 'button', and 'ms' or 'us' for its own time.",
    )
    ignore: Expression | None = Field(
        None, description="Regular expression of lines that mean nothing: releases, signs of life."
    )

    @property
    def buttons_felt(self) -> frozenset[str]:
        """The buttons that mean felt: of the default lines B1, unless the file says otherwise."""
        return super().buttons_felt or frozenset({"B1"} if self.press == DEFAULT_PRESS else ())

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        return _LineParser(compiled(self.press), None if self.ignore is None else compiled(self.ignore))


class SingleByteProtocol(_Protocol):
    """One byte a press."""

    message_bytes: ClassVar[int] = 1

    kind: Literal["single_byte"] = "single_byte"
    buttons: dict[Byte, Button] = Field(
        min_length=1, description="Byte (one character, or 0x41) to button name."
    )
    ignore: tuple[Byte, ...] = Field((), description="Bytes that mean nothing: releases, signs of life.")

    @property
    def buttons_felt(self) -> frozenset[str]:
        """The buttons that mean felt: the only one, unless the file says otherwise."""
        names = frozenset(self.buttons.values())
        return super().buttons_felt or (names if len(names) == 1 else frozenset())

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        buttons = {_byte_value(byte): button for byte, button in self.buttons.items()}
        return _SingleByteParser(buttons, {_byte_value(byte) for byte in self.ignore})


class XidProtocol(_Protocol):
    """Cedrus XID response pads: six bytes a press and six a release, with the pad's time in ms.

    The layout is that of pyxid2 1.0.9, the maker's own library: ``k``; then port in bits 0 and 1, pressed in
    bit 4, button in bits 5 to 7 (0 is button 8); then the time as 32 bits, little-endian. It was not tried on
    a real pad. Releases are ignored. Buttons are numbered as the pad sends them, ``1`` to ``8``, and not by
    their position on it.
    """

    message_bytes: ClassVar[int] = 6

    kind: Literal["xid"] = "xid"

    @property
    def buttons_felt(self) -> frozenset[str]:
        """The buttons that mean felt: 1, unless the file says otherwise."""
        return super().buttons_felt or frozenset({"1"})

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        return _XidParser()


def _has_a_meaning(protocol: "LineProtocol | SingleByteProtocol | XidProtocol") -> Any:
    if not protocol.buttons_felt:
        raise ValueError("say which buttons mean felt: felt: [NAME, ...]")
    if isinstance(protocol, SingleByteProtocol) and (
        strange := protocol.buttons_felt - set(protocol.buttons.values())
    ):
        raise ValueError(
            f"felt: {', '.join(sorted(strange))}: no such button; allowed: "
            + ", ".join(sorted(set(protocol.buttons.values())))
        )
    return protocol


BoxProtocol = Annotated[
    LineProtocol | SingleByteProtocol | XidProtocol,
    Field(discriminator="kind"),
    AfterValidator(_has_a_meaning),
]
"""What a rig file says of a box; `kind` says which."""


class _LineParser:
    def __init__(self, press: Any, ignore: Any | None) -> None:
        self._press = press
        self._ignore = ignore
        self._line = bytearray()
        self._size = 0

    @property
    def pending(self) -> bool:
        return self._size > 0

    def feed(self, data: bytes) -> list[Report | Garbage]:
        *ended, rest = re.split(rb"[\r\n]", data)
        found: list[Report | Garbage] = []
        for part in ended:
            self._extend(part)
            found += self._end_line()
        self._extend(rest)
        return found

    def flush(self) -> list[Garbage]:
        size, line = self._take()
        return [Garbage(size, line[:_KEPT_BYTES])] if size else []

    def _extend(self, part: bytes) -> None:
        self._line += part[: LONGEST_LINE_BYTES - len(self._line)]
        self._size += len(part)

    def _take(self) -> tuple[int, bytes]:
        size, line = self._size, bytes(self._line)
        self._line.clear()
        self._size = 0
        return size, line

    def _end_line(self) -> Iterator[Report | Garbage]:
        size, line = self._take()
        text = line.decode("latin-1").strip(" \t")
        if not text:
            return
        if size > LONGEST_LINE_BYTES:
            yield Garbage(size, line[:_KEPT_BYTES])
        elif match := self._press.fullmatch(text):
            yield _report(match.groupdict()) or Garbage(size, line[:_KEPT_BYTES])
        elif self._ignore is None or not self._ignore.fullmatch(text):
            yield Garbage(size, line[:_KEPT_BYTES])


def _report(groups: Mapping[str, str | None]) -> Report | None:
    """Return the press; None if the expression lets something through that is no button or no time."""
    button = groups["button"]
    if not button or not button.isprintable():
        return None
    try:
        return Report(button, _device_time_s(groups.get("ms"), groups.get("us")))
    except ValueError:
        return None


def _device_time_s(ms: str | None, us: str | None) -> float | None:
    text, per_second = (us, 1e6) if us is not None else (ms, 1e3)
    if text is None:
        return None
    time_s = float(text) / per_second
    if not math.isfinite(time_s) or abs(time_s) > _LONGEST_DEVICE_TIME_S:
        raise ValueError(f"{text!r} is no time")
    return time_s


def _byte_value(byte: str) -> int:
    return int(byte, 16) if len(byte) > 1 else ord(byte)


class _SingleByteParser:
    pending = False

    def __init__(self, buttons: Mapping[int, str], ignore: Collection[int]) -> None:
        self._buttons = buttons
        self._ignore = ignore

    def feed(self, data: bytes) -> list[Report | Garbage]:
        return [
            Report(self._buttons[byte]) if byte in self._buttons else Garbage(1, bytes([byte]))
            for byte in data
            if byte not in self._ignore
        ]

    def flush(self) -> list[Garbage]:
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

    def feed(self, data: bytes) -> list[Report | Garbage]:
        self._pending += data
        found: list[Report | Garbage] = []
        start = 0
        while start + self._PACKET_BYTES <= len(self._pending):
            packet = self._pending[start : start + self._PACKET_BYTES]
            if packet[0] != ord("k") or packet[1] & self._ALWAYS_CLEAR:
                found.append(Garbage(1, bytes(packet[:1])))  # look for the next packet one byte on
                start += 1
                continue
            start += self._PACKET_BYTES
            if packet[1] & self._PRESSED:
                button = packet[1] >> 5 or 8
                found.append(Report(str(button), int.from_bytes(packet[2:], "little") / 1000))
        del self._pending[:start]
        return found

    def flush(self) -> list[Garbage]:
        rest = bytes(self._pending)
        self._pending.clear()
        return [Garbage(len(rest), rest)] if rest else []
