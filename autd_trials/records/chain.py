"""The chain through a log: each line carries its number and a hash over all before it.

A line is sealed as ``{"n":12,...,"chain":"<64 hexadecimal digits>"}``. Its chain is the SHA-256 of the chain
before it followed by the line's own text without the chain. A line without a seal (torn by a crash, or
written by version 1) has no chain of its own but is hashed into the next one all the same, as it stands. So
a torn line that a session was taken up again behind is told from one that was damaged later.

There is no secret in it: it shows accidents and casual edits, not the work of somebody who computes the chain
again. What such a person must still do is keep the log consistent in itself (`consistency`).
"""

import hashlib
import re
from dataclasses import dataclass

_SEALED = re.compile(rb'\{"n":([1-9][0-9]{0,8}),(.*),"chain":"([0-9a-f]{64})"\}', re.DOTALL)


@dataclass(frozen=True)
class Line:
    """A line of a log as it stands in the file, without its line break.

    Parameters
    ----------
    text
        What the chain is made of: the line without its own chain.
    event
        The event's JSON, without number and chain.
    number, chain
        What the line says of its number and its chain; None if it is not sealed.
    """

    text: bytes
    event: bytes
    number: int | None
    chain: str | None

    @classmethod
    def parse(cls, raw: bytes) -> "Line":
        """Return what a line holds; never fails."""
        match = _SEALED.fullmatch(raw)
        if match is None:
            return cls(raw, raw, None, None)
        number, event, chain = match.groups()
        return cls(b'{"n":%b,%b}' % (number, event), b"{%b}" % event, int(number), chain.decode("ascii"))


@dataclass(frozen=True)
class Head:
    """Where a chain stands: how many lines there are, and the chain through the last of them."""

    lines: int = 0
    chain: str = ""

    def expected(self, text: bytes) -> str:
        """Return the chain of the next line if that is its text."""
        return hashlib.sha256(self.chain.encode("ascii") + text).hexdigest()

    def after(self, line: Line) -> "Head":
        """Return where the chain stands behind a line; a seal is taken as it is."""
        return Head(self.lines + 1, line.chain or self.expected(line.text))

    def seal(self, event: bytes) -> bytes:
        """Return an event's JSON object as the next line, without a line break."""
        text = b'{"n":%d,%b' % (self.lines + 1, event[1:])
        return b'%b,"chain":"%b"}' % (text[:-1], self.expected(text).encode("ascii"))


def split_lines(content: bytes) -> list[bytes]:
    """Return a file's lines without their line breaks; a last one may lack its own."""
    lines = content.split(b"\n")
    return lines if lines[-1] else lines[:-1]
