"""Ids that people take for each other: by case, by leading zeros, by look."""

import re
from collections.abc import Iterable
from pathlib import Path

from autd_trials.errors import UsageError
from autd_trials.records.layout import source_folder

_SAME_LOOK = str.maketrans({"o": "0", "i": "1", "l": "1"})
_LEADING_ZEROS = re.compile(r"(?<![0-9])0+(?=[0-9])")


def look_alike(label: str) -> str:
    """Return the same text for all ids that look alike.

    >>> look_alike("01") == look_alike("1") == look_alike("OO1") == look_alike("I")
    True
    >>> look_alike("10") == look_alike("1")
    False
    """
    return _LEADING_ZEROS.sub("", label.casefold().translate(_SAME_LOOK))


def refuse_look_alikes(study: Path, participant: str, session: str) -> None:
    """Refuse ids that look like existing ones but are written otherwise.

    They would be two people, or two sessions, in the tables, with a place each; and names that differ only
    in case are one file on many file systems.

    Raises
    ------
    UsageError
        There is such an id.
    """
    for root in (study, source_folder(study)):
        _refuse(root, f"sub-{participant}")
        _refuse(root / f"sub-{participant}", f"ses-{session}")


def _refuse(folder: Path, name: str) -> None:
    prefix, label = name[:4], name[4:]
    for other in _labels(folder, prefix):
        if other != label and look_alike(other) == look_alike(label):
            raise UsageError(
                f"{name} looks like {prefix}{other}, which is there already",
                where=str(folder),
                do=f"write {other!r} if the same is meant, else choose an id that differs in more than upper "
                "and lower case, leading zeros, O and 0, or I, l and 1",
            )


def _labels(folder: Path, prefix: str) -> Iterable[str]:
    return sorted(path.name[4:] for path in folder.glob(f"{prefix}*"))
