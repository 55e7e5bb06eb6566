"""Requests to pause or to abort: from signals, from the keyboard, from whoever notices that it must stop."""

import contextlib
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from autd_trials.errors import StoppedByPerson

_PAUSE = "SIGINT"
_ABORT = {"SIGTERM": "ended by SIGTERM", "SIGHUP": "the terminal was closed", "SIGQUIT": "ended by SIGQUIT"}
_SIGNALS = {getattr(signal, name): name for name in (_PAUSE, *_ABORT) if hasattr(signal, name)}
"""Windows knows neither SIGHUP, which a terminal window that is closed sends, nor SIGQUIT (Ctrl-\\)."""


class Interrupts:
    """The first request pauses the session at the next safe point, the second aborts it.

    An abort silences the array at once, in the thread in which it is requested (`on_abort`); the runner looks
    at the flags at least every `Clock.poll_s` and then logs it. So no write to the log and no command to the
    array is torn in two, and no stop waits for them either.

    Attributes
    ----------
    on_abort
        Silences the array; may be called from any thread, must not raise.
    pause_requested, abort_requested
        What was asked for and not yet answered.
    why
        What aborted the session.
    """

    def __init__(self) -> None:
        self.on_abort: Callable[[], None] = lambda: None
        self.pause_requested = False
        self.abort_requested = False
        self.why = ""

    def request(self) -> None:
        """Ask for a pause; asked again before the pause has ended, abort."""
        if self.pause_requested:
            self.request_abort()
        self.pause_requested = True

    def request_pause(self) -> None:
        """Ask for a pause, however often."""
        self.pause_requested = True

    def request_abort(self, why: str = "aborted by the experimenter") -> None:
        """Ask for an abort, and silence the array at once."""
        self.why = self.why or why
        self.abort_requested = self.pause_requested = True
        self.on_abort()

    def clear(self) -> None:
        """Forget a request for a pause that has been answered; an abort stays."""
        self.pause_requested = self.abort_requested

    def obey(self) -> None:
        """Raise StoppedByPerson if an abort was requested."""
        if self.abort_requested:
            raise StoppedByPerson(self.why)

    @contextmanager
    def on_signals(self, *, in_a_thread: bool) -> Iterator[None]:
        """Turn Ctrl-C into a request to pause; SIGTERM, SIGHUP and SIGQUIT into an abort.

        Parameters
        ----------
        in_a_thread
            Obey in a thread of its own, whatever the main thread waits for: a handler in Python would have to
            wait for it. In virtual time, where nothing is emitted, the handler does.
        """
        with contextlib.ExitStack() as stack:
            if in_a_thread:
                stack.enter_context(self._thread())
            for number in _SIGNALS:
                before = signal.signal(number, _leave_to_the_thread if in_a_thread else self._handle)
                stack.callback(signal.signal, number, before)
            yield

    @contextmanager
    def _thread(self) -> Iterator[None]:
        """Have the interpreter write each signal's number to a thread, as soon as it comes."""
        ours, theirs = socket.socketpair()
        with ours, theirs:
            theirs.setblocking(False)
            before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
            thread = threading.Thread(target=self._listen, args=(ours,), name="stops", daemon=True)
            thread.start()
            try:
                yield
            finally:
                signal.set_wakeup_fd(before)
                theirs.shutdown(socket.SHUT_RDWR)
                thread.join()

    def _listen(self, signals: socket.socket) -> None:
        while numbers := signals.recv(64):
            for number in numbers:
                if number in _SIGNALS:
                    self._take(_SIGNALS[signal.Signals(number)])

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        self._take(_SIGNALS[signal.Signals(number)])

    def _take(self, name: str) -> None:
        if name == _PAUSE:
            self.request()
        else:
            self.request_abort(_ABORT[name])


def _leave_to_the_thread(_number: int, _frame: FrameType | None) -> None:
    """Do nothing: the thread that the number was written to obeys; without a handler nothing is written."""
