"""The event log: one JSON object a line, durable before `append` returns, read back whatever happened."""

import contextlib
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self, cast

from pydantic import TypeAdapter, ValidationError

from autd_trials.errors import DeviceError, UsageError
from autd_trials.host import FileHeldError, NoLocksError, hold, lies_at, sync_folder
from autd_trials.records.chain import Head, Line, split_lines
from autd_trials.records.rescue import rescue
from autd_trials.session.events import Event, ResponseMade, SessionStart, StimulusStart, TrialEnd, TrialStart

_EVENT: TypeAdapter[Event] = TypeAdapter(Event)
_PATIENCE_S = 0.2
"""For others who hold a log for a moment, to see whether it is being written."""


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
        self._head = Head()
        self._size = 0
        self._tail = b""
        self._at_line_start = True
        try:
            _hold(path, file)
            self._take_stock()
        except BaseException:
            file.close()
            raise

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
            The disk is full or failed: the event is not in the log, and what was there before still is. Or
            the log is not whole.
        """
        self.append_all([event])

    def append_all(self, events: Iterable[Event]) -> None:
        """Append events with one write and one wait for the disk; raises as `append`: then none is in it."""
        self.refuse_if_not_whole()
        written, head = b"" if self._at_line_start else b"\n", self._head
        for event in events:
            line = head.seal(_encode(event))
            written += line + b"\n"
            head = head.after(Line.parse(line))
        try:
            try:
                self._file.seek(self._size)
                self._write(written)
                if self._durable:
                    os.fsync(self._file.fileno())
            except OSError:
                self._take_back()
                raise
        except OSError as error:
            raise _disk_error(self._path, error) from error
        self._size += len(written)
        self._head, self._tail, self._at_line_start = head, written, True
        self.refuse_if_not_whole()

    def refuse_if_not_whole(self) -> None:
        """See that the file at the log's path is the one that is written, and is as it was written.

        To be asked before anything is emitted: what the log does not keep must not happen.

        Raises
        ------
        DeviceError
            The file was removed, renamed or replaced, or another program wrote into it.
        """
        if not lies_at(self._file.fileno(), self._path):
            raise DeviceError(
                "disk: the log was removed, renamed or replaced while the session was running",
                where=str(self._path),
                do="find out what did that; put the log back, then go on with --resume",
            )
        self._file.seek(max(0, self._size - len(self._tail)))
        if self._file.read(len(self._tail) + 1) != self._tail:
            raise DeviceError(
                "disk: another program changed the log while the session was running",
                where=str(self._path),
                do="find out what did that (autd-trials study verify STUDY says what is wrong with the log)",
            )

    def close(self) -> None:
        """Release the log; one that nothing was written to is removed. May be called twice.

        Raises
        ------
        DeviceError
            The log was removed meanwhile; what it held was copied to where the message says.
        """
        if self._file.closed:
            return
        with self._file:
            if not lies_at(self._file.fileno(), self._path):
                self._rescue()
            elif self._size == 0:
                self._path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _take_stock(self) -> None:
        """Read what the file holds, and so where its chain stands."""
        self._file.seek(0)
        content = self._file.read()
        lines = split_lines(content)
        self._head = Head()
        for line in lines:
            self._head = self._head.after(Line.parse(line))
        self._size = len(content)
        self._at_line_start = content[-1:] in (b"", b"\n")
        self._tail = content[-1000:]

    def _write(self, data: bytes) -> None:
        while data:
            data = data[self._file.write(data) :]

    def _take_back(self) -> None:
        # Where even this fails, the torn line stays and the next event starts on a line of its own.
        try:
            self._file.truncate(self._size)
        except OSError:
            with contextlib.suppress(OSError):
                self._take_stock()

    def _rescue(self) -> None:
        """Copy a log that has no name any more; one that was only renamed is where it was moved to."""
        if os.fstat(self._file.fileno()).st_nlink > 0 or self._size == 0:
            return
        copy = rescue(self._file, self._path)
        raise DeviceError(
            f"disk: the log was removed while the session was running; what it held is in {copy}",
            where=str(self._path),
            do="move it back to that path, then look at it with autd-trials study verify STUDY",
        )


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
        Line number (from 1) and text of each line that is not an event of this session: torn by a crash, or
        edited.
    lines
        The line number of each event.
    head
        Where the log's chain stands behind its last line.
    """

    path: Path
    events: tuple[Event, ...]
    damaged: tuple[tuple[int, str], ...] = ()
    lines: tuple[int, ...] = ()
    head: Head = field(default_factory=Head)

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
        raw = split_lines(file.read())
    return read_lines(path, raw)


