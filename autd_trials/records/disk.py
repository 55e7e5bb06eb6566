"""Text files that are either old or new, never half."""

import json
import os
from collections.abc import Mapping
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
    half = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with half.open("wb") as file:
            file.write(text.encode("utf-8"))
            file.flush()
            os.fsync(file.fileno())
        half.replace(path)
    finally:
        half.unlink(missing_ok=True)
    sync_folder(path.parent)


def json_text(content: Mapping[str, Any]) -> str:
    """Return a JSON file's text."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"
