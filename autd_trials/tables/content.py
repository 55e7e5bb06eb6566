"""A file's text, whatever it was saved as: bounded in size, in UTF-8, without control characters."""

import codecs
import re
import zlib
from dataclasses import dataclass, replace
from pathlib import Path

from autd_trials.errors import UsageError

LARGEST_BYTES = 32 * 2**20

_CONTROL = bytes([*range(0x09), 0x0B, 0x0C, *range(0x0E, 0x20), 0x7F])
_STRANGE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ufffe\uffff]")
_GZIP = b"\x1f\x8b"
_NO_TEXT = {
    b"PK\x03\x04": "a spreadsheet's own file or another archive",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet's own file",
    b"%PDF": "a PDF",
    b"$FL2": "a file of SPSS",
    b"\x89HDF": "a file of HDF5 or MATLAB",
    b"MATLAB": "a file of MATLAB",
}
_AGAIN = "save it again as CSV in UTF-8"
_INVISIBLE = re.compile("[\ufeff\u200b\u2060\u202a-\u202e\u2066-\u2069]")
_BEYOND_ASCII = re.compile(r"[^\x00-\x7f\xa0]+")
_SIGNS = "\xb0\xb5\xb2\xb3\xb1\xb7\u20ac"  # degrees, micro, squared, cubed, plus-minus, dot, euro
_ELISION = re.compile(r"(?<=[^\W\d_])\u2019(?=[^\W\d_])")


@dataclass(frozen=True)
class Content:
    """A file's text in UTF-8 without a byte order mark, and what was forgiven in reading it."""

    text: bytes
    remarks: tuple[str, ...] = ()


def read_content(path: Path, what: str, *, foreign: bool = False, encoding: str | None = None) -> Content:
    """Read a file's text.

    Parameters
    ----------
    path
        The file: UTF-8, with or without a byte order mark, or UTF-16 with one.
    what
        What it is, for messages.
    foreign
        Whether to take also what other programs save: gzip, UTF-16 without a mark, Windows-1252 (Latin-1).
    encoding
        The encoding, where it is known.

    Raises
    ------
    UsageError
        The file cannot be read, is larger than 32 MB, or is no text.
    """
    raw = _bytes(path, what)
    if foreign and raw.startswith(_GZIP):
        raw = _unpacked(raw, path, what)
    if foreign:
        for beginning, kind in _NO_TEXT.items():
            if raw.startswith(beginning):
                raise _no_text(path, what, f"it is {kind}")
        raw = raw.rstrip(b"\x1a")  # the end of a file for DOS
    decoded = _decoded(raw, path, what, foreign=foreign, encoding=encoding)
    _refuse_control(decoded.text, path, what)
    return replace(decoded, text=_visible(decoded.text)) if foreign else decoded


def _bytes(path: Path, what: str) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise UsageError(f"the {what} cannot be read: this is not a file", where=str(path))
        with path.open("rb") as file:
            content = file.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise UsageError(f"the {what} cannot be read: {error.strerror or error}", where=str(path)) from error
    except ValueError as error:  # a NUL in the name
        raise UsageError(f"the {what} cannot be read: {error}", where=str(path)) from error
    if len(content) > LARGEST_BYTES:
        raise _too_large(path, what)
    return content


def _too_large(path: Path, what: str) -> UsageError:
    return UsageError(
        f"the {what} is larger than {LARGEST_BYTES // 2**20} MB", where=str(path), do="give a part of it"
    )


def _unpacked(packed: bytes, path: Path, what: str) -> bytes:
    """Return what gzip packed, all its members, and never more than the largest size."""
    unpacked = bytearray()
    rest = packed
    try:
        while rest.startswith(_GZIP):
            member = zlib.decompressobj(wbits=31)
            unpacked += member.decompress(rest, LARGEST_BYTES + 1 - len(unpacked))
            if len(unpacked) > LARGEST_BYTES:
                raise _too_large(path, what)
            if not member.eof:
                raise _no_text(path, what, "it ends before what gzip packed in it does")
            rest = member.unused_data
    except zlib.error as error:
        raise _no_text(path, what, "it begins as gzip and does not go on so") from error
    return bytes(unpacked)


