"""The recording part of `autd-trials calibrate --live`: takes what nodes send, and guides the hand."""

import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.output import say
from autd_trials.errors import DeviceError

if TYPE_CHECKING:
    from types import FrameType

    from rich.console import RenderableType

    from autd_trials.array.geometry import Vectors
    from autd_trials.calibration.guidance import Guidance
    from autd_trials.calibration.network.inlets import NodeState
    from autd_trials.calibration.network.live_track import LiveTrack
    from autd_trials.calibration.network.recording import Sample, UnitRecording
    from autd_trials.calibration.rigid import RigidMotion

_FIND_TIMEOUT_S = 10.0
_TAKE_EVERY_S = 0.1
_GUIDE_EVERY_S = 2.0
_SAY_EVERY_S = 5.0

Show = Callable[["Sequence[NodeState]", "Guidance"], None]


def record_live(
    folder: Path,
    names: Sequence[str],
    *,
    first_mount: "RigidMotion",
    centre_mm: "Vectors | None",
    half_mm: float,
    seconds: float | None,
) -> None:
    """Record all units' nodes into a folder until Ctrl-C, SIGTERM or the time is over.

    All that came is on disk at once, whatever happens then.

    Raises
    ------
    DeviceError
        A unit's node was not found, a second one of a unit appeared, or the disk is full.
    UsageError
        The folder holds a recording already, or cannot be made.
    """
    import numpy as np

    from autd_trials.calibration.guidance import guide
    from autd_trials.calibration.network.inlets import Nodes
    from autd_trials.calibration.network.live_track import LiveTrack
    from autd_trials.calibration.network.recording import UnitRecording

    say(f"looking for the sensor nodes of {', '.join(names)}")
    with ExitStack() as stack:
        nodes = stack.enter_context(Nodes(len(names), _FIND_TIMEOUT_S))
        going = stack.enter_context(_until_stopped(seconds))
        show = stack.enter_context(_display())
        now = datetime.now(UTC).replace(microsecond=0)
        recordings = [
            stack.enter_context(closing(UnitRecording(folder, unit, state.header.capture.at(now))))
            for unit, state in enumerate(nodes.states, start=1)
        ]
        _say_sources(names, nodes.states)
        collected = [LiveTrack(name) for name in names]
        say(f"recording into {folder}; wave the target everywhere; Ctrl-C ends and calibrates")
        guided_s = time.monotonic()
        while going():
            with _kept(folder):
                _take(nodes.take(), recordings, collected)
            if time.monotonic() - guided_s > _GUIDE_EVERY_S:
                tracks = [each.track() for each in collected]
                show(nodes.states, guide(tracks, first_mount, centre_mm, half_mm, np.random.default_rng(1)))
                guided_s = time.monotonic()
            time.sleep(_TAKE_EVERY_S)
        _take(nodes.take(), recordings, collected)
        for name, state in zip(names, nodes.states, strict=True):
            _say_faults(name, state)


def _say_sources(names: Sequence[str], states: "Sequence[NodeState]") -> None:
    for name, state in zip(names, states, strict=True):
        capture = state.header.capture
        if capture.origin != "measured":
            kind = capture.sensor or "of no known kind"
            say(
                f"warning: the sensor of {name} ({kind}) is {capture.origin.upper()}; a real array will "
                "refuse this calibration"
            )


@contextmanager
def _kept(folder: Path) -> Iterator[None]:
    """Say of whatever ends a recording that what came before it is kept."""
    try:
        yield
    except DeviceError:
        say(f"what was recorded so far is in {folder}; `autd-trials calibrate --recorded {folder}` uses it")
        raise


def _take(
    new: "list[tuple[list[Sample], list[tuple[float, float]]]]",
    recordings: "Sequence[UnitRecording]",
    collected: "Sequence[LiveTrack]",
) -> None:
    for (samples, clock), recording, each in zip(new, recordings, collected, strict=True):
        recording.add(samples)
        for time_s, offset_s in clock:
            recording.add_clock(time_s, offset_s)
        each.add(samples, clock)


def _say_faults(name: str, state: "NodeState") -> None:
    if state.silences:
        say(f"warning: {name} was silent for over 0.5 s {state.silences} times")
    if state.restarts:
        say(f"warning: the node of {name} restarted {state.restarts} times")
    if state.lost:
        say(f"warning: {state.lost} frames of {name} never came")


@contextmanager
def _until_stopped(seconds: float | None) -> Iterator[Callable[[], bool]]:
    """Yield what tells whether to go on: no signal came, and the time is not over."""
    stopped = False
    end_s = None if seconds is None else time.monotonic() + seconds

    def stop(_signal: int, _frame: "FrameType | None") -> None:
        nonlocal stopped
        stopped = True

    before = {each: signal.signal(each, stop) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: not stopped and (end_s is None or time.monotonic() < end_s)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def _display() -> Iterator[Show]:
    """Yield what shows the guidance: a panel that is drawn anew on a terminal, else a line now and then."""
    if not sys.stderr.isatty():
        said_s = -_SAY_EVERY_S

        def show_line(states: "Sequence[NodeState]", guidance: "Guidance") -> None:
            nonlocal said_s
            if time.monotonic() - said_s >= _SAY_EVERY_S:
                said_s = time.monotonic()
                say(_line(states, guidance))

        yield show_line
        return
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), auto_refresh=False) as live:
        yield lambda states, guidance: live.update(_panel(states, guidance), refresh=True)


def _line(states: "Sequence[NodeState]", guidance: "Guidance") -> str:
    residual = "none yet" if guidance.residual_mm is None else f"{guidance.residual_mm:.1f} mm"
    silent = [f"unit {s.header.unit} is SILENT" for s in states if s.silent_since_s is not None]
    return (
        f"sightings {' / '.join(map(str, guidance.points))}, agreeing {guidance.overlap:.0%}, residual "
        f"{residual}; {'; '.join([*silent, *guidance.missing]) or 'nothing is missing: Ctrl-C to end'}"
    )


def _panel(states: "Sequence[NodeState]", guidance: "Guidance") -> "RenderableType":
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    nodes = Table("unit", "frames", "sightings", "lost", "silent", "restarts", box=None)
    for state in states:
        silent = (
            Text("NOW", style="bold red") if state.silent_since_s is not None else Text(str(state.silences))
        )
        numbers = (state.header.unit, state.samples, state.sightings, state.lost)
        nodes.add_row(*map(str, numbers), silent, str(state.restarts))
    residual = (
        "no pose yet" if guidance.residual_mm is None else f"residual {guidance.residual_mm:.2f} mm rms"
    )
    parts: list[RenderableType] = [nodes, Text(f"agreeing {guidance.overlap:.0%}, {residual}")]
    parts.append(_coverage_table(guidance))
    todo = guidance.missing or ("nothing is missing: Ctrl-C ends and calibrates",)
    style = "yellow" if guidance.missing else "green"
    parts += [Text(f"- {text}", style=style) for text in todo]
    return Group(*parts)


def _coverage_table(guidance: "Guidance") -> "RenderableType":
    """Show the points of each cell: three layers from near to far, seen as unit 1 sees them."""
    from rich.table import Table
    from rich.text import Text

    table = Table("near", "middle", "far", title="points in the workspace", box=None, padding=(0, 3))
    x_cells, y_cells, z_cells = guidance.cells.shape
    for y in reversed(range(y_cells)):
        row = []
        for z in range(z_cells):
            text = Text()
            for x in range(x_cells):
                count = int(guidance.cells[x, y, z])
                text.append(f"{count:4d}", style="green" if count >= 5 else "red")
            row.append(text)
        table.add_row(*row)
    return table
