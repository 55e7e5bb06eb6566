"""The SDK's firmware emulator in a process of its own.

``python -m autd_trials.array.emulator 18`` prints the address of 18 emulated devices and runs until its
standard input ends, that is, also when its parent dies.
"""

import contextlib
import re
import signal
import subprocess
import sys
from threading import Timer
from types import TracebackType
from typing import Self

from autd_trials.errors import DeviceError

_START_S = 10.0
_STOP_S = 1.0
_ADDRESS = re.compile(r"\[::1\]:\d+")


class Emulator:
    """A running firmware emulator; a context manager.

    Parameters
    ----------
    devices
        How many devices it emulates.

    Raises
    ------
    DeviceError
        If it does not start within 10 s.
    """

    def __init__(self, devices: int) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "autd_trials.array.emulator", str(devices)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,  # a Ctrl-C in the terminal is the runner's alone
        )
        self.address = self._read_address()

    @property
    def pid(self) -> int:
        """The emulator's process id."""
        return self._process.pid

    def kill(self) -> None:
        """End the emulator at once, as if the devices had lost their power."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End the emulator; never hangs, never raises, also twice."""
        for pipe in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):
                pipe.close()  # type: ignore[union-attr]  # both were asked for
        try:
            self._process.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            self.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _read_address(self) -> str:
        deadline = Timer(_START_S, self._process.kill)
        deadline.start()
        try:
            line = self._process.stdout.readline()  # type: ignore[union-attr]  # it was asked for
        finally:
            deadline.cancel()
        address = _ADDRESS.search(line)
        if address is None:
            self.close()
            raise DeviceError(
                "the firmware emulator did not start",
                do="check that this machine has an IPv6 loopback: `ping ::1`",
            )
        return address.group()


def main() -> None:
    """Emulate as many devices as the first argument says until standard input ends."""
    from autd3._autd3 import UdpEmulator

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    emulator = UdpEmulator(int(sys.argv[1]))
    print(repr(emulator.option().iface), flush=True)  # noqa: T201 - the parent reads it
    sys.stdin.read()


if __name__ == "__main__":
    main()
