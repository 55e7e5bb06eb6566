"""The experimenter's terminal: every key goes to whom it is meant for, and questions are asked on it."""

import atexit
import contextlib
import os
import shutil
import signal
import sys
import threading
import unicodedata
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
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
    read_key,
)
from autd_trials.terminal.layouts import keys_of
from autd_trials.terminal.raw_mode import KeySource, open_terminal

_ESCAPE_TIMEOUT_S = 0.05  # the rest of an escape sequence follows sooner, also over ssh
_ASK_POLL_S = 0.1
_JOIN_TIMEOUT_S = 0.5


class Terminal:
    """Reads single keys in a thread, stamps each on arrival and routes it.

    A key goes to the innermost open question if there is one; else to everybody who subscribed to it; else,
    if it is one of `CONTROL_KEYS`, to `commands`; else to everybody who subscribed to the rest. Keys are
    known by their place: on a Greek layout, in upper case or under an input method they are the same. Ctrl-C
    still makes SIGINT (see `raw_mode.open_terminal`), also where the terminal sends it as a key. The terminal's settings are put back
    by `close`, at exit and on SIGTERM; after ``kill -9`` only ``reset`` in the shell can do that.

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
        The control keys that nobody subscribed to; and the rest, if nobody subscribed to that.
    """

    def __init__(self, clock: Clock, *, fd: int | None = None, output: TextIO | None = None) -> None:
        self.commands: Inbox[Key] = Inbox(clock)
        self._clock = clock
        self._fd = fd
        self._output = output
        self._lock = threading.Lock()
        self._subscriptions: list[tuple[frozenset[str], Inbox[Key]]] = []
        self._rest: list[Inbox[Key]] = []
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

    def subscribe(self, keys: Collection[str]) -> Inbox[Key]:
        """Return an inbox that gets these keys from now on (except while a question is open).

        The `text` of what it gets is the key as it was subscribed to.

        Raises
        ------
        DeviceError
            The terminal is not open or was lost.
        """
        inbox: Inbox[Key] = Inbox(self._clock)
        self._attach(lambda: self._subscriptions.append((frozenset(keys), inbox)))
        return inbox

    def subscribe_to_the_rest(self) -> Inbox[Key]:
        """Return an inbox that gets what is neither subscribed to nor a control key; raises as `subscribe`."""
        inbox: Inbox[Key] = Inbox(self._clock)
        self._attach(lambda: self._rest.append(inbox))
        return inbox

    def unsubscribe(self, inbox: Inbox[Key]) -> None:
        """End a subscription; its keys go to `commands` again unless somebody else wants them."""
        with self._lock:
            self._subscriptions = [entry for entry in self._subscriptions if entry[1] is not inbox]
            self._rest = [entry for entry in self._rest if entry is not inbox]

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
            # By character, not by place: on a Russian layout the letter for "no" lies on the key y.
            answers = (unicodedata.normalize("NFKC", key).lower() for key in self._answers(inbox, cancelled))
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
            for sent in decoder.feed(text) if text else decoder.flush():
                if (key := read_key(sent, time_s)) is not None:
                    self._route(key)
        if self._source is source:
            self._lose()

    def _route(self, key: Key) -> None:
        if key.text == INTERRUPT:
            os.kill(os.getpid(), signal.SIGINT)
            return
        with self._lock:
            if self._questions:
                self._questions[-1].put([key])
                return
            taken = False
            for wanted, inbox in self._subscriptions:
                if (name := _wanted(key, wanted)) is not None:
                    inbox.put([replace(key, text=name)])
                    taken = True
            if taken:
                return
            controls = [name for name in CONTROL_KEYS if name in key.keys]
            if controls:
                self.commands.put([replace(key, text=name) for name in controls])
                return
            for inbox in self._rest or [self.commands]:
                inbox.put([key])

    def _lose(self) -> None:
        with self._lock:
            self._lost = True
            for inbox in (
                self.commands,
                *self._questions,
                *self._rest,
                *(inbox for _, inbox in self._subscriptions),
            ):
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


def _wanted(key: Key, wanted: Collection[str]) -> str | None:
    """Return which of the wanted keys it is: that with its character, else the only one with its place.

    A letter that may lie on a wanted key and on another is none of them: an answer is not guessed.
    """
    if key.text in wanted:
        return key.text
    found = {name for name in wanted if keys_of(name) & key.keys}
    return found.pop() if len(found) == 1 and len(key.keys) == 1 else None
