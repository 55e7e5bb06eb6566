"""A line for what matters, where there is no terminal to draw on and for sessions in virtual time."""

from collections.abc import Iterable
from typing import TextIO

from autd_trials.session.events import BlockStart, Event, Fault, Note, Pause, SessionEnd, SessionStart
from autd_trials.session.standing import Standing, standing
from autd_trials.tables import level_text


class Lines:
    """Writes lines; with `blocks`, one for every block too."""

    def __init__(self, output: TextIO, *, blocks: bool) -> None:
        self._output = output
        self._blocks = blocks
        self._standing: Standing | None = None
        self._before = 0

    def catch_up(self, events: Iterable[Event]) -> None:
        """Take in, without a word, what happened before a session was taken up again."""
        self._standing = standing(events)
        self._before = len(self._standing.complete)

    def __call__(self, event: Event) -> None:
        """Take an event in."""
        if isinstance(event, SessionStart):
            self._standing = Standing(event)
        elif self._standing is not None:
            self._standing.take(event)
        if self._standing is not None and (line := self._line(event, self._standing)):
            start = self._standing.start
            self._output.write(f"{start.participant} session {start.session}: {line}\n")
            self._output.flush()

    def _line(self, event: Event, now: Standing) -> str | None:
        match event:
            case BlockStart() if self._blocks:
                levels = ", ".join(f"{name} {level_text(level)}" for name, level in event.conditions.items())
                return f"block {event.block} ({levels})"
            case Fault():
                return f"fault: {event.what}"
            case Pause() if self._blocks:
                return f"pause: {event.reason}"
            case Note():
                return f"note: {event.text}"
            case SessionEnd():
                trials, complete = len(now.start.plan.trials), len(now.complete)
                done = f"{complete - self._before} of {trials - self._before} trials in this run"
                return f"{event.status}, {done} ({event.why})"
        return None
