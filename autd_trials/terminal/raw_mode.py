"""Single keys from a terminal. The only module that knows how POSIX and Windows terminals differ.

POSIX is tested; the Windows console is a fallback that was never run.
"""

import codecs
import contextlib
import os
import sys
import threading
from typing import Protocol

from autd_trials.errors import UsageError

_WINDOWS_POLL_S = 0.005  # the console cannot be waited on together with a request to stop
_DO_WITHOUT_TERMINAL = "use --yes with --simulate, or a rig with a button box"


class KeySource(Protocol):
    """A terminal in raw mode."""

    def read(self, timeout_s: float | None) -> str:
        """Return the characters that came, or nothing after `timeout_s`; raises EOFError at the end."""

    def stop(self) -> None:
        """Make `read` raise EOFError, now and from now on; may be called from any thread."""

    def restore(self) -> None:
        """Put the terminal's settings back; call it after the last `read`."""


def open_terminal(fd: int | None = None) -> KeySource:
    """Put a terminal into raw mode.

    Ctrl-C still makes SIGINT. Ctrl-Z, Ctrl-S and Ctrl-Q become plain keys: a session must be neither
    suspended nor stalled in mid-trial. What was typed before is discarded.

    Parameters
    ----------
    fd
        The terminal's file descriptor (POSIX only); standard input if None.

    Raises
    ------
    UsageError
        It is no terminal, or it belongs to another job.
    """
    number = _standard_input() if fd is None else fd
    if not os.isatty(number):
        raise UsageError(
            "there is no terminal to read keys from", where="standard input", do=_DO_WITHOUT_TERMINAL
        )
    if sys.platform == "win32":
        return _WindowsConsole()
    else:  # noqa: RET505 - mypy follows the platform only this way
        return _PosixTerminal(number)


def _standard_input() -> int:
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # no stdin at all, one without a descriptor, a closed one
        return -1


if sys.platform == "win32":

    class _WindowsConsole:
        def __init__(self) -> None:
            self._stopped = threading.Event()

        def read(self, timeout_s: float | None) -> str:
            import msvcrt

            waited_s = 0.0
            while timeout_s is None or waited_s < timeout_s:
                if msvcrt.kbhit():
                    character = msvcrt.getwch()
                    # A function key comes as a prefix and a letter; as ESC + letter it is one key here too.
                    return "\x1b" + msvcrt.getwch() if character in "\x00\xe0" else character
                if self._stopped.wait(_WINDOWS_POLL_S):
                    raise EOFError
                waited_s += _WINDOWS_POLL_S
            return ""

        def stop(self) -> None:
            self._stopped.set()

        def restore(self) -> None:
            pass  # the console's mode was not changed

else:

    class _PosixTerminal:
        def __init__(self, fd: int) -> None:
            import termios

            _refuse_in_background(fd)
            self._fd = fd
            self._decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
            self._stop_read, self._stop_write = os.pipe()
            self._settings = termios.tcgetattr(fd)
            termios.tcsetattr(fd, termios.TCSANOW, _raw(self._settings, fd))
            termios.tcflush(fd, termios.TCIFLUSH)

        def read(self, timeout_s: float | None) -> str:
            import select

            while True:
                ready, _, _ = select.select([self._fd, self._stop_read], [], [], timeout_s)
                if not ready:
                    return ""
                if self._stop_read in ready:
                    raise EOFError
                if text := self._decoder.decode(self._read_bytes()):
                    return text

        def _read_bytes(self) -> bytes:
            try:
                data = os.read(self._fd, 1024)
            except OSError as error:  # EIO: the terminal's other end is gone
                raise EOFError from error
            if not data:
                raise EOFError
            return data

        def stop(self) -> None:
            os.write(self._stop_write, b"x")

        def restore(self) -> None:
            import termios

            with contextlib.suppress(termios.error):  # the terminal is gone: nothing to put back
                termios.tcsetattr(self._fd, termios.TCSANOW, self._settings)
                termios.tcflush(self._fd, termios.TCIFLUSH)  # late keys are not for the shell
            os.close(self._stop_read)
            os.close(self._stop_write)

    def _raw(settings: list[int | list[bytes | int]], fd: int) -> list[int | list[bytes | int]]:
        import termios

        iflag, oflag, cflag, lflag, ispeed, ospeed, characters = settings
        assert isinstance(iflag, int)
        assert isinstance(lflag, int)
        assert isinstance(characters, list)
        changed = list(characters)
        changed[termios.VMIN], changed[termios.VTIME] = 1, 0
        changed[termios.VSUSP] = bytes([os.fpathconf(fd, "PC_VDISABLE") & 0xFF])
        return [
            iflag & ~termios.IXON,
            oflag,
            cflag,
            lflag & ~(termios.ECHO | termios.ICANON | termios.IEXTEN),
            ispeed,
            ospeed,
            changed,
        ]

    def _refuse_in_background(fd: int) -> None:
        try:
            foreground = os.tcgetpgrp(fd)
        except OSError:  # not this process' controlling terminal: no job control
            return
        if foreground != os.getpgrp():
            raise UsageError(
                "the terminal belongs to another job", where="standard input", do="run in the foreground (fg)"
            )
