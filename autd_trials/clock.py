"""Time, handed in: the same code runs in real time and in virtual time."""

import math
import time
from datetime import UTC, datetime, timedelta
from typing import Protocol

_SPIN_S = 0.0005  # a sleep may end this much late on a quiet machine; the rest is spun


class Clock(Protocol):
    """A monotonic clock that can be waited on."""

    @property
    def poll_s(self) -> float:
        """Longest single wait, in s, so that a signal or a lost device is noticed soon."""

    def now_s(self) -> float:
        """Return the monotonic time in s; its zero means nothing."""

    def utc_now(self) -> datetime:
        """Return the wall-clock time, aware, in UTC."""

    def sleep_until(self, time_s: float) -> None:
        """Return when `now_s` has reached `time_s`; at once if it already has."""


class RealClock:
    """The machine's monotonic clock."""

    poll_s = 0.01

    def now_s(self) -> float:
        """Return the machine's monotonic time in s."""
        return time.monotonic()

    def utc_now(self) -> datetime:
        """Return the machine's wall-clock time."""
        return datetime.now(UTC)

    def sleep_until(self, time_s: float) -> None:
        """Sleep for most of the wait and spin the last half millisecond."""
        remaining_s = time_s - time.monotonic()
        if remaining_s > _SPIN_S:
            time.sleep(remaining_s - _SPIN_S)
        while time.monotonic() < time_s:
            pass


class VirtualClock:
    """A clock that jumps: waiting costs nothing.

    Parameters
    ----------
    start_utc
        The wall-clock time at virtual time 0.
    """

    poll_s = math.inf

    def __init__(self, start_utc: datetime) -> None:
        self._start_utc = start_utc
        self._now_s = 0.0

    def now_s(self) -> float:
        """Return the virtual time in s."""
        return self._now_s

    def utc_now(self) -> datetime:
        """Return the start time plus the virtual time passed."""
        return self._start_utc + timedelta(seconds=self._now_s)

    def sleep_until(self, time_s: float) -> None:
        """Jump to `time_s` if it lies ahead."""
        self._now_s = max(self._now_s, time_s)
