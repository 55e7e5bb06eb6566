"""Where a session stands, from its log: what is done, what was cut short, what is left to do."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from autd_trials.adaptive.answers import Answer
from autd_trials.protocol.plan import PlannedTrial
from autd_trials.records.log import LogContents
from autd_trials.session.events import Event, Resume, SessionEnd, StimulusStart, TrialEnd, TrialStart

Status = Literal["success", "aborted", "failed", "interrupted"]
"""How a session ended; interrupted: its log just stops (a crash), or it is still running."""


@dataclass(frozen=True)
class Progress:
    """Where a session stands.

    Parameters
    ----------
    status, why
        How the session ended, and why.
    complete
        Numbers of the trials that are complete.
    attempts
        Highest attempt so far of each trial that was started.
    answers
        By trial, the answers to stimuli whose level an adaptive method chose.
    open_trial
        Trial and attempt that were started and never ended: the crash came in it.
    remaining
        The planned trials that are not complete, in the plan's order.
    exposure_s
        Exposure used so far, in s at full drive.
    last_t_s, last_utc
        When the last event was logged: session time in s, and wall-clock time.
    """

    status: Status
    why: str
    complete: frozenset[int]
    attempts: Mapping[int, int]
    answers: Mapping[int, Answer]
    open_trial: tuple[int, int] | None
    remaining: tuple[PlannedTrial, ...]
    exposure_s: float
    last_t_s: float
    last_utc: str

    @property
    def attempts_interrupted(self) -> int:
        """How many attempts at a trial do not count."""
        return sum(self.attempts.values()) - len(self.complete)

    @property
    def finished(self) -> bool:
        """Whether the session came to an end, good or bad."""
        return self.status != "interrupted"


def progress_of(log: LogContents) -> Progress:
    """Return where a session stands."""
    complete = frozenset(e.trial for e in log.events if isinstance(e, TrialEnd) and e.status == "complete")
    status, why = _ending(log.events)
    return Progress(
        status=status,
        why=why,
        complete=complete,
        attempts=_attempts(log.events),
        answers=_answers(log),
        open_trial=_open_trial(log.events),
        remaining=tuple(trial for trial in log.start.plan.trials if trial.trial not in complete),
        exposure_s=sum(e.exposure_s for e in log.events if isinstance(e, StimulusStart)),
        last_t_s=log.events[-1].t_s,
        last_utc=log.events[-1].utc,
    )


def _ending(events: tuple[Event, ...]) -> tuple[Status, str]:
    for event in reversed(events):
        if isinstance(event, SessionEnd):
            return event.status, event.why
        if isinstance(event, Resume | TrialStart):
            break  # a session that ended and was then taken up again
    return "interrupted", "the log stops without a session's end"


def _attempts(events: tuple[Event, ...]) -> dict[int, int]:
    attempts: dict[int, int] = {}
    for event in events:
        if isinstance(event, TrialStart | StimulusStart | TrialEnd):
            attempts[event.trial] = max(event.attempt, attempts.get(event.trial, 0))
    return attempts


def _answers(log: LogContents) -> dict[int, Answer]:
    method = log.start.protocol.method
    if method is None:
        return {}
    levels = {
        (event.trial, event.attempt): event.conditions.get(method.varies)
        for event in log.events
        if isinstance(event, TrialStart)
    }
    ends = (e for e in log.events if isinstance(e, TrialEnd) and e.status == "complete")
    found = ((end, levels.get((end.trial, end.attempt))) for end in ends)
    return {
        end.trial: Answer(level, end.response == "felt") for end, level in found if isinstance(level, float)
    }


def _open_trial(events: tuple[Event, ...]) -> tuple[int, int] | None:
    for event in reversed(events):
        if isinstance(event, TrialEnd):
            return None
        if isinstance(event, TrialStart):
            return event.trial, event.attempt
    return None
