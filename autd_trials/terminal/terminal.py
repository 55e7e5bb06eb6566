"""The experimenter's terminal: every key goes to whom it is meant for, and questions are asked on it."""

import atexit
import contextlib
import os
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Collection, Iterator
from types import FrameType, TracebackType
from typing import Self, TextIO

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.inbox import Inbox
from autd_trials.terminal.keys import (
    CONTROL_KEYS,
    ESCAPE,
    INTERRUPT,
    Key,
    KeyDecoder,
    LineEditor,
    is_release,
    plain_character,
    plain_key,
)
from autd_trials.terminal.raw_mode import KeySource, open_terminal

_ESCAPE_TIMEOUT_S = 0.05  # the rest of an escape sequence follows sooner, also over ssh
_ASK_POLL_S = 0.1
_JOIN_TIMEOUT_S = 0.5


class Terminal:
    """Reads single keys in a thread, stamps each on arrival and routes it.

    A key goes to the innermost open question if there is one; else to everybody who subscribed to it, be it
    typed on another layout or with Caps Lock; else, if it is no control key, to who subscribed to all
    others; else to `commands`. Ctrl-C still makes SIGINT (see `raw_mode.open_terminal`), also where it
    comes as a key. The terminal's settings are put back by `close`, at exit and on SIGTERM; after ``kill
    -9`` only ``reset`` in the shell can do that.

    Parameters
    ----------
    clock
        Stamps the keys.
    fd
        The terminal's file descriptor (POSIX only); standard input if None.
    output
        Where questions are echoed; standard error if None.

    Attributes
    ----------
    commands
        The keys that nobody subscribed to, for the runner's controls.
    """

    def __init__(self, clock: Clock, *, fd: int | None = None, output: TextIO | None = None) -> None:
        self.commands: Inbox[Key] = Inbox(clock)
        self._clock = clock
        self._fd = fd
        self._output = output
        self._lock = threading.Lock()
        self._subscriptions: list[tuple[frozenset[str], Inbox[Key]]] = []
        self._others: list[Inbox[Key]] = []
        self._questions: list[Inbox[Key]] = []
        self._lost = False
        self._source: KeySource | None = None
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Take the terminal; keys typed before are discarded.

        Raises
        ------
        UsageError
            Standard input is no terminal, or belongs to another job.
        """
        if self._source is not None:
            return
        self._source = open_terminal(self._fd)
        self._lost = False
        atexit.register(self.close)
        self._handle_sigterm()
        self._thread = threading.Thread(target=self._read, args=(self._source,), name="terminal", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Put the terminal's settings back; may be called twice."""
        source, self._source = self._source, None
        if source is None:
            return
        atexit.unregister(self.close)
        source.stop()
        if (
            self._thread is not None
        ):  # not for ever: in a signal handler it may wait for a lock held further up
            self._thread.join(_JOIN_TIMEOUT_S)
        source.restore()
        self._unhandle_sigterm()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def subscribe(self, keys: Collection[str], *, others: bool = False) -> Inbox[Key]:
        """Return an inbox that gets these keys from now on (except while a question is open).

        With `others` it also gets every key that nobody subscribed to and that is no control key.

        Raises
        ------
        DeviceError
            The terminal is not open or was lost.
        """
        inbox: Inbox[Key] = Inbox(self._clock)

        def attach() -> None:
            self._subscriptions.append((frozenset(keys), inbox))
            if others:
                self._others.append(inbox)

        self._attach(attach)
        return inbox

    def unsubscribe(self, inbox: Inbox[Key]) -> None:
        """End a subscription; its keys go to `commands` again unless somebody else wants them."""
        with self._lock:
            self._subscriptions = [entry for entry in self._subscriptions if entry[1] is not inbox]
            self._others = [other for other in self._others if other is not inbox]

    @contextlib.contextmanager
    def question(self) -> Iterator[Inbox[Key]]:
        """Open a question: an inbox that gets every key, and nobody else any, while the context lasts."""
        inbox: Inbox[Key] = Inbox(self._clock)
        self._attach(lambda: self._questions.append(inbox))
        try:
            yield inbox
        finally:
            with self._lock:
                self._questions.remove(inbox)

    def ask_line(
        self,
        prompt: str,
        *,
        show: Callable[[str], None] | None = None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> str | None:
        """Ask for one line of text.

        Parameters
        ----------
        prompt
            Shown before the text.
        show
            Draws prompt and text after every key; if None, they are echoed to the terminal's output.
        cancelled
            Asked ten times a second; the question ends when it returns True.

        Returns
        -------
        str or None
            The text; None if Esc was pressed or `cancelled` said so.
        """
        editor = LineEditor()
        draw = show or self._echo
        with self.question() as inbox:
            draw(prompt)
            for key in self._answers(inbox, cancelled):
                editor.feed(key)
                draw(prompt + editor.text)
                if editor.state != "editing":
                    break
        if show is None:
            self._write("\n")
        return editor.text if editor.state == "done" else None

    def confirm(
        self,
        question: str,
        *,
        show: Callable[[str], None] | None = None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Ask a question and return whether it was answered with y; n and Esc are no, other keys nothing.

        A key typed before the question was asked does not answer it. For the parameters see `ask_line`.
        """
        with self.question() as inbox:
            (show or self._echo)(f"{question} [y/n] ")
            # By character, not by place: on a Russian layout the first letter of "no" lies on the key y.
            answers = (plain_character(key) for key in self._answers(inbox, cancelled))
            yes = next((key for key in answers if key in ("y", "n", ESCAPE)), "n") == "y"
        if show is None:
            self._write("yes\n" if yes else "no\n")
        return yes

    def _answers(self, inbox: Inbox[Key], cancelled: Callable[[], bool]) -> Iterator[str]:
        while not cancelled():
            for key in inbox.take(self._clock.now_s() + _ASK_POLL_S):
                yield key.text

    def _echo(self, text: str) -> None:
        width = shutil.get_terminal_size().columns - 1
        self._write(f"\r{text[-width:]:<{width}}\r{text[-width:]}")

    def _write(self, text: str) -> None:
        output = self._output or sys.stderr
        output.write(text)
        output.flush()

    def _attach(self, attach: Callable[[], None]) -> None:
        with self._lock:
            if self._source is None or self._lost:
                raise DeviceError(
                    "the terminal is not open" if self._source is None else "the terminal was lost",
                    where="terminal",
                    do="resume the session in a terminal",
                )
            attach()

    def _read(self, source: KeySource) -> None:
        decoder = KeyDecoder()
        while True:
            try:
                text = source.read(_ESCAPE_TIMEOUT_S if decoder.pending else None)
            except EOFError:
                break
            time_s = self._clock.now_s()
            for key in decoder.feed(text) if text else decoder.flush():
                self._route(Key(key, time_s))
        if self._source is source:
            self._lose()

    def _route(self, key: Key) -> None:
        if is_release(key.text):
            return
        if plain_character(key.text) == INTERRUPT:
            os.kill(os.getpid(), signal.SIGINT)
            return
        with self._lock:
            inboxes, text = self._destination(key.text)
            for inbox in inboxes:
                inbox.put([Key(text, key.time_s)])

    def _destination(self, typed: str) -> tuple[list[Inbox[Key]], str]:
        """Return who gets a key, and by which name."""
        if self._questions:
            return self._questions[-1:], typed
        for text in (typed, plain_key(typed)):
            if subscribed := [inbox for keys, inbox in self._subscriptions if text in keys]:
                return subscribed, text
        if plain_key(typed) in CONTROL_KEYS or not self._others:
            return [self.commands], plain_key(typed)
        return self._others, typed

    def _lose(self) -> None:
        with self._lock:
            self._lost = True
            for inbox in (self.commands, *self._questions, *(inbox for _, inbox in self._subscriptions)):
                inbox.lose("the terminal was lost", where="terminal", do="resume the session in a terminal")

    def _handle_sigterm(self) -> None:
        in_main_thread = threading.current_thread() is threading.main_thread()
        if in_main_thread and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, self._on_sigterm)

    def _unhandle_sigterm(self) -> None:
        if signal.getsignal(signal.SIGTERM) == self._on_sigterm:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def _on_sigterm(self, number: int, _frame: FrameType | None) -> None:
        self.close()
        os.kill(os.getpid(), number)
