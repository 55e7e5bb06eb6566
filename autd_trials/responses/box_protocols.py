"""What serial button boxes send, declared in a rig file and parsed byte by byte."""

import re
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol

from pydantic import Field, field_validator

from autd_trials.model import Model

LONGEST_LINE_BYTES = 256
"""A longer line is no press; it is counted as garbage without being kept."""

_BYTE = r"^([!-~]|0x[0-9a-fA-F]{2})$"


@dataclass(frozen=True)
class Report:
    """A press as a box sent it; `device_time_s` is the box's own stamp, its zero the box's own."""

    button: str
    device_time_s: float | None = None


class Parser(Protocol):
    """Turns a box's bytes into reports, the same however they are chunked; never raises."""

    garbage_bytes: int
    """How many bytes belonged to nothing the protocol knows."""

    def feed(self, data: bytes) -> list[Report]:
        """Add bytes; return the reports that are complete, oldest first."""


class _Protocol(Model):
    message_bytes: ClassVar[int]
    """Typical length of a message, for the time it takes on the line."""

    baud: int = Field(115200, ge=300, le=4_000_000, description="Speed of the line in bits per second.")


class LineProtocol(_Protocol):
    """One line a press, ended by CR, LF or both; an Arduino that prints ``B1 12345``, say.

    `press` must match the whole line. Its group ``button`` names the button; its group ``ms`` or ``us``, if
    it has one, is the box's own time.
    """

    message_bytes: ClassVar[int] = 16

    kind: Literal["line"] = "line"
    press: str = Field(
        r"(?P<button>B\d+)( +(?P<ms>\d+))?",
        description="Regular expression of a press; group 'button', and 'ms' or 'us' for its own time.",
    )

    @field_validator("press")
    @classmethod
    def _names_a_button(cls, press: str) -> str:
        try:
            groups = re.compile(press, re.ASCII).groupindex
        except re.error as error:
            raise ValueError(f"no regular expression: {error}") from error
        if "button" not in groups:
            raise ValueError("the expression needs a group (?P<button>...)")
        return press

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        return _LineParser(re.compile(self.press, re.ASCII))


class SingleByteProtocol(_Protocol):
    """One byte a press; bytes that are not in `buttons` (releases, say) are counted as garbage."""

    message_bytes: ClassVar[int] = 1

    kind: Literal["single_byte"] = "single_byte"
    buttons: dict[Annotated[str, Field(pattern=_BYTE)], Annotated[str, Field(min_length=1)]] = Field(
        min_length=1, description="Byte (one character, or 0x41) to button name."
    )

    def parser(self) -> Parser:
        """Return a parser at the start of a stream."""
        return _SingleByteParser({_byte_value(byte): button for byte, button in self.buttons.items()})


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
    def __init__(self, pattern: re.Pattern[str]) -> None:
        self.garbage_bytes = 0
        self._pattern = pattern
        self._line = bytearray()
        self._too_long = False

    def feed(self, data: bytes) -> list[Report]:
        *ended, rest = re.split(rb"[\r\n]", data)
        reports = []
        for part in ended:
            self._extend(part)
            reports += self._end_line()
        self._extend(rest)
        return reports

    def _extend(self, part: bytes) -> None:
        self._line += part
        self._too_long = self._too_long or len(self._line) > LONGEST_LINE_BYTES
        if self._too_long:
            self.garbage_bytes += len(self._line)
            self._line.clear()

    def _end_line(self) -> list[Report]:
        line, self._line = bytes(self._line), bytearray()
        too_long, self._too_long = self._too_long, False
        if too_long or not line:
            return []
        match = self._pattern.fullmatch(line.decode("latin-1").strip(" \t"))
        report = _report(match) if match else None
        if report is None:
            self.garbage_bytes += len(line)
            return []
        return [report]


def _report(match: re.Match[str]) -> Report | None:
    groups = match.groupdict()
    if not groups["button"]:
        return None
    try:
        return Report(groups["button"], _device_time_s(groups.get("ms"), groups.get("us")))
    except ValueError:  # the rig's expression lets something through that is no number
        return None


def _device_time_s(ms: str | None, us: str | None) -> float | None:
    if us is not None:
        return float(us) / 1e6
    return None if ms is None else float(ms) / 1e3


def _byte_value(byte: str) -> int:
    return int(byte, 16) if len(byte) > 1 else ord(byte)


class _SingleByteParser:
    def __init__(self, buttons: dict[int, str]) -> None:
        self.garbage_bytes = 0
        self._buttons = buttons

    def feed(self, data: bytes) -> list[Report]:
        reports = [Report(self._buttons[byte]) for byte in data if byte in self._buttons]
        self.garbage_bytes += len(data) - len(reports)
        return reports


class _XidParser:
    _PACKET_BYTES = 6
    _PRESSED = 0x10
    _ALWAYS_CLEAR = 0x0C

    def __init__(self) -> None:
        self.garbage_bytes = 0
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[Report]:
        self._pending += data
        reports = []
        start = 0
        while start + self._PACKET_BYTES <= len(self._pending):
            packet = self._pending[start : start + self._PACKET_BYTES]
            if packet[0] != ord("k") or packet[1] & self._ALWAYS_CLEAR:
                self.garbage_bytes += 1  # look for the next packet one byte on
                start += 1
                continue
            start += self._PACKET_BYTES
            if packet[1] & self._PRESSED:
                button = packet[1] >> 5 or 8
                reports.append(Report(str(button), int.from_bytes(packet[2:], "little") / 1000))
        del self._pending[:start]
        return reports
