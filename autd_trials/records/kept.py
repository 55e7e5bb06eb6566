"""Writing files that people may have edited, so that nothing of theirs is lost.

What was made last is kept in ``sourcedata/made/``: what a file has besides is people's. It is carried into
the new file; where that cannot be done, it is laid into ``sourcedata/edited/``, with a remark.
"""

import json
from collections.abc import Callable
from pathlib import Path

from autd_trials.records.disk import json_text, replace_text, write_new
from autd_trials.records.layout import source_folder
from autd_trials.records.merging import NotATableError, merge_lines, merge_objects, merge_table

MADE, EDITED = "made", "edited"


def write_kept(study: Path, path: Path, ours: str) -> str | None:
    """Write a file of a study with what people added to it.

    Parameters
    ----------
    study
        The study's folder.
    path
        The file.
    ours
        What is made of the logs.

    Returns
    -------
    str or None
        What a person should be told: None if all that people added is in the new file.

    Raises
    ------
    OSError
        The disk refuses.
    """
    memory = source_folder(study) / MADE / path.relative_to(study)
    told = None
    try:
        base, theirs = _read(memory), _read(path)
        text = ours if theirs in (None, base, ours) else _merged(path, base, theirs or "", ours)
    except (NotATableError, ValueError, RecursionError):
        told = lay_aside(study, path)
        text = ours
    _write(path, text)
    _write(memory, ours)
    return told


def lay_aside(study: Path, path: Path) -> str:
    """Keep a copy of a file that was edited and is to be made again; return what to tell of it."""
    copy = write_new(source_folder(study) / EDITED, path.name, path.read_bytes())
    return (
        f"{path.relative_to(study)} was edited and is made again; the edited one is kept as "
        f"{copy.relative_to(study)}"
    )


def _merged(path: Path, base: str | None, theirs: str, ours: str) -> str:
    merge: Callable[[str, str, str], str]
    if path.suffix == ".tsv":
        return merge_table(base if base is not None else ours, theirs, ours)
    if base is None:
        raise ValueError("what was made last is not known")
    merge = _merge_json if path.suffix == ".json" else merge_lines
    return merge(base, theirs, ours)


def _merge_json(base: str, theirs: str, ours: str) -> str:
    made = json.loads(ours)
    merged = merge_objects(json.loads(base), json.loads(theirs), made)
    if not isinstance(merged, dict):
        raise ValueError("no JSON object any more")
    return json_text(_marked(merged, made))


def _marked(merged: dict[str, object], made: dict[str, object]) -> dict[str, object]:
    """Return a description that still says that data are simulated, whatever people made of its words."""
    for key in ("Name", "TaskDescription"):
        for mark in (" (simulated)", " (partly simulated)"):
            if str(made.get(key, "")).endswith(mark) and mark not in str(merged.get(key, "")):
                merged = merged | {key: f"{merged.get(key, '')}{mark}"}
    return merged


def _read(path: Path) -> str | None:
    try:
        return path.read_bytes().decode("utf-8")
    except FileNotFoundError:
        return None


def _write(path: Path, text: str) -> None:
    if not path.is_file() or path.read_bytes() != text.encode("utf-8"):
        replace_text(path, text)