def _decoded(raw: bytes, path: Path, what: str, *, foreign: bool, encoding: str | None) -> Content:
    if encoding is not None:
        return Content(_as_utf8(raw, encoding, path, what))
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return Content(_as_utf8(raw, "utf-16", path, what, "it begins as UTF-16 and does not go on so"))
    if foreign and (order := _unmarked_utf16(raw)) is not None:
        return Content(
            _as_utf8(raw, order, path, what, "it looks like UTF-16 and is not"),
            ("in UTF-16, without a mark that says so",),
        )
    content = raw.removeprefix(codecs.BOM_UTF8)
    try:
        content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        if foreign:
            return _western(content, path, what, line)
        raise _no_text(path, what, "it is not text in UTF-8", line) from error
    return Content(content)


def _as_utf8(raw: bytes, encoding: str, path: Path, what: str, why: str | None = None) -> bytes:
    try:
        return raw.decode(encoding).encode()
    except LookupError as error:
        raise UsageError(
            f"{encoding!r} is no encoding", where=str(path), do="leave it out, or give --encoding utf-8"
        ) from error
    except UnicodeError as error:
        raise _no_text(path, what, why or f"it is not text in {encoding}") from error


def _unmarked_utf16(raw: bytes) -> str | None:
    """Return which UTF-16 a file is in, as its beginning shows; None if it is in none."""
    head = raw[:2000]
    half = len(head) // 2
    if half < 2 or head.count(0) < 0.6 * half:
        return None
    return "utf-16-le" if head[1::2].count(0) > head[::2].count(0) else "utf-16-be"


def _western(content: bytes, path: Path, what: str, line: int) -> Content:
    try:
        text = content.decode("windows-1252")
    except UnicodeDecodeError:
        text = ""
    if not text or not all(map(_is_western, _BEYOND_ASCII.findall(_ELISION.sub("", text)))):
        advice = f"{_AGAIN}, or name its encoding" + (
            ": --encoding cp932" if _decodes(content, "cp932") else ""
        )
        raise _no_text(path, what, "it is text neither in UTF-8 nor in Windows-1252 (Latin-1)", line, advice)
    strange = "".join(sorted({sign for sign in text if not sign.isascii()}))
    return Content(
        text.encode(),
        (
            "not in UTF-8, so read as Windows-1252 (Latin-1), in which its signs beyond ASCII are "
            f"{strange.strip() or 'spaces'}",
        ),
    )


def _is_western(signs: str) -> bool:
    """Return whether what is beyond ASCII is as in words of Western Europe.

    Letters stand alone, or small ones in twos; few signs occur. Text of another encoding has capitals and
    signs in a row.
    """
    if len(signs) == 1:
        return (signs.isalpha() and signs != "\N{LATIN SMALL LETTER F WITH HOOK}") or signs in _SIGNS
    return len(signs) == 2 and all(sign.islower() or sign in _SIGNS for sign in signs)


def _decodes(content: bytes, encoding: str) -> bool:
    try:
        content.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _visible(content: bytes) -> bytes:
    """Leave out what nobody sees: marks where files were joined, spaces of web pages, turns of direction."""
    return content if content.isascii() else _INVISIBLE.sub("", content.decode()).encode()


def _refuse_control(content: bytes, path: Path, what: str) -> None:
    suspect = len(content.translate(None, _CONTROL)) < len(content) or not content.isascii()
    if not suspect:
        return
    text = content.decode()
    if found := _STRANGE.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise _no_text(path, what, f"it has the control character {found[0]!r}", line)


def _no_text(path: Path, what: str, why: str, line: int | None = None, advice: str = _AGAIN) -> UsageError:
    where = f"{path}:{line}" if line else str(path)
    return UsageError(f"the {what} cannot be read: {why}", where=where, do=advice)
