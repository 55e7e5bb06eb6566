"""Presses on the terminal's keyboard: the experimenter scores a raised hand, or a foot switch types a key."""

from autd_trials.errors import DeviceError, UsageError
from autd_trials.inbox import Inbox
from autd_trials.responses.responder import Presentation, Press, ResponderInfo
from autd_trials.terminal import Terminal
from autd_trials.terminal.keys import ENTER, Key

KEY_NAMES = {"space": " ", "enter": ENTER, "tab": "\t"}
"""Names of the keys that print nothing; every other key is named by its character."""

_TIME_UNCERTAINTY_S = 0.03
"""Assumed, not measured: scanning, debouncing and USB polling of a keyboard, and the terminal emulator. The
experimenter's own reaction to a raised hand comes on top and is not in it."""


class KeyboardResponder:
    """Takes its keys from a terminal and leaves all others to the runner's controls.

    A key that is held down repeats; the repeats are presses like any other.

    Parameters
    ----------
    terminal
        An open terminal; it stays open after `close`.
    keys
        The response keys by name: `KEY_NAMES`, or single characters. A press' `button` is this name.

    Raises
    ------
    UsageError
        There is no key, or a name means none.
    """

    def __init__(self, terminal: Terminal, keys: tuple[str, ...] = ("space",)) -> None:
        self._terminal = terminal
        self._names = {_key_text(name): name for name in keys}
        self._inbox: Inbox[Key] | None = None
        if not keys:
            raise UsageError(
                "the keyboard has no response key", where="responder", do='name one, "space" say'
            )

    def open(self) -> ResponderInfo:
        """Begin to take the response keys; raises DeviceError if the terminal is closed or lost."""
        self.close()
        self._inbox = self._terminal.subscribe(self._names)
        return ResponderInfo(
            kind="keyboard",
            device=f"terminal, keys {', '.join(self._names.values())}",
            time_uncertainty_s=_TIME_UNCERTAINTY_S,
        )

    def present(self, presentation: Presentation) -> None:
        """Nothing: a person is presented with the real thing."""

    def read(self, until_s: float) -> list[Press]:
        """Wait until `until_s` or a press; see `Responder.read`."""
        if self._inbox is None:
            raise DeviceError("the keyboard responder is not open", where="keyboard", do="open it first")
        return [Press(key.time_s, self._names[key.text]) for key in self._inbox.take(until_s)]

    def close(self) -> None:
        """Leave the keys to others; presses that were not read are gone."""
        if self._inbox is not None:
            self._terminal.unsubscribe(self._inbox)
            self._inbox = None


def _key_text(name: str) -> str:
    if name in KEY_NAMES:
        return KEY_NAMES[name]
    if len(name) == 1 and name.isprintable() and name != " ":
        return name
    raise UsageError(
        f"{name!r} is no key",
        where="responder",
        do=f"use a single character or one of {', '.join(KEY_NAMES)}",
    )
