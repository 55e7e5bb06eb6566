"""The experimenter's live screen: a listener that draws the session's status."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import timedelta

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from autd_trials.clock import Clock
from autd_trials.console.status import Phase, Status, fold
from autd_trials.session.events import Event
from autd_trials.tables import level_text

_PHASE_STYLES: dict[Phase, str] = {
    "stimulus": "black on yellow",
    "response window": "black on cyan",
    "paused": "white on red",
    "ended": "bold",
}


class Screen:
    """Draws the session.

    Parameters
    ----------
    console
        Where to draw.
    clock
        The machine's clock.
    unblind
        Show the condition of the running trial. Whoever scores a raised hand must be blind to it.
    """

    def __init__(self, console: Console, clock: Clock, *, unblind: bool) -> None:
        self._status = Status()
        self._clock = clock
        self._start_s = clock.now_s()
        self._unblind = unblind
        self._console = console
        self._live = self._new_live()

    def catch_up(self, events: Iterable[Event]) -> None:
        """Take in what happened before a session was taken up again."""
        for event in events:
            self._status = fold(self._status, event)

    def __call__(self, event: Event) -> None:
        """Take an event in."""
        self._start_s = self._clock.now_s() - event.t_s
        self._status = fold(self._status, event)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Draw while the context lasts."""
        self._live.start()
        try:
            yield
        finally:
            self._live.stop()

    @contextmanager
    def hidden(self) -> Iterator[None]:
        """Leave the terminal to a question while the context lasts."""
        self._live.stop()
        try:
            yield
        finally:
            self._live = self._new_live()
            self._live.start()

    def _new_live(self) -> Live:
        """Return a display that has drawn nothing: one used before would erase what was written since."""
        return Live(console=self._console, get_renderable=self._render, refresh_per_second=8, transient=True)

    def _render(self) -> RenderableType:
        return render(self._status, self._clock.now_s() - self._start_s, unblind=self._unblind)


def render(status: Status, t_s: float, *, unblind: bool) -> RenderableType:
    """Return the screen for a status at session time `t_s` in s."""
    if status.start is None:
        return Text("opening devices ...")
    return Group(
        _banner(status),
        _trial_panel(status, t_s, unblind=unblind),
        _health(status, t_s, unblind=unblind),
        _keys(),
    )


def _banner(status: Status) -> RenderableType:
    assert status.start is not None
    start = status.start
    if status.emulated:
        banner = Text(" EMULATED: no ultrasound is emitted ", style="bold black on green")
    else:
        banner = Text(" LIVE: ultrasound is emitted ", style="bold white on red")
    line = Text.assemble(
        banner,
        f"  {start.protocol.name}  participant {start.participant}  session {start.session}",
        "  SIMULATED PARTICIPANT" if start.simulated else "",
    )
    return Panel(line, border_style="green" if status.emulated else "red")


def _trial_panel(status: Status, t_s: float, *, unblind: bool) -> RenderableType:
    assert status.start is not None
    plan = status.start.plan
    phase = status.phase_at(t_s)
    table = Table.grid(padding=(0, 2))
    table.add_row("phase", Text(f" {phase} ", style=_PHASE_STYLES.get(phase, "reverse")))
    table.add_row("block", f"{status.block} of {len(plan.blocks)}  {_block_words(status)}")
    table.add_row("trials", f"{status.completed} of {len(plan.trials)} complete")
    table.add_row("", ProgressBar(total=len(plan.trials), completed=status.completed, width=40))
    table.add_row("time left", str(timedelta(seconds=round(status.time_left_s()))))
    table.add_row(
        "condition", _condition(status) if unblind else Text("hidden (--unblind shows it)", style="dim")
    )
    table.add_row("response", _response(status))
    if status.block_ended:
        table.add_row("block's result", _block_result(status))
    if status.paused:
        table.add_row("paused", Text(status.paused, style="bold red"))
    return Panel(table, title="session")


def _block_words(status: Status) -> str:
    assert status.start is not None
    if status.block == 0:
        return ""
    return ", ".join(map(level_text, status.start.plan.blocks[status.block - 1].conditions.values()))


def _condition(status: Status) -> str:
    told = {name: level for name, level in status.conditions.items() if level is not None}
    levels = ", ".join(f"{name} {level_text(level)}" for name, level in told.items())
    return f"{status.trial_type}: {levels}" if status.trial_type else ""


def _response(status: Status) -> Text:
    if not status.answered:
        return Text("-", style="dim")
    return Text(f" felt, {status.last_response_time_s:.3f} s ", style="black on bright_green")


def _block_result(status: Status) -> str:
    alarms = f", false alarms so far {status.false_alarms}" if status.false_alarms else ""
    return f"felt {status.felt_in_block} of {status.trials_in_block}{alarms}"


def _health(status: Status, t_s: float, *, unblind: bool) -> RenderableType:
    table = Table.grid(padding=(0, 2))
    table.add_row("array", f"{status.array}: {_devices(status, t_s)}")
    table.add_row("start margin", "-" if status.margin_s is None else f"{1e3 * status.margin_s:.0f} ms")
    table.add_row("masker", f"{status.masker}, {status.underruns} underruns")
    table.add_row("exposure", _exposure(status, unblind=unblind))
    if status.last_fault:
        table.add_row("last fault", Text(status.last_fault, style="yellow"))
    return Panel(table, title="health")


def _exposure(status: Status, *, unblind: bool) -> str:
    """Return the exposure used; within a block that before it, as its steps would give each drive away."""
    open_to_see = unblind or status.block_ended or status.ended is not None
    used_s = status.exposure_s if open_to_see else status.exposure_before_block_s
    when = "" if open_to_see else " before this block"
    return f"{used_s:.1f} of {status.exposure_budget_s:g} s at full drive{when}"


def _devices(status: Status, t_s: float) -> str:
    if status.devices_ready is None or status.checked_t_s is None:
        return f"{status.devices} devices, opened"
    hot = ", HOT" if status.thermal else ""
    return f"{status.devices_ready} of {status.devices} ready{hot}, seen {t_s - status.checked_t_s:.0f} s ago"


def _keys() -> RenderableType:
    return Text(
        "space: hand raised   p: pause   n: pause for a note   a: ABORT   Ctrl-C: pause, again: abort",
        style="dim",
    )
