"""A pseudo-terminal that can be typed into, sent bytes to and unplugged."""

import contextlib
import os
import tty
from collections.abc import Iterator

import pytest


class PseudoTerminal:
    """Both ends of a pty; the far end stands for the person or the box."""

    def __init__(self) -> None:
        self.far, self.near = os.openpty()
        self.name = os.ttyname(self.near)
        self._plugged = True

    def send(self, data: bytes) -> None:
        while data:
            data = data[os.write(self.far, data) :]

    def receive(self) -> bytes:
        return os.read(self.far, 1024)

    def unplug(self) -> None:
        if self._plugged:
            os.close(self.far)
            self._plugged = False

    def close(self) -> None:
        self.unplug()
        with contextlib.suppress(OSError):
            os.close(self.near)


@pytest.fixture
def pty() -> Iterator[PseudoTerminal]:
    """A terminal in its usual (cooked) mode."""
    terminal = PseudoTerminal()
    yield terminal
    terminal.close()


@pytest.fixture
def line() -> Iterator[PseudoTerminal]:
    """A raw one, as a serial line is."""
    terminal = PseudoTerminal()
    tty.setraw(terminal.near)
    yield terminal
    terminal.close()
