"""The event log: one JSON object a line, durable before `append` returns, read back whatever happened."""

import contextlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self, cast

from pydantic import TypeAdapter, ValidationError

from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import hold, sync_folder
from autd_trials.session.events import Event, SessionStart

_EVENT: TypeAdapter[Event] = TypeAdapter(Event)


class EventLog:
    """A log that is being written; made by `create` or `reopen`, locked against a second writer until closed.

    Parameters
    ----------
    path
        The log's path.
    file
        The same, open unbuffered for reading and writing.
    durable
        Whether every event waits for the disk. Without it events survive the end of the process at any
        moment, but not that of the machine: enough for simulated sessions in virtual time, which can be run
        again.
    """

    def __init__(self, path: Path, file: BinaryIO, *, durable: bool) -> None:
        self._path = path
        self._file = file
        self._durable = durable
        try:
            hold(file.fileno())
        except OSError as error:
            file.close()
            raise UsageError(
                "another run is writing this log", where=str(path), do="wait for it to end, or stop it"
            ) from error

    @classmethod
    def create(cls, path: Path, *, durable: bool = True) -> Self:
        """Start a new log; its folders are made.

        Raises
        ------
        UsageError
            There is one already; a session never overwrites another.
        DeviceError
            The disk refuses.
        """
        try:
            _make_folder(path.parent)
            log = cls(path, _open_new(path), durable=durable)
            sync_folder(path.parent)
        except OSError as error:
            raise _disk_error(path, error) from error
        return log

    @classmethod
    def reopen(cls, path: Path, *, durable: bool = True) -> Self:
        """Go on with a log. A torn last line stays; the next event starts on a line of its own.

        Raises
        ------
        UsageError
            There is no such log, or another process is writing it.
        DeviceError
            The disk refuses.
        """
        try:
            return cls(path, cast(BinaryIO, path.open("r+b", buffering=0)), durable=durable)
        except FileNotFoundError as error:
            raise UsageError(
                "there is no such session", where=str(path), do="start it without --resume"
            ) from error
        except OSError as error:
            raise _disk_error(path, error) from error

    def append(self, event: Event) -> None:
        """Return when the event is on the disk (if the log is not durable: when the system has it).

        Raises
        ------
        DeviceError
            The disk is full or failed: the event is not in the log, and what was there before still is.
        """
        line = _encode(event)
        try:
            size = self._file.seek(0, os.SEEK_END)
            try:
                self._write(line if self._at_line_start(size) else b"\n" + line)
                if self._durable:
                    os.fsync(self._file.fileno())
            except OSError:
                self._take_back(size)
                raise
        except OSError as error:
            raise _disk_error(self._path, error) from error

    def close(self) -> None:
        """Release the log; one that nothing was written to is removed. May be called twice."""
        if self._file.closed:
            return
        with self._file:
            if self._file.seek(0, os.SEEK_END) == 0:
                self._path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _at_line_start(self, size: int) -> bool:
        if size == 0:
            return True
        self._file.seek(size - 1)
        return self._file.read(1) == b"\n"

    def _write(self, data: bytes) -> None:
        while data:
            data = data[self._file.write(data) :]

    def _take_back(self, size: int) -> None:
        # Where even this fails, the torn line stays and the next event starts on a line of its own.
        with contextlib.suppress(OSError):
            self._file.truncate(size)


@dataclass(frozen=True)
class LogContents:
    """What a log says.

    Parameters
    ----------
    path
        The log's path.
    events
        The events in order; the first is the session's start.
    damaged
        Line number (from 1) and text of each line that is not an event: torn by a crash, or edited.
    """

    path: Path
    events: tuple[Event, ...]
    damaged: tuple[tuple[int, str], ...] = ()

    @property
    def start(self) -> SessionStart:
        """The session's start."""
        start = self.events[0]
        assert isinstance(start, SessionStart)
        return start


def read_log(path: Path) -> LogContents:
    """Read a log, also a torn or damaged one.

    Raises
    ------
    UsageError
        There is no such file, or its first line is not a session's start.
    """
    with _open(path) as file:
        events: list[Event] = [_parse_start(path, file.readline())]
        damaged: list[tuple[int, str]] = []
        for number, line in enumerate(file, start=2):
            try:
                events.append(_EVENT.validate_json(line))
            except ValidationError:
                damaged.append((number, line.decode("utf-8", errors="backslashreplace").rstrip("\n")))
    return LogContents(path, tuple(events), tuple(damaged))


def read_start(path: Path) -> SessionStart:
    """Read only a log's first line; raises as `read_log` does."""
    with _open(path) as file:
        return _parse_start(path, file.readline())


def has_begun(path: Path) -> bool:
    """Return whether a log got past its first line; if not, its session never began."""
    with _open(path) as file:
        return file.readline().endswith(b"\n")


def _open(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as error:
        raise UsageError(f"the log cannot be read: {error.strerror}", where=str(path)) from error


def _parse_start(path: Path, line: bytes) -> SessionStart:
    try:
        return SessionStart.model_validate_json(line)
    except ValidationError as error:
        raise UsageError(
            "the first line is not the start of a session, or another version wrote it",
            where=f"{path}:1",
            do="put the file back from a backup, or move it out of the study's folder",
        ) from error


def _encode(event: Event) -> bytes:
    # A lone surrogate (a stray byte typed into a note) becomes "?": it must not cost the event.
    text = json.dumps(event.model_dump(), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.encode("utf-8", errors="replace") + b"\n"


def _open_new(path: Path) -> BinaryIO:
    try:
        return cast(BinaryIO, path.open("x+b", buffering=0))
    except FileExistsError as error:
        raise UsageError(
            "this session has been recorded already",
            where=str(path),
            do="choose another session id, or go on with this one with --resume",
        ) from error


def _make_folder(folder: Path) -> None:
    missing = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for made in missing:
        sync_folder(made.parent)


def _disk_error(path: Path, error: OSError) -> DeviceError:
    return DeviceError(
        f"disk: the log cannot be written: {error.strerror}",
        where=str(path),
        do="make room on the disk or mend it, then go on with --resume",
    )
