"""The recording part of `autd-trials calibrate --live`: takes what nodes send, and guides the hand."""

import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.output import say

if TYPE_CHECKING:
    from types import FrameType

    from rich.console import RenderableType

    from autd_trials.array.geometry import Vectors
    from autd_trials.calibration.guidance import Guidance
    from autd_trials.calibration.network.inlets import NodeState
    from autd_trials.calibration.network.recording import Sample, UnitRecording
    from autd_trials.calibration.rigid import RigidMotion
    from autd_trials.calibration.track import Track

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
        A unit's node was not found.
    UsageError
        The folder holds a recording already.
    """
    import numpy as np

    from autd_trials.calibration.guidance import guide
    from autd_trials.calibration.network.inlets import Nodes
    from autd_trials.calibration.network.recording import UnitRecording

    say(f"looking for the sensor nodes of {', '.join(names)}")
    with Nodes(len(names), _FIND_TIMEOUT_S) as nodes, _until_stopped(seconds) as going, _display() as show:
        recordings = [UnitRecording(folder, unit) for unit in range(1, len(names) + 1)]
        collected = [_Collected(name) for name in names]
        say(f"recording into {folder}; wave the target everywhere; Ctrl-C ends and calibrates")
        guided_s = time.monotonic()
        while going():
            _take(nodes.take(), recordings, collected)
            if time.monotonic() - guided_s > _GUIDE_EVERY_S:
                tracks = [each.track() for each in collected]
                show(nodes.states, guide(tracks, first_mount, centre_mm, half_mm, np.random.default_rng(1)))
                guided_s = time.monotonic()
            time.sleep(_TAKE_EVERY_S)
        _take(nodes.take(), recordings, collected)
        for recording in recordings:
            recording.close()
        for name, state in zip(names, nodes.states, strict=True):
            _say_faults(name, state)


class _Collected:
    """One unit's sightings so far, for the guidance; what counts is on disk."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._rows: list[tuple[float, float, float, float]] = []
        self._offset_s = 0.0

    def add(self, samples: "list[Sample]", clock: list[tuple[float, float]]) -> None:
        if clock:
            self._offset_s = clock[-1][1]
        for sample in samples:
            seen = sample.x_mm == sample.x_mm  # NaN without a sighting
            later = not self._rows or sample.t_raw_s + self._offset_s > self._rows[-1][0]
            if seen and later:
                time_s = sample.t_raw_s + self._offset_s
                self._rows.append((time_s, sample.x_mm, sample.y_mm, sample.z_mm))

    def track(self) -> "Track":
        import numpy as np

        from autd_trials.calibration.track import Track

        rows = np.array(self._rows).reshape(-1, 4)
        return Track(self._name, rows[:, 0], rows[:, 1:])


def _take(
    new: "list[tuple[list[Sample], list[tuple[float, float]]]]",
    recordings: "Sequence[UnitRecording]",
    collected: Sequence[_Collected],
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
