"""A copy of a log that lost its name while it was written: the open file still holds what was recorded."""

import os
import tempfile
from pathlib import Path
from typing import BinaryIO

_ENDING = ".rescued"
"""Behind the log's whole name, so that the copy is not taken for a log before a person has looked at it."""


def rescue(file: BinaryIO, path: Path) -> Path:
    """Copy an open file beside its old path or, if that cannot be written to, into the system's temporary folder.

    Returns
    -------
    Path
        The copy; no file is ever overwritten.

    Raises
    ------
    OSError
        Neither folder can be written to.
    """
    file.seek(0)
    content = file.read()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return _write_new(path.parent, path.name, content)
    except OSError:
        return _write_new(Path(tempfile.gettempdir()), path.name, content)


def _write_new(folder: Path, name: str, content: bytes) -> Path:
    number = 1
    while True:
        copy = folder / f"{name}{_ENDING}{'' if number == 1 else number}"
        try:
            with copy.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            return copy
        except FileExistsError:
            number += 1
