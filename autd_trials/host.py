"""What differs between operating systems: files that one process at a time may hold, and durable names."""

import contextlib
import errno
import os
import sys
import time
from pathlib import Path

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_WINDOWS_HELD_BYTE = 1 << 30  # far behind the text, which stays readable for others
_FLAGS = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)  # never through a link that someone left in /tmp
_TAKEN = frozenset({errno.EAGAIN, errno.EACCES, errno.EDEADLK})
"""What the systems say if another holds a file; anything else means that it cannot be held at all."""
_POLL_S = 0.02


class FileHeldError(Exception):
    """Another holds the file; `pid` is the process id in it, None if there is none to be read."""

    def __init__(self, pid: int | None) -> None:
        super().__init__(f"held by process {pid}")
        self.pid = pid


class NoLocksError(OSError):
    """The file system cannot lock files, so nobody can be kept out."""


class HeldFile:
    """A file held by this process until it is released, or the process dies, however it dies.

    The hold is the operating system's (`flock` on POSIX; `msvcrt.locking` on Windows, which is untested), so
    a file left behind by a dead process does not block. A second hold fails in the same process too.

    Parameters
    ----------
    path
        The file; made if there is none. It stays when it is released: to remove it would be a race.
    patience_s
        How long to wait, in s, while another holds it.

    Raises
    ------
    FileHeldError
        If another holds it.
    NoLocksError
        If the file system cannot lock files.
    OSError
        If the file cannot be opened.
    """

    def __init__(self, path: Path, *, patience_s: float = 0.0) -> None:
        self._path = path
        while True:
            self._descriptor = _open_for_anyone(path)
            try:
                hold(self._descriptor, patience_s=patience_s)
            except BaseException:
                os.close(self._descriptor)
                raise
            if self.intact:
                break
            os.close(self._descriptor)  # removed between opening and holding: others would hold another file
        with contextlib.suppress(OSError):  # on a full disk the hold is as good without the number
            os.ftruncate(self._descriptor, 0)
            os.write(self._descriptor, str(os.getpid()).encode())

    @property
    def intact(self) -> bool:
        """Whether the held file still lies at its path; if not, another process can hold a new one there."""
        return lies_at(self._descriptor, self._path)

    def release(self) -> None:
        """Let the file go; the hold ends with the descriptor."""
        os.close(self._descriptor)


def hold(descriptor: int, *, patience_s: float = 0.0) -> None:
    """Hold an open file until its descriptor is closed, waiting at most so long while another holds it.

    Raises
    ------
    FileHeldError
        If another holds it.
    NoLocksError
        If the file system cannot lock files.
    """
    until_s = time.monotonic() + patience_s
    while True:
        try:
            return _lock(descriptor)
        except OSError as error:
            if error.errno not in _TAKEN:
                what = f"its file system cannot lock files ({error.strerror})"
                raise NoLocksError(error.errno, what) from error
            if time.monotonic() >= until_s:
                raise FileHeldError(_read_pid(descriptor)) from None
        time.sleep(_POLL_S)


def lies_at(descriptor: int, path: Path) -> bool:
    """Return whether an open file is still the one at a path: not removed, renamed or replaced."""
    here = os.fstat(descriptor)
    try:
        there = path.stat()
    except OSError:
        return False
    return here.st_nlink > 0 and (here.st_dev, here.st_ino) == (there.st_dev, there.st_ino)


def since_boot() -> tuple[str | None, float]:
    """Return which boot of the computer this is, and seconds since then on a clock that nobody sets.

    The boot is None where the system does not say, on all but Linux.
    """
    boot: str | None = None
    with contextlib.suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    clock = getattr(time, "CLOCK_BOOTTIME", None)  # goes on while the computer sleeps
    return boot, time.monotonic() if clock is None else time.clock_gettime(clock)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable; on Windows, where folders cannot be opened, nothing is done."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> None:
    if sys.platform == "win32":
        os.lseek(descriptor, _WINDOWS_HELD_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        os.lseek(descriptor, 0, os.SEEK_SET)
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _open_for_anyone(path: Path) -> int:
    """Open the file for reading and writing, also if another user made it."""
    with contextlib.suppress(FileNotFoundError):
        return os.open(path, _FLAGS)  # without O_CREAT, which Linux refuses for others' files in /tmp
    descriptor = os.open(path, _FLAGS | os.O_CREAT, 0o666)
    with contextlib.suppress(OSError):
        path.chmod(0o666)  # the umask took the others' right to it; another user may have made it meanwhile
    return descriptor


def _read_pid(descriptor: int) -> int | None:
    os.lseek(descriptor, 0, os.SEEK_SET)
    text = os.read(descriptor, 20)
    return int(text) if text.isdigit() else None
