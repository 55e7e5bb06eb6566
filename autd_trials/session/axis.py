"""Where a session that goes on is on its time axis, whatever was done to the computer's clocks meanwhile."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

from autd_trials.session.events import Event, HostTime, Resume, SessionStart

_NOTED_S = 1.0


@dataclass(frozen=True)
class TakenUp:
    """Session time in s at which a session goes on, and what is to be noted of it."""

    t_s: float
    remarks: tuple[str, ...]


def taken_up(events: Iterable[Event], host: HostTime | None, now: datetime) -> TakenUp:
    """Return where the axis goes on, always behind the last event.

    Parameters
    ----------
    events
        The session's events.
    host
        The clock that nobody sets, now; None in virtual time. If the computer was not started anew since the
        session was last begun or taken up, it alone says how long that is ago.
    now
        The wall-clock time, which says it otherwise; it may have been set meanwhile.
    """
    anchor: tuple[float, HostTime] | None = None
    last_t_s, last_utc = 0.0, now
    for event in events:
        if isinstance(event, SessionStart | Resume) and event.host is not None:
            anchor = event.t_s, event.host
        last_t_s, last_utc = event.t_s, datetime.fromisoformat(event.utc)
    by_wall_clock_s = (now - last_utc).total_seconds()
    if anchor is not None and host is not None and anchor[1].boot == host.boot is not None:
        gap_s = anchor[0] + host.since_boot_s - anchor[1].since_boot_s - last_t_s
        return TakenUp(last_t_s + max(gap_s, 0.0), _steps(by_wall_clock_s - gap_s))
    return TakenUp(last_t_s + max(by_wall_clock_s, 0.0), _guessed(by_wall_clock_s) if host else ())


def _steps(step_s: float) -> tuple[str, ...]:
    if abs(step_s) < _NOTED_S:
        return ()
    return (f"the computer's wall clock was stepped by {step_s:+.0f} s since the last event; t_s was not",)


def _guessed(gap_s: float) -> tuple[str, ...]:
    if gap_s < 0:
        return (f"the computer's wall clock is {-gap_s:.0f} s behind the last event: t_s goes on from there",)
    return (f"the computer was started anew: {gap_s:.0f} s since the last event, by its wall clock alone",)
