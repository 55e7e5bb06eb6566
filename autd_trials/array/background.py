"""An asyncio event loop in a thread of its own, for code that is not asynchronous."""

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import Coroutine
from concurrent.futures import Future
from threading import Thread
from typing import Any, TypeVar

T = TypeVar("T")

_STOP_S = 1.0
_TICK_S = 0.02
_STALLS_KEPT_S = 2.0


class BackgroundLoop:
    """An event loop that runs until it is stopped."""

    def __init__(self, name: str) -> None:
        self._loop = asyncio.new_event_loop()
        self._ticked_s = time.monotonic()
        self._stalls: deque[tuple[float, float]] = deque(maxlen=round(_STALLS_KEPT_S / _TICK_S))
        self._loop.call_soon(self._tick)
        self._thread = Thread(target=self._loop.run_forever, name=name, daemon=True)
        self._thread.start()

    def submit(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine in the background; the future gives its result."""
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)

    def stalled_s(self) -> float:
        """Return the longest time, in s, that the loop had to wait for the computer in the last 2 s."""
        now_s = time.monotonic()
        waits_s = [wait_s for ended_s, wait_s in list(self._stalls) if ended_s > now_s - _STALLS_KEPT_S]
        return max([*waits_s, now_s - self._ticked_s - _TICK_S, 0.0])

    def _tick(self) -> None:
        now_s = time.monotonic()
        self._stalls.append((now_s, now_s - self._ticked_s - _TICK_S))
        self._ticked_s = now_s
        self._loop.call_later(_TICK_S, self._tick)

    def stop(self) -> None:
        """Cancel what still runs and end the thread; never hangs."""
        with contextlib.suppress(TimeoutError):
            self.submit(_cancel_all()).result(_STOP_S)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(_STOP_S)
        if not self._thread.is_alive():
            self._loop.close()


async def _cancel_all() -> None:
    others = asyncio.all_tasks() - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)
