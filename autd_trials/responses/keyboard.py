"""Presses on the terminal's keyboard: the experimenter scores a raised hand, or a foot switch types a key."""

import math
from contextlib import suppress

from autd_trials.errors import DeviceError, UsageError
from autd_trials.inbox import Inbox
from autd_trials.responses.responder import Presentation, Press, Repeat, ResponderInfo, Unreadable
from autd_trials.terminal import Terminal
from autd_trials.terminal.keys import KEY_NAMES, Key, key_of_name

FIRST_REPEAT_S, REPEAT_S = 1.1, 0.12
"""A key that is held down comes again after 0.25 to 1 s, and from then on 10 to 40 times a second."""

_TIME_UNCERTAINTY_S = 0.03
"""Assumed, not measured: scanning, debouncing and USB polling of a keyboard, and the terminal emulator. The
experimenter's own reaction to a raised hand comes on top and is not in it."""


class KeyboardResponder:
    """Takes its keys from a terminal and leaves all others to the runner's controls.

    A key that is held down repeats. Where the terminal says which are repeats, that is taken; else a key that
    comes again within `REPEAT_S` is one, and within `FIRST_REPEAT_S` it is perhaps the first. What comes from
    keys that are neither response keys nor controls is unreadable: it may have been meant as an answer.

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
        self._rest: Inbox[Key] | None = None
        self._last_s: dict[str, float] = {}
        if not keys:
            raise UsageError(
                "the keyboard has no response key", where="responder", do='name one, "space" say'
            )

    def open(self) -> ResponderInfo:
        """Begin to take the response keys; raises DeviceError if the terminal is closed or lost."""
        self.close()
        self._inbox = self._terminal.subscribe(self._names)
        self._rest = self._terminal.subscribe_to_the_rest()
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
        return [self._press(key) for key in self._inbox.take(until_s)]

    def unreadable(self) -> list[Unreadable]:
        """Return the keys that mean nothing here."""
        keys: list[Key] = []
        with suppress(DeviceError):  # `read` says so
            keys = self._rest.take(-math.inf) if self._rest else []
        return [Unreadable(key.time_s, f"key {key.text!r}, which is no response key") for key in keys]

    def close(self) -> None:
        """Leave the keys to others; presses that were not read are gone."""
        for inbox in (self._inbox, self._rest):
            if inbox is not None:
                self._terminal.unsubscribe(inbox)
        self._inbox = self._rest = None
        self._last_s.clear()

    def _press(self, key: Key) -> Press:
        last_s = self._last_s.get(key.text)
        self._last_s[key.text] = key.time_s
        since_s = math.inf if last_s is None else key.time_s - last_s
        return Press(key.time_s, self._names[key.text], repeat=_repeat(key.repeat, since_s))


def _repeat(told: bool | None, since_s: float) -> Repeat:
    """Return whether a key is a repeat: what the terminal told, else by the time since it came before."""
    if told is not None:
        return "yes" if told else "no"
    return "yes" if since_s < REPEAT_S else "perhaps" if since_s < FIRST_REPEAT_S else "no"


def _key_text(name: str) -> str:
    key = key_of_name(name)
    if key is not None:
        return key
    raise UsageError(
        f"{name!r} is no key",
        where="responder",
        do=f"use a single character or one of {', '.join(KEY_NAMES)}",
    )
