"""A copy of a log that lost its name while it was written: the open file still holds what was recorded."""

import tempfile
from pathlib import Path
from typing import BinaryIO

from autd_trials.records.disk import write_new

_ENDING = ".rescued"
"""Behind the log's whole name, so that the copy is not taken for a log before a person has looked at it."""


def rescue(file: BinaryIO, path: Path) -> Path:
    """Copy an open file beside its old path, or else into the system's temporary folder.

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
    content, name = file.read(), path.name + _ENDING
    try:
        return write_new(path.parent, name, content)
    except OSError:
        return write_new(Path(tempfile.gettempdir()), name, content)
