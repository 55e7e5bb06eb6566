"""Requests to pause or to abort, from signals and from the keyboard."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Windows knows no SIGHUP, which a closed terminal window sends."""


class Interrupts:
    """The first request pauses the session at the next safe point, the second aborts it.

    A signal handler only sets flags here; the runner looks at them at least every `Clock.poll_s`, so that no
    write to the log and no command to the array is torn in two.
    """

    def __init__(self) -> None:
        self.pause_requested = False
        self.abort_requested = False

    def request(self) -> None:
        """Ask for a pause; asked again before the pause has ended, abort."""
        if self.pause_requested:
            self.abort_requested = True
        self.pause_requested = True

    def request_pause(self) -> None:
        """Ask for a pause, however often."""
        self.pause_requested = True

    def request_abort(self) -> None:
        """Ask for an abort at once."""
        self.pause_requested = True
        self.abort_requested = True

    def clear(self) -> None:
        """Forget a request for a pause that has been answered."""
        self.pause_requested = False

    @contextmanager
    def on_signals(self) -> Iterator[None]:
        """Turn Ctrl-C, SIGTERM and the closing of the terminal into requests while the context lasts."""

        def handle(_number: int, _frame: FrameType | None) -> None:
            self.request()

        before = {number: signal.signal(number, handle) for number in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
