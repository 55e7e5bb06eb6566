"""Hands what a reader thread receives to whoever waits for it."""

import threading
from collections.abc import Iterable
from typing import Generic, TypeVar

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError

T = TypeVar("T")

MOST_ITEMS = 10_000
"""What a source may be ahead of its reader; no person is."""


class Inbox(Generic[T]):
    """Items in the order in which they came, until their source is lost.

    Parameters
    ----------
    clock
        The clock in whose time `take` waits.
    most
        How many items may wait; a source that sends more counts as lost.
    """

    def __init__(self, clock: Clock, most: int = MOST_ITEMS) -> None:
        self._clock = clock
        self._most = most
        self._changed = threading.Condition()
        self._items: list[T] = []
        self._loss: tuple[str, str, str] | None = None

    def put(self, items: Iterable[T]) -> bool:
        """Add items and wake whoever waits; return whether the source may go on.

        Items that find no room are not kept, and the source is lost with the number of them.
        """
        with self._changed:
            new = list(items)
            room = 0 if self._loss else self._most - len(self._items)
            self._items.extend(new[:room])
            if len(new) > room and self._loss is None:
                self._loss = (
                    f"more than {self._most} inputs wait to be read; the last {len(new) - room} were dropped",
                    "responder",
                    "look for a button or a key that sticks, and check the box's protocol; then go on",
                )
            self._changed.notify_all()
            return self._loss is None

    def lose(self, what: str, *, where: str, do: str) -> None:
        """Say that nothing will come any more, in the words of a `TrialsError`."""
        with self._changed:
            self._loss = self._loss or (what, where, do)
            self._changed.notify_all()

    def take(self, until_s: float) -> list[T]:
        """Wait until something is there or the clock shows `until_s`; return all there is, oldest first.

        Raises
        ------
        DeviceError
            The source was lost and everything it had sent before was taken.
        """
        with self._changed:
            self._changed.wait_for(self._has_news, timeout=self._timeout_s(until_s))
            items, self._items = self._items, []
            loss = self._loss
        if not items and loss is not None:
            what, where, do = loss
            raise DeviceError(what, where=where, do=do)
        if not items:
            self._clock.sleep_until(until_s)
        return items

    def _has_news(self) -> bool:
        return bool(self._items) or self._loss is not None

    def _timeout_s(self, until_s: float) -> float:
        return min(max(until_s - self._clock.now_s(), 0.0), threading.TIMEOUT_MAX)