def read_lines(path: Path, raw: Iterable[bytes]) -> LogContents:
    """Return what a log's lines say; raises as `read_log` does."""
    lines = [Line.parse(line) for line in raw]
    start = _parse_start(path, lines[0].event if lines else b"")
    planned = {trial.trial for trial in start.plan.trials}
    events: list[Event] = [start]
    numbers, damaged = [1], []
    head = Head()
    for number, line in enumerate(lines, start=1):
        head = head.after(line)
        if number == 1:
            continue
        event = _parse(line.event)
        if event is None or not _belongs(event, planned):
            damaged.append((number, line.text.decode("utf-8", errors="backslashreplace")))
        else:
            events.append(event)
            numbers.append(number)
    return LogContents(path, tuple(events), tuple(damaged), tuple(numbers), head)


def read_start(path: Path) -> SessionStart:
    """Read only a log's first line; raises as `read_log` does."""
    with _open(path) as file:
        return _parse_start(path, Line.parse(file.readline().removesuffix(b"\n")).event)


def has_begun(path: Path) -> bool:
    """Return whether a log got past its first line; if not, its session never began."""
    with _open(path) as file:
        return file.readline().endswith(b"\n")


def is_being_written(path: Path) -> bool:
    """Return whether a session is writing a log now."""
    try:
        with path.open("r+b") as file:
            hold(file.fileno())
    except FileHeldError:
        return True
    except OSError:
        return False  # read-only, or without locks: nobody can write it through this program
    return False


def _open(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as error:
        raise UsageError(f"the log cannot be read: {error.strerror}", where=str(path)) from error


def _parse_start(path: Path, event: bytes) -> SessionStart:
    start = _parse(event)
    if isinstance(start, SessionStart):
        return start
    raise UsageError(
        "the first line is not the start of a session, or another version wrote it",
        where=f"{path}:1",
        do="put the file back from a backup, or move it out of the study's folder",
    )


def _parse(event: bytes) -> Event | None:
    """Return the event that a line holds; None if it holds none."""
    parsed = _event(event)
    return parsed if parsed is not None else _event(_without_envelope(event))


def _event(text: bytes) -> Event | None:
    try:
        return _EVENT.validate_json(text)
    except ValidationError:
        return None


def _without_envelope(line: bytes) -> bytes:
    """Return a line that an editor wrote in another layout without number and chain; it can still be read."""
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        return b""
    if not isinstance(content, dict):
        return b""
    return json.dumps({key: value for key, value in content.items() if key not in ("n", "chain")}).encode()


def _belongs(event: Event, planned: set[int]) -> bool:
    """Return whether an event can be one of the session's after its start."""
    if isinstance(event, SessionStart):
        return False
    if isinstance(event, ResponseMade) and event.trial is None:
        return True
    if isinstance(event, TrialStart | StimulusStart | ResponseMade | TrialEnd):
        return event.trial in planned and event.attempt is not None and event.attempt >= 1
    return True


def _encode(event: Event) -> bytes:
    # A lone surrogate (a stray byte typed into a note) becomes "?": it must not cost the event.
    text = json.dumps(event.model_dump(), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.encode("utf-8", errors="replace")


def _hold(path: Path, file: BinaryIO) -> None:
    try:
        hold(file.fileno(), patience_s=_PATIENCE_S)
    except FileHeldError as error:
        raise UsageError(
            "another run is writing this log", where=str(path), do="wait for it to end, or stop it"
        ) from error
    except NoLocksError as error:
        raise no_locks(path, error) from error


def no_locks(path: Path, error: NoLocksError) -> UsageError:
    """Return the refusal of a file system on which two runs could write into each other's records."""
    return UsageError(
        f"the record cannot be protected from a second run: {error.strerror}",
        where=str(path),
        do="record to a local disk (--data), and copy the study afterwards",
    )


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
