"""Where the noise goes: the sink, its port and the volumes, as PulseAudio or PipeWire tells them.

It is read by `pactl`, which speaks to both. Where there is no such server, or the sound goes past it
(straight to a card, on macOS or Windows), nothing tells the route, and it stays unknown.
"""

import json
import os
import shutil
import subprocess
import threading
import time
from typing import Any

from autd_trials.masking.masker import Route

_READ_EVERY_S = 0.3
_READ_S = 2.0  # a busy computer takes its time to start a program
_UNREADABLE_S = 2.0
_APPEARS_S = 1.0  # from the start of a stream until the server lists it
_SILENT_DB = -120.0
_SAME_DB = 0.05


class RouteUnknownError(Exception):
    """Nothing tells where sound goes."""


def read_route(process: int) -> Route | None:
    """Return where the sound of a process goes now; None if the server plays none of it.

    Raises
    ------
    RouteUnknownError
        There is no `pactl`, or no server answers.
    """
    pactl = shutil.which("pactl")
    if pactl is None:
        raise RouteUnknownError("there is no pactl")
    try:
        done = subprocess.run(
            [pactl, "--format=json", "list"],
            env={**os.environ, "LC_ALL": "C"},
            capture_output=True,
            timeout=_READ_S,
            check=True,
        )
        return route_in(json.loads(done.stdout.decode(errors="replace")), process)
    except (OSError, subprocess.SubprocessError, ValueError, KeyError, TypeError) as error:
        raise RouteUnknownError(str(error)) from error


def route_in(listing: Any, process: int) -> Route | None:
    """Return a process's route in what `pactl --format=json list` prints; None if it has none.

    Raises
    ------
    KeyError, TypeError, ValueError
        It prints something else.
    """
    for stream in listing["sink_inputs"]:
        if stream["properties"].get("application.process.id") != str(process):
            continue
        for sink in listing["sinks"]:
            if sink["index"] == stream["sink"]:
                return Route(
                    sink=sink["name"],
                    description=sink["description"],
                    port=sink.get("active_port"),
                    volume_db=max(_SILENT_DB, _volume_db(sink) + _volume_db(stream)),
                    muted=bool(sink["mute"] or stream["mute"]),
                )
    return None


def change(before: Route, now: Route | None) -> str | None:
    """Say what has become of a route; None if it is as it was."""
    if now is None:
        return f"the sound no longer reaches {_place(before)}: it was unplugged or stopped"
    if (now.sink, now.port) != (before.sink, before.port):
        return f"the sound was moved from {_place(before)} to {_place(now)}"
    if now.muted != before.muted:
        return f"{_place(now)} was {'muted' if now.muted else 'unmuted'}"
    if abs(now.volume_db - before.volume_db) > _SAME_DB:
        volumes = f"from {before.volume_db:.1f} to {now.volume_db:.1f} dB"
        return f"the volume of {_place(now)} was changed {volumes}"
    return None


def silent(route: Route) -> bool:
    """Return whether nothing can be heard at the end of a route."""
    return route.muted or route.volume_db <= _SILENT_DB


class RouteWatch:
    """Keeps an eye on where this process's sound goes, from a thread of its own.

    Attributes
    ----------
    route
        Where it went when the watch began; None if nothing tells.
    problem
        What has changed since; None if nothing has.
    """

    def __init__(self) -> None:
        self.route = _first_route()
        self.problem: str | None = None
        if self.route is not None:
            threading.Thread(target=self._watch, args=(self.route,), daemon=True).start()

    def _watch(self, route: Route) -> None:
        read_s = time.monotonic()
        while self.problem is None:
            time.sleep(_READ_EVERY_S)
            try:
                self.problem = change(route, read_route(os.getpid()))
                read_s = time.monotonic()
            except RouteUnknownError as error:
                if time.monotonic() - read_s > _UNREADABLE_S:
                    self.problem = f"the sound server no longer tells where the sound goes: {error}"


def _first_route() -> Route | None:
    deadline_s = time.monotonic() + _APPEARS_S
    while True:
        try:
            route = read_route(os.getpid())
        except RouteUnknownError:
            return None
        if route is not None or time.monotonic() > deadline_s:
            return route
        time.sleep(0.05)


def _place(route: Route) -> str:
    return f"{route.description} ({route.sink}{f', {route.port}' if route.port else ''})"


def _volume_db(of: Any) -> float:
    """Return the volume of the loudest channel in dB, which `pactl` prints as ``-3.00 dB`` or ``-inf dB``."""
    return max(float(channel["db"].removesuffix(" dB")) for channel in of["volume"].values())
