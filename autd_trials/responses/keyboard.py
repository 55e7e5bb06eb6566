"""Presses on the terminal's keyboard: the experimenter scores a raised hand, or a foot switch types a key."""

from collections.abc import Sequence

from autd_trials.errors import DeviceError, UsageError
from autd_trials.inbox import Inbox
from autd_trials.responses.responder import Input, Presentation, Press, ResponderInfo, Unreadable
from autd_trials.terminal import Terminal
from autd_trials.terminal.keys import CONTROL_KEYS, ENTER, Key, plain_key

KEY_NAMES = {"space": " ", "enter": ENTER, "tab": "\t"}
"""Names of the keys that print nothing; every other key is named by its character."""

_TIME_UNCERTAINTY_S = 0.03
"""Assumed, not measured: scanning, debouncing and USB polling of a keyboard, and the terminal emulator. The
experimenter's own reaction to a raised hand comes on top and is not in it."""


class KeyboardResponder:
    """Takes its keys from a terminal and leaves the control keys to the runner.

    Other keys come as `Unreadable`, so that a foot switch that types something else does not go unnoticed. A
    key that is held down repeats; that is the session's to judge.

    Parameters
    ----------
    terminal
        An open terminal; it stays open after `close`.
    keys
        The response keys by name: `KEY_NAMES`, or single characters. A press' `button` is this name.

    Raises
    ------
    UsageError
        There is no key, or a name means none or a control key.
    """

    def __init__(self, terminal: Terminal, keys: tuple[str, ...] = ("space",)) -> None:
        self._terminal = terminal
        self._names = {_text_of(name): name for name in keys}
        self._inbox: Inbox[Key] | None = None
        if not keys:
            raise UsageError(
                "the keyboard has no response key", where="responder", do='name one, "space" say'
            )

    def open(self) -> ResponderInfo:
        """Begin to take the response keys; raises DeviceError if the terminal is closed or lost."""
        self.close()
        self._inbox = self._terminal.subscribe(self._names, others=True)
        return ResponderInfo(
            kind="keyboard",
            device=f"terminal, keys {', '.join(self._names.values())}",
            time_uncertainty_s=_TIME_UNCERTAINTY_S,
        )

    def present(self, presentation: Presentation) -> None:
        """Nothing: a person is presented with the real thing."""

    def read(self, until_s: float) -> Sequence[Input]:
        """Wait until `until_s` or a key; see `Responder.read`."""
        if self._inbox is None:
            raise DeviceError("the keyboard responder is not open", where="keyboard", do="open it first")
        return [self._input(key) for key in self._inbox.take(until_s)]

    def close(self) -> None:
        """Leave the keys to others; presses that were not read are gone."""
        if self._inbox is not None:
            self._terminal.unsubscribe(self._inbox)
            self._inbox = None

    def _input(self, key: Key) -> Input:
        if key.text in self._names:
            return Press(key.time_s, self._names[key.text])
        return Unreadable(key.time_s, f"the key {key.text!r}, which has no meaning here", may_be_answer=False)


def key_text(name: str) -> str:
    """Return what a key types.

    Parameters
    ----------
    name
        One of `KEY_NAMES`, or a single character.

    Raises
    ------
    ValueError
        It is no key, or one that steers the session.
    """
    text = KEY_NAMES.get(name, name)
    if name not in KEY_NAMES and not (len(name) == 1 and name.isprintable() and name != " "):
        raise ValueError(f"{name!r} is no key; allowed: a single character, {', '.join(KEY_NAMES)}")
    if control := CONTROL_KEYS.get(plain_key(text)):
        raise ValueError(f"the key {name!r} means {control} in a session; choose another one")
    return text


def _text_of(name: str) -> str:
    try:
        return key_text(name)
    except ValueError as error:
        raise UsageError(str(error), where="responder") from error
