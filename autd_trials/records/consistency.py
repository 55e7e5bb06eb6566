"""Whether a log is consistent in itself, so that a session could have gone like this.

The chain shows that a log was changed; what is asked here also shows many changes after which the chain was
computed again. Every rule is one that the session's runner keeps: what it does not promise is not asked.
"""

from collections.abc import Iterable, Iterator
from datetime import datetime
from itertools import pairwise
from typing import Any

from pydantic import ValidationError

from autd_trials.errors import TrialsError
from autd_trials.protocol.plan import Plan, make_plan
from autd_trials.records.log import LogContents
from autd_trials.records.order_check import misplaced
from autd_trials.records.problem import Problem
from autd_trials.records.protocol_hash import protocol_sha256
from autd_trials.records.trial_check import untrue
from autd_trials.session.events import BlockStart, Event, Fault, ResponseMade, Resume, SessionStart

Numbered = tuple[int, Event]
"""A line's number and its event."""

_CLOCK_TOLERANCE_S = 0.5
_CLOCK_DRIFT = 1e-3
"""Between a line's two times on a busy machine; a clock that is being set right runs up to 0.05 % off."""

_VIRTUAL_TOLERANCE_S = 5e-6
"""Virtual time has one clock; only rounding is between a line's two times."""


def inconsistencies(log: LogContents, protocol: dict[str, Any] | None) -> list[Problem]:
    """Return what cannot be in a log, in the order of its lines.

    Parameters
    ----------
    log
        The log.
    protocol
        The protocol as the first line has it, for its hash; None if it cannot be told.
    """
    events = list(zip(log.lines, log.events, strict=True))
    found = [
        *_start(log.start, protocol),
        *_times(events, virtual=log.start.virtual_time),
        *_confirmations(events, log.start),
        *misplaced(events, log.start),
        *untrue(events, log.start),
    ]
    return [Problem(log.path, line, what) for line, what in sorted(dict.fromkeys(found))]


def _start(start: SessionStart, protocol: dict[str, Any] | None) -> Iterator[tuple[int, str]]:
    if start.format >= 2 and protocol is not None and protocol_sha256(protocol) != start.protocol_sha256:
        yield 1, "the protocol is not the one that its SHA-256 was taken of"
    try:
        planned: Plan | None = make_plan(
            start.protocol, place=start.plan.place, session=start.plan.session, seed=start.plan.seed
        )
    except (TrialsError, ValidationError, ValueError) as error:
        yield 1, f"the plan cannot be made again from protocol, place and seed: {_first_line(error)}"
    else:
        if planned != start.plan:
            yield 1, "the plan is not the one that protocol, place, session and seed give"
    if start.virtual_time and not start.simulated:
        yield 1, "a person cannot take part in virtual time"
    yield from _devices(start)


def _devices(start: SessionStart) -> Iterator[tuple[int, str]]:
    responder, driver, emulated = (
        device_fact(start, device, name)
        for device, name in (("responder", "kind"), ("array", "driver"), ("array", "emulated"))
    )
    if responder is not None and start.simulated != (responder == "simulated"):
        yield 1, f"simulated is {start.simulated}, but the answers came from {responder!r}"
    if driver is not None and start.virtual_time != (driver == "virtual"):
        yield 1, f"virtual_time is {start.virtual_time}, but the array's driver was {driver!r}"
    if start.simulated and emulated is False:
        yield 1, "a simulated participant cannot be stimulated by a real array"
    array = start.rig.get("array")
    link = array.get("link") if isinstance(array, dict) else None
    if emulated is not None and link is not None and (link == "emulator") != emulated:
        yield 1, f"the rig's array has the link {link}, but emulated is {emulated}"


def device_fact(start: SessionStart, device: str, name: str) -> Any:
    """Return what a log says of a device; None if it does not."""
    known: Any = start.devices
    for key in (device, name):
        known = known.get(key) if isinstance(known, dict) else getattr(known, key, None)
    return known


def _times(events: list[Numbered], *, virtual: bool) -> Iterator[tuple[int, str]]:
    for (_, before), (line, event) in pairwise(events):
        passed_s = event.t_s - before.t_s
        if passed_s < 0:
            yield line, f"t_s goes back by {-passed_s:.6g} s"
        if isinstance(event, Resume):
            continue  # the clock may have been set while nothing ran
        wall_s = (datetime.fromisoformat(event.utc) - datetime.fromisoformat(before.utc)).total_seconds()
        allowed_s = _VIRTUAL_TOLERANCE_S if virtual else _CLOCK_TOLERANCE_S + _CLOCK_DRIFT * abs(passed_s)
        if abs(wall_s - passed_s) > allowed_s:
            yield (
                line,
                f"since the line before, utc went on by {wall_s:.6g} s and t_s by {passed_s:.6g} s: "
                "an edit, or a step of the computer's clock",
            )
    for line, event in events:
        happened_s = _happened_s(event)
        if happened_s is not None and happened_s > event.t_s + 0.01:
            yield line, f"what it tells of happened {happened_s - event.t_s:.6g} s after it was logged"


def _happened_s(event: Event) -> float | None:
    if isinstance(event, Fault):
        return event.happened_t_s
    return event.press_t_s if isinstance(event, ResponseMade) else None


def _confirmations(events: Iterable[Numbered], start: SessionStart) -> Iterator[tuple[int, str]]:
    for line, event in events:
        if isinstance(event, BlockStart | Resume) and start.simulated and event.confirmed_by == "person":
            yield line, "a person confirmed, in a simulated session"


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
