"""Where the files of a study lie: BIDS labels in, paths out."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from autd_trials.errors import UsageError

_LABEL = re.compile(r"[A-Za-z0-9]{1,32}")


@dataclass(frozen=True)
class SessionPaths:
    """The files of one session of a study.

    Parameters
    ----------
    study
        The study's folder, ``DATA/<protocol name>``.
    participant, session
        BIDS labels, without ``sub-`` and ``ses-``.
    task
        BIDS task label.

    Raises
    ------
    UsageError
        The participant's or the session's label is not one.
    """

    study: Path
    participant: str
    session: str
    task: str

    def __post_init__(self) -> None:
        check_label("participant", self.participant)
        check_label("session", self.session)

    @property
    def log(self) -> Path:
        """The raw log, appended to while the session runs."""
        return source_folder(self.study) / self._folder / f"{self._stem}_log.jsonl"

    @property
    def events(self) -> Path:
        """The table of trials, made from the log."""
        return self.study / self._folder / "beh" / f"{self._stem}_events.tsv"

    @property
    def log_table(self) -> Path:
        """The table of what happened beside the trials, made from the log."""
        stem = f"sub-{self.participant}_ses-{self.session}_task-{self.task}_acq-log_run-1"
        return self.study / self._folder / "beh" / f"{stem}_beh.tsv"

    @property
    def _folder(self) -> Path:
        return Path(f"sub-{self.participant}", f"ses-{self.session}")

    @property
    def _stem(self) -> str:
        return f"sub-{self.participant}_ses-{self.session}_task-{self.task}_run-1"


def events_table(study: Path, log: Path) -> Path:
    """Return the table of trials that belongs to a log."""
    folder = log.parent.relative_to(source_folder(study))
    return study / folder / "beh" / f"{log.name.removesuffix('_log.jsonl')}_events.tsv"


def study_folder(data: Path, protocol_name: str) -> Path:
    """Return the folder of a study below the data folder."""
    return data / protocol_name


def source_folder(study: Path) -> Path:
    """Return the folder of a study's raw logs."""
    return study / "sourcedata"


def analysis_folder(study: Path) -> Path:
    """Return the folder of a study's results."""
    return study / "derivatives" / "analysis"


def log_paths(study: Path) -> list[Path]:
    """Return the raw logs of a study, sorted."""
    return sorted(source_folder(study).glob("sub-*/ses-*/sub-*_log.jsonl"))


def check_label(kind: Literal["participant", "session"], label: str) -> None:
    """See that `label` is a BIDS label.

    BIDS allows ASCII letters and digits only; at most 32 of them are allowed here, so that paths stay short
    enough for every file system.

    Raises
    ------
    UsageError
        It is not one.
    """
    if not _LABEL.fullmatch(label):
        raise UsageError(
            f"{label!r} cannot be a {kind} id",
            do="use 1 to 32 of the letters A-Z, a-z and digits: no spaces, hyphens, slashes, dots or accents",
        )
