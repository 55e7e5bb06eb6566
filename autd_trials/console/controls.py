"""The keys that steer a session while trials run, obeyed in a thread of their own."""

import threading
from types import TracebackType
from typing import Self

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.session.interrupts import Interrupts
from autd_trials.terminal import Terminal
from autd_trials.terminal.keys import CONTROL_KEYS, plain_key

_POLL_S = 0.1


class Controls:
    """Turns p, n and a, typed while no question is asked, into requests, whatever the session waits for.

    A terminal that is closed aborts the session.

    Parameters
    ----------
    terminal
        The open terminal.
    interrupts
        Where the requests go.
    clock
        The machine's clock.

    Attributes
    ----------
    note_wanted
        Whether the pause that was requested is for a note.
    """

    def __init__(self, terminal: Terminal, interrupts: Interrupts, clock: Clock) -> None:
        self.note_wanted = False
        self._terminal = terminal
        self._interrupts = interrupts
        self._clock = clock
        self._ended = False
        self._thread = threading.Thread(target=self._listen, name="controls", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended = True
        self._thread.join()

    def _listen(self) -> None:
        while not self._ended:
            try:
                keys = self._terminal.commands.take(self._clock.now_s() + _POLL_S)
            except DeviceError:
                self._interrupts.request_abort("the terminal was closed")
                return
            for key in keys:
                self._take(plain_key(key.text))

    def _take(self, key: str) -> None:
        match CONTROL_KEYS.get(key):
            case "pause":
                self._interrupts.request_pause()
            case "note":
                self.note_wanted = True
                self._interrupts.request_pause()
            case "abort":
                self._interrupts.request_abort()


def controls_line(*, answers: str | None, keys: bool, attended: bool) -> str:
    """Return what the experimenter can do while trials run; nothing is shown that does nothing.

    Parameters
    ----------
    answers
        How an answer is given; None if that is nobody's concern.
    keys
        Whether keys are read from the terminal.
    attended
        Whether somebody answers in a pause; if not, a pause ends the session.
    """
    shown = [answers] if answers else []
    if keys:
        shown += ["p: pause", "n: pause for a note"] if attended else ["p: stop after this trial"]
        shown.append("a: ABORT")
    shown.append("Ctrl-C: pause, again: ABORT" if attended else "Ctrl-C: stop after this trial, again: ABORT")
    return "   ".join(shown)
