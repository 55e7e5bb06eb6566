"""What differs between operating systems: files that one process at a time may hold, and durable names."""

import contextlib
import os
import sys
from pathlib import Path

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_WINDOWS_HELD_BYTE = 1 << 30  # far behind the text, which stays readable for others
_FLAGS = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)  # never through a link that someone left in /tmp


class FileHeldError(Exception):
    """Another holds the file; `pid` is the process id in it, None if there is none to be read."""

    def __init__(self, pid: int | None) -> None:
        super().__init__(f"held by process {pid}")
        self.pid = pid


class HeldFile:
    """A file held by this process until it is released, or the process dies, however it dies.

    The hold is the operating system's (`flock` on POSIX; `msvcrt.locking` on Windows, which is untested), so
    a file left behind by a dead process does not block. A second hold fails in the same process too.

    Parameters
    ----------
    path
        The file; made if there is none. It stays when it is released: to remove it would be a race.

    Raises
    ------
    FileHeldError
        If another holds it.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = _open_for_anyone(path)
        try:
            hold(self._descriptor)
        except OSError:
            pid = _read_pid(self._descriptor)
            os.close(self._descriptor)
            raise FileHeldError(pid) from None
        os.ftruncate(self._descriptor, 0)
        os.write(self._descriptor, str(os.getpid()).encode())

    def release(self) -> None:
        """Let the file go; the hold ends with the descriptor."""
        os.close(self._descriptor)


def hold(descriptor: int) -> None:
    """Hold an open file until its descriptor is closed; raises OSError if another holds it."""
    if sys.platform == "win32":
        os.lseek(descriptor, _WINDOWS_HELD_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        os.lseek(descriptor, 0, os.SEEK_SET)
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable; on Windows, where folders cannot be opened, nothing is done."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _open_for_anyone(path: Path) -> int:
    """Open the file for reading and writing, also if another user made it."""
    with contextlib.suppress(FileNotFoundError):
        return os.open(path, _FLAGS)  # without O_CREAT, which Linux refuses for others' files in /tmp
    descriptor = os.open(path, _FLAGS | os.O_CREAT, 0o666)
    with contextlib.suppress(OSError):
        path.chmod(0o666)  # the umask took the others' right to it; another user may have made it meanwhile
    return descriptor


def _read_pid(descriptor: int) -> int | None:
    text = os.read(descriptor, 20)
    return int(text) if text.isdigit() else None
