"""A line for what matters, where there is no terminal to draw on and for sessions in virtual time."""

from collections.abc import Iterable
from typing import TextIO

from autd_trials.console.status import Status, fold
from autd_trials.session.events import BlockStart, Event, Fault, Note, Pause, SessionEnd
from autd_trials.tables import level_text


class Lines:
    """Writes lines; with `blocks`, one for every block too."""

    def __init__(self, output: TextIO, *, blocks: bool) -> None:
        self._output = output
        self._blocks = blocks
        self._status = Status()
        self._before = 0

    def catch_up(self, events: Iterable[Event]) -> None:
        """Take in, without a word, what happened before a session was taken up again."""
        for event in events:
            self._status = fold(self._status, event)
        self._before = self._status.completed

    def __call__(self, event: Event) -> None:
        """Take an event in."""
        self._status = fold(self._status, event)
        if line := self._line(event):
            assert self._status.start is not None
            self._output.write(
                f"{self._status.start.participant} session {self._status.start.session}: {line}\n"
            )
            self._output.flush()

    def _line(self, event: Event) -> str | None:
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
                assert self._status.start is not None
                trials, completed = len(self._status.start.plan.trials), self._status.completed
                done = f"{completed - self._before} of {trials - self._before} trials in this run"
                return f"{event.status}, {done} ({event.why})"
        return None
