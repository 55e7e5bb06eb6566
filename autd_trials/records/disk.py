"""Files that are either old or new, never half."""

import json
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from autd_trials.host import sync_folder


def replace_text(path: Path, text: str) -> None:
    """Write a text file so that a reader finds the old one or the new one, also after a crash.

    Raises
    ------
    OSError
        The disk refuses; the old file is still there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as half, half.open("wb") as file:
        file.write(text.encode("utf-8"))
        file.flush()
        os.fsync(file.fileno())
    sync_folder(path.parent)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name beside `path` to write to, which nobody else writes to; at the end it takes `path`'s place.

    If the body fails, what it wrote is removed and the old file stays.
    """
    half = path.with_name(f".{path.name[:100]}.{secrets.token_hex(8)}.part")
    try:
        yield half
        half.replace(path)
    finally:
        half.unlink(missing_ok=True)


def write_new(folder: Path, name: str, content: bytes) -> Path:
    """Write a file under a name that is free in a folder: the one given, or that with a number behind it.

    Returns
    -------
    Path
        The file; no other is ever overwritten.

    Raises
    ------
    OSError
        The disk refuses.
    """
    folder.mkdir(parents=True, exist_ok=True)
    number = 1
    while True:
        path = folder / (name if number == 1 else f"{name}.{number}")
        try:
            with path.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            return path
        except FileExistsError:
            number += 1


def json_text(content: Mapping[str, Any]) -> str:
    """Return a JSON file's text."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"
