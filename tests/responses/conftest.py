"""A Cedrus pad."""

import os
import select
import threading
from typing import Self

from tests.conftest import PseudoTerminal


class XidPad:
    """A Cedrus pad at the far end of a serial line: answers who it is, sends presses and releases.

    Written from the published description, not from a real pad.
    """

    def __init__(self, line: PseudoTerminal, identity: bytes = b"_xid0") -> None:
        self.commands = b""
        self._line = line
        self._identity = identity
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._wake_read, self._wake_write = os.pipe()
        self._ms = 1000

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        os.close(self._wake_read)
        os.close(self._wake_write)

    def press(self, button: int = 1) -> None:
        self._ms += 10
        for pressed in (0x10, 0x00):
            self._line.send(bytes([ord("k"), (button % 8) << 5 | pressed]) + self._ms.to_bytes(4, "little"))

    def unplug(self) -> None:
        self._stop()
        self._line.unplug()

    def _stop(self) -> None:
        os.write(self._wake_write, b"x")
        self._thread.join()

    def _listen(self) -> None:
        while True:
            ready, _, _ = select.select([self._line.far, self._wake_read], [], [])
            if self._wake_read in ready:
                return
            self.commands += self._line.receive()
            if self.commands.endswith(b"_c1"):
                self._line.send(self._identity)
