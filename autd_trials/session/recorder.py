"""Stamps what happens, makes it durable, and only then tells the listeners."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol, TypeVar

from autd_trials.clock import Clock
from autd_trials.session.events import Event, Fault

Listener = Callable[[Event], None]
"""Hears every event after it is durable; may fail, never stops a run."""

E = TypeVar("E")


class Display(Protocol):
    """A listener that shows the session, and so must know what happened before it was taken up again."""

    def __call__(self, event: Event) -> None:
        """Take an event in."""

    def catch_up(self, events: Iterable[Event]) -> None:
        """Take in what happened before."""


class Log(Protocol):
    """Where events last."""

    def append(self, event: Event) -> None:
        """Return when the event is durable; raises DeviceError if it cannot be."""


class Recorder:
    """Writes events on the session's time axis.

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

    def session_time(self, host_s: float) -> float:
        """Return the host's monotonic time `host_s` on the session's axis, in s, to 1 us."""
        return round(host_s - self._start_s, 6)

    def record(self, kind: Callable[..., E], **fields: Any) -> E:
        """Record an event of a kind; returns it."""
        event = kind(
            t_s=self.session_time(self._clock.now_s()),
            utc=self._clock.utc_now().isoformat(timespec="microseconds"),
            **fields,
        )
        self._log.append(event)  # type: ignore[arg-type]  # every kind is one of Event's
        self._tell(event)  # type: ignore[arg-type]
        return event

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
