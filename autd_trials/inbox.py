"""Hands what a reader thread receives to whoever waits for it."""

import threading
from collections.abc import Iterable
from typing import Generic, TypeVar

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError

T = TypeVar("T")

MOST_WAITING = 10_000
"""More items than that are waited for by nobody who still reads."""


class Inbox(Generic[T]):
    """Items in the order in which they came, until their source is lost.

    It holds `MOST_WAITING` items at most. A source that sends more before anybody takes them counts as lost,
    and the loss says how many were not kept: nothing is dropped untold.

    Parameters
    ----------
    clock
        The clock in whose time `take` waits.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._changed = threading.Condition()
        self._items: list[T] = []
        self._loss: tuple[str, str, str] | None = None
        self._not_kept = 0

    def put(self, items: Iterable[T]) -> None:
        """Add items and wake whoever waits."""
        with self._changed:
            for item in items:
                if len(self._items) < MOST_WAITING and self._not_kept == 0:
                    self._items.append(item)
                else:
                    self._not_kept += 1
            self._changed.notify_all()

    def lose(self, what: str, *, where: str, do: str) -> None:
        """Say that nothing will come any more, in the words of a `TrialsError`."""
        with self._changed:
            self._loss = (what, where, do)
            self._changed.notify_all()

    def take(self, until_s: float) -> list[T]:
        """Wait until something is there or the clock shows `until_s`; return all there is, oldest first.

        Raises
        ------
        DeviceError
            The source was lost, or sent more than was kept, and everything from before was taken.
        """
        with self._changed:
            self._changed.wait_for(self._has_news, timeout=self._timeout_s(until_s))
            items, self._items = self._items, []
            loss, not_kept = self._loss, self._not_kept
        if not items and not_kept:
            raise DeviceError(
                f"more than {MOST_WAITING} inputs came at once; {not_kept} were not kept",
                where="input",
                do="see what sends them, then go on",
            )
        if not items and loss is not None:
            what, where, do = loss
            raise DeviceError(what, where=where, do=do)
        if not items:
            self._clock.sleep_until(until_s)
        return items

    def _has_news(self) -> bool:
        return bool(self._items) or self._loss is not None or self._not_kept > 0

    def _timeout_s(self, until_s: float) -> float:
        return min(max(until_s - self._clock.now_s(), 0.0), threading.TIMEOUT_MAX)
