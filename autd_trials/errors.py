"""What can go wrong, sorted by exit code."""

from typing import ClassVar


class TrialsError(Exception):
    """Something a user can cause or mend; shown as a message, never as a traceback.

    Parameters
    ----------
    what
        What is wrong, in one sentence or several lines.
    where
        The place: ``file:line:column``, a device, a folder.
    do
        What to do about it.
    """

    exit_code: ClassVar[int] = 2

    def __init__(self, what: str, *, where: str | None = None, do: str | None = None) -> None:
        super().__init__(what)
        self.what = what
        self.where = where
        self.do = do

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        advice = f"\n  -> {self.do}" if self.do else ""
        return f"{place}{self.what}{advice}"


class UsageError(TrialsError):
    """A bad command line or a bad file."""

    exit_code = 2


class StoppedByPerson(TrialsError):
    """A person ended the run."""

    exit_code = 3


class DeviceError(TrialsError):
    """A device failed, was lost or is not what the rig file says."""

    exit_code = 4


class UnsafeError(TrialsError):
    """A limit that protects people would be passed; refused, never clipped."""

    exit_code = 5
