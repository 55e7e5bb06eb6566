"""Whether events are in an order in which a session can go."""

from collections.abc import Iterable, Iterator

from autd_trials.protocol.plan import PlannedTrial
from autd_trials.session.events import (
    BlockStart,
    Event,
    Fault,
    Note,
    Pause,
    ResponseMade,
    Resume,
    SessionEnd,
    SessionStart,
    StimulusStart,
    TrialEnd,
    TrialStart,
)

Found = Iterator[tuple[int, str]]


def misplaced(events: Iterable[tuple[int, Event]], start: SessionStart) -> Found:
    """Yield the line and what is wrong with it, for each event that cannot stand where it stands."""
    order = _Order(start)
    for line, event in events:
        for what in order.take(event):
            yield line, what


class _Order:
    """Follows a session through its events."""

    def __init__(self, start: SessionStart) -> None:
        self._start = start
        self._blocks = {block.block: block for block in start.plan.blocks}
        self._block: int | None = None
        self._open: tuple[int, int] | None = None
        self._stimulated: set[tuple[int, int]] = set()
        self._paused = False
        self._ended: SessionEnd | None = None
        self._attempts: dict[int, int] = {}
        self._complete: set[int] = set()

    def take(self, event: Event) -> Iterator[str]:
        """Go one event on; yield what is wrong with it."""
        if isinstance(event, BlockStart | TrialStart | StimulusStart | Pause) and self._ended:
            yield f"{event.event} after the session's end, without a resume"
        match event:
            case BlockStart():
                yield from self._take_block(event)
            case TrialStart():
                yield from self._take_trial(event)
            case StimulusStart():
                yield from self._take_stimulus(event)
            case ResponseMade():
                yield from self._take_response(event)
            case TrialEnd():
                yield from self._take_trial_end(event)
            case Pause():
                yield from self._refuse_open("pause")
                self._paused = True
            case Resume():
                yield from self._take_resume(event)
            case SessionEnd():
                yield from self._take_end(event)
            case Note() | Fault() | SessionStart():
                pass

    def _take_block(self, event: BlockStart) -> Iterator[str]:
        yield from self._refuse_open(f"block {event.block}")
        if self._paused:
            yield f"block {event.block} begins in a pause"
        planned, due = self._blocks.get(event.block), self._due()
        if planned is None:
            yield f"block {event.block} is not in the plan"
        elif event.conditions != planned.conditions:
            yield f"the conditions of block {event.block} are not those of the plan"
        if due is None or due.block != event.block:
            yield f"block {event.block} begins, but it is not its turn"
        elif self._block == event.block:
            yield f"block {event.block} begins a second time"
        self._block = event.block

    def _take_trial(self, event: TrialStart) -> Iterator[str]:
        yield from self._refuse_open(f"trial {event.trial}")
        if self._paused:
            yield f"trial {event.trial} begins in a pause"
        due = self._due()
        if due is None or due.trial != event.trial:
            yield f"trial {event.trial} begins, but it is {f'the turn of {due.trial}' if due else 'over'}"
        elif (event.block, event.trial_type) != (due.block, due.trial_type):
            yield f"block or type of trial {event.trial} is not that of the plan"
        if event.block != self._block:
            yield f"trial {event.trial} of block {event.block} begins in block {self._block}"
        before = self._attempts.get(event.trial, 0)
        if event.attempt != before + 1:
            yield f"attempt {event.attempt} at trial {event.trial} follows {before}"
        self._attempts[event.trial] = event.attempt
        self._open = (event.trial, event.attempt)

    def _take_stimulus(self, event: StimulusStart) -> Iterator[str]:
        if self._open != (event.trial, event.attempt):
            yield f"a stimulus of trial {event.trial}, attempt {event.attempt}, which is not running"
        elif self._open in self._stimulated:
            yield f"a second stimulus in trial {event.trial}, attempt {event.attempt}"
        self._stimulated.add((event.trial, event.attempt))

    def _take_response(self, event: ResponseMade) -> Iterator[str]:
        if self._ended:
            yield "a response after the session's end"
        if event.trial is None or event.attempt is None:
            return
        if (event.trial, event.attempt) not in self._stimulated:
            yield f"a response to trial {event.trial}, attempt {event.attempt}, which had no stimulus"

    def _take_trial_end(self, event: TrialEnd) -> Iterator[str]:
        ending = (event.trial, event.attempt)
        if self._open != ending:
            yield f"trial {event.trial}, attempt {event.attempt}, ends, but it is not running"
        elif event.status == "complete" and ending not in self._stimulated:
            yield f"trial {event.trial} is complete, but had no stimulus"
        if event.status == "complete":
            self._complete.add(event.trial)
            if self._ended:
                yield f"trial {event.trial} is completed after the session's end"
        self._open = None

    def _take_resume(self, event: Resume) -> Iterator[str]:
        yield from self._refuse_open("resume")
        if event.after_crash and self._ended:
            yield "a resume after a crash, but the session had ended"
        if not event.after_crash and not self._ended and not self._paused:
            yield "a resume, but the session was not paused"
        if event.after_crash or self._ended:
            self._block = None
        self._paused, self._ended = False, None

    def _take_end(self, event: SessionEnd) -> Iterator[str]:
        if self._ended:
            yield "a second end of the session"
        if event.status == "success" and (due := self._due()):
            yield f"the session ends as success, but trial {due.trial} is not complete"
        if event.status == "success" and self._paused:
            yield "the session ends as success in a pause"
        self._ended = event

    def _refuse_open(self, what: str) -> Iterator[str]:
        if self._open is not None:
            yield f"{what} before trial {self._open[0]} has ended"

    def _due(self) -> PlannedTrial | None:
        return next((t for t in self._start.plan.trials if t.trial not in self._complete), None)
