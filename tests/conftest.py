"""What tests of several rooms need: a pseudo-terminal that can be typed into and unplugged; programs."""

import contextlib
import os
import signal
import sys
import tty
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

# Workers of pytest-xdist share the cores already; threads of BLAS beside them only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# A shell that starts `make test` in the background ignores SIGINT, and so would all that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

hypothesis.settings.register_profile("fixed", derandomize=True, deadline=None)
hypothesis.settings.register_profile("random", derandomize=False, deadline=None, print_blob=True)
hypothesis.settings.load_profile("fixed")  # `make fuzz` asks for the other one


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


def program(name: str) -> str:
    """The path of a program installed beside this Python, whether or not its folder is on the PATH."""
    path = Path(sys.executable).parent / name
    assert path.exists(), f"{name} is not installed: pip install -e '.[test]'"
    return str(path)


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
