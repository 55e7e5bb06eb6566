"""Stamps what happens, makes it durable, and only then tells the listeners."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any, Protocol, TypeVar

from autd_trials.clock import Clock
from autd_trials.session.events import Event, Fault, Note

Listener = Callable[[Event], None]
"""Hears every event after it is durable; may fail, never stops a run."""

E = TypeVar("E")

_STEP_S = 0.2
_STEP_SHARE = 0.001  # a wall clock that is being corrected runs up to half a millisecond a second off


class Display(Protocol):
    """A listener that shows the session, and so must know what happened before it was taken up again."""

    def __call__(self, event: Event) -> None:
        """Take an event in."""

    def catch_up(self, events: Iterable[Event]) -> None:
        """Take in what happened before."""


class Log(Protocol):
    """Where events last."""

    def append_all(self, events: Iterable[Event]) -> None:
        """Return when the events are durable, all with one wait; raises DeviceError if they cannot be."""


class Recorder:
    """Writes events on the session's time axis.

    A step of the wall clock, which `utc` is read from, is noted; `t_s` does not depend on it.

    Parameters
    ----------
    log
        Where events last.
    clock
        The session's clock.
    offset_s
        Session time now: 0 for a new session, later for a resumed one.
    listeners
        Told of each event; one that raises is dropped, and that is recorded.
    """

    def __init__(
        self, log: Log, clock: Clock, *, offset_s: float = 0.0, listeners: Sequence[Listener] = ()
    ) -> None:
        self._log = log
        self._clock = clock
        self._start_s = clock.now_s() - offset_s
        self._listeners = list(listeners)
        self._last: tuple[float, datetime] | None = None

    def session_time(self, host_s: float) -> float:
        """Return the host's monotonic time `host_s` on the session's axis, in s, to 1 us."""
        return round(host_s - self._start_s, 6)

    def record(self, kind: Callable[..., E], **fields: Any) -> E:
        """Record an event of a kind; returns it."""
        return self.record_all(kind, [fields])[0]

    def record_all(self, kind: Callable[..., E], all_fields: Iterable[Mapping[str, Any]]) -> list[E]:
        """Record several events of a kind with one wait for the disk; returns them."""
        stamp, step_s = self._stamp()
        events: list[Any] = [kind(**stamp, **fields) for fields in all_fields]
        if step_s is not None:
            events.insert(
                0,
                Note(**stamp, text=f"the computer's wall clock was stepped by {step_s:+.3f} s; t_s was not"),
            )
        if events:
            self._log.append_all(events)
        for event in events:
            self._tell(event)
        return events if step_s is None else events[1:]

    def _stamp(self) -> tuple[dict[str, Any], float | None]:
        """Return the time now, and by how much the wall clock was stepped since the last event."""
        now_s, utc = self._clock.now_s(), self._clock.utc_now()
        step_s = None
        if self._last is not None:
            since_s = now_s - self._last[0]
            step_s = (utc - self._last[1]).total_seconds() - since_s
        self._last = now_s, utc
        noticed = step_s is not None and abs(step_s) > max(_STEP_S, _STEP_SHARE * since_s)
        stamp = {"t_s": self.session_time(now_s), "utc": utc.isoformat(timespec="microseconds")}
        return stamp, step_s if noticed else None

    def _tell(self, event: Event) -> None:
        for listener in tuple(self._listeners):
            try:
                listener(event)
            except Exception as error:
                self._listeners.remove(listener)
                self.record(
                    Fault,
                    device="listener",
                    what=f"{listener!r} was dropped: {error!r}",
                    happened_t_s=event.t_s,
                )
