"""The experimenter's live screen: a listener that draws the session's status."""

import contextlib
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
from autd_trials.console.phase import Phase, phase_at
from autd_trials.session.events import Event, SessionStart
from autd_trials.session.preflight import shortest_s
from autd_trials.session.standing import Standing, standing
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
    footer
        What the experimenter can do.
    """

    def __init__(self, console: Console, clock: Clock, *, unblind: bool, footer: str) -> None:
        self._standing: Standing | None = None
        self._clock = clock
        self._start_s = clock.now_s()
        self._unblind = unblind
        self._footer = footer
        self._console = console
        self._live = self._new_live()

    def catch_up(self, events: Iterable[Event]) -> None:
        """Take in what happened before a session was taken up again."""
        self._standing = standing(events)

    def __call__(self, event: Event) -> None:
        """Take an event in."""
        self._start_s = self._clock.now_s() - event.t_s
        if isinstance(event, SessionStart):
            self._standing = Standing(event)
        elif self._standing is not None:
            self._standing.take(event)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Draw while the context lasts."""
        self._live.start()
        try:
            yield
        finally:
            with contextlib.suppress(OSError):  # the terminal was closed: nothing to be cleared away
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
        if self._standing is None:
            return Text("opening devices ...")
        t_s = self._clock.now_s() - self._start_s
        return render(self._standing, t_s, unblind=self._unblind, footer=self._footer)


def render(now: Standing, t_s: float, *, unblind: bool, footer: str) -> RenderableType:
    """Return the screen for where a session stands, at session time `t_s` in s."""
    return Group(
        _banner(now),
        _trial_panel(now, t_s, unblind=unblind),
        _health(now, t_s, unblind=unblind),
        Text(footer, style="dim"),
    )


def _banner(now: Standing) -> RenderableType:
    start, emulated = now.start, now.devices.array.emulated
    if emulated:
        banner = Text(" EMULATED: no ultrasound is emitted ", style="bold black on green")
    else:
        banner = Text(" LIVE: ultrasound is emitted ", style="bold white on red")
    line = Text.assemble(
        banner,
        f"  {start.protocol.name}  participant {start.participant}  session {start.session}",
        "  SIMULATED PARTICIPANT" if start.simulated else "",
    )
    return Panel(line, border_style="green" if emulated else "red")


def _trial_panel(now: Standing, t_s: float, *, unblind: bool) -> RenderableType:
    plan = now.start.plan
    phase = phase_at(now, t_s)
    left_s = shortest_s(now.remaining, now.start.protocol.timing)
    table = Table.grid(padding=(0, 2))
    table.add_row("phase", Text(f" {phase} ", style=_PHASE_STYLES.get(phase, "reverse")))
    table.add_row("block", _block(now))
    table.add_row("trials", f"{len(now.complete)} of {len(plan.trials)} complete")
    table.add_row("", ProgressBar(total=len(plan.trials), completed=len(now.complete), width=40))
    table.add_row("time left", str(timedelta(seconds=round(left_s))))
    table.add_row(
        "condition", _condition(now) if unblind else Text("hidden (--unblind shows it)", style="dim")
    )
    table.add_row("response", _response(now))
    if now.block is not None and now.block.ended:
        table.add_row("block's result", _block_result(now))
    if now.paused:
        table.add_row("paused", Text(now.paused, style="bold red"))
    return Panel(table, title="session")


def _block(now: Standing) -> str:
    blocks = now.start.plan.blocks
    if now.block is None:
        return f"0 of {len(blocks)}"
    known = next((b.conditions for b in blocks if b.block == now.block.block), {})
    return f"{now.block.block} of {len(blocks)}  {', '.join(map(level_text, known.values()))}"


def _condition(now: Standing) -> str:
    if now.trial is None:
        return ""
    told = {name: level for name, level in now.trial.conditions.items() if level is not None}
    levels = ", ".join(f"{name} {level_text(level)}" for name, level in told.items())
    return f"{now.trial.trial_type}: {levels}"


def _response(now: Standing) -> Text:
    if now.trial is None or not now.trial.felt or now.last_response_time_s is None:
        return Text("-", style="dim")
    return Text(f" felt, {now.last_response_time_s:.3f} s ", style="black on bright_green")


def _block_result(now: Standing) -> str:
    assert now.block is not None
    alarms = f", false alarms so far {now.false_alarms}" if now.false_alarms else ""
    return f"felt {now.block.felt} of {now.block.stimuli}{alarms}"


def _health(now: Standing, t_s: float, *, unblind: bool) -> RenderableType:
    array, masker, health = now.devices.array, now.devices.masker, now.health
    sound = f"{masker.kind} {masker.level_dbfs:g} dBFS" if masker else "none"
    margin = "-" if health.margin_s is None else f"{1e3 * health.margin_s:.0f} ms"
    table = Table.grid(padding=(0, 2))
    table.add_row("array", f"{array.driver} on {array.link}: {_devices(now, t_s)}")
    table.add_row("start margin", margin)
    table.add_row("masker", f"{sound}, {health.underruns} underruns")
    table.add_row("exposure", _exposure(now, unblind=unblind))
    if health.last_fault:
        table.add_row("last fault", Text(health.last_fault, style="yellow"))
    return Panel(table, title="health")


def _exposure(now: Standing, *, unblind: bool) -> str:
    """Return the exposure used; within a block that before it, as its steps would give each drive away."""
    open_to_see = unblind or now.block is None or now.block.ended or now.finished
    used_s = now.exposure_s if open_to_see or now.block is None else now.block.exposure_before_s
    when = "" if open_to_see else " before this block"
    return f"{used_s:.1f} of {now.limits.session_exposure_s:g} s at full drive{when}"


def _devices(now: Standing, t_s: float) -> str:
    devices, health = now.devices.array.devices, now.health
    if health.devices_ready is None or health.checked_t_s is None:
        return f"{devices} devices, opened"
    hot = ", HOT" if health.thermal else ""
    return f"{health.devices_ready} of {devices} ready{hot}, seen {t_s - health.checked_t_s:.0f} s ago"
