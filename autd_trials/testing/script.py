"""The events of a session written one by one, as a test wants them: torn, doubled, out of order."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Level, Protocol
from autd_trials.records.layout import SessionPaths
from autd_trials.records.log import EventLog
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
from autd_trials.testing.studies import DEVICES, make_protocol, start_fields

START = datetime(2026, 11, 22, 9, 0, tzinfo=UTC)


@dataclass
class SessionScript:
    """The events of a session that a test writes one by one, in any order, each 0.75 s after the one before.

    Times and answers are those that the caller gives or made up: a log that is true in itself is made by
    `autd_trials.testing.recorded.StudyWriter`. Methods return the script, so that calls can be chained.

    Parameters
    ----------
    participant, session, place, simulated, protocol, protocol_sha256
        What the session's start says. The plan is made from protocol, place and session.
    start
        Wall-clock time of the first event.
    events
        What was written so far; a test may change it.
    t_s
        Session time of the next event.
    """

    participant: str = "01"
    session: str = "01"
    place: int = 1
    simulated: bool = True
    protocol: Protocol = field(default_factory=make_protocol)
    protocol_sha256: str = "ab" * 32
    start: datetime = START
    events: list[Event] = field(default_factory=list)
    t_s: float = 0.0

    def __post_init__(self) -> None:
        self.plan = make_plan(
            self.protocol,
            place=self.place,
            session=int(self.session) if self.session.isdecimal() else 1,
            seed=7,
        )
        self._log(
            SessionStart,
            **start_fields(
                self.protocol, self.plan, self.participant, self.session, simulated=self.simulated
            ),
            devices=DEVICES,
            protocol_sha256=self.protocol_sha256,
        )

    def block(self, block: int) -> "SessionScript":
        """Begin a block."""
        conditions: dict[str, Level] = dict(self.plan.blocks[block - 1].conditions)
        return self._log(BlockStart, block=block, conditions=conditions, confirmed_by="unattended")

    def begin(self, number: int, attempt: int = 1) -> "SessionScript":
        """Begin a trial."""
        trial = self.plan.trials[number - 1]
        return self._log(
            TrialStart,
            trial=number,
            block=trial.block,
            attempt=attempt,
            trial_type=trial.trial_type,
            conditions=trial.conditions,
        )

    def stimulate(self, number: int, attempt: int = 1) -> "SessionScript":
        """Have the start command of a trial accepted."""
        spec = self.plan.trials[number - 1].stimulus
        return self._log(
            StimulusStart,
            trial=number,
            attempt=attempt,
            onset_t_s=self.t_s + 0.035,
            planned_onset_t_s=self.t_s + 0.0348,
            device_ns=123_456_789_000,
            margin_s=0.0231,
            duration_s=spec.duration_s,
            drive=spec.drive,
            exposure_s=spec.drive**2 * spec.duration_s,
            ear_level_db=98.5,
        )

    def press(self, number: int, attempt: int = 1, phase: Any = "window") -> "SessionScript":
        """Press 0.4 s after the onset, or in another phase."""
        return self._log(
            ResponseMade,
            trial=number,
            attempt=attempt,
            phase=phase,
            press_t_s=self.t_s,
            button="space",
            response_time_s=0.4,
            device_time_s=None,
        )

    def finish(self, number: int, attempt: int = 1, *, felt: bool = True) -> "SessionScript":
        """Complete a trial, with an answer."""
        return self._log(
            TrialEnd,
            trial=number,
            attempt=attempt,
            status="complete",
            response="felt" if felt else "not_felt",
            response_time_s=0.4 if felt else None,
            silent_before_s=0.002,
            emitting_after_s=0.003,
        )

    def interrupt(self, number: int, attempt: int = 1) -> "SessionScript":
        """End a trial before it is complete."""
        return self._log(
            TrialEnd, trial=number, attempt=attempt, status="interrupted", response=None, response_time_s=None
        )

    def trial(self, number: int, attempt: int = 1, *, felt: bool = True) -> "SessionScript":
        """Run a trial from its beginning to its end."""
        self.begin(number, attempt).stimulate(number, attempt)
        if felt:
            self.press(number, attempt)
        return self.finish(number, attempt, felt=felt)

    def trials(self, numbers: Iterable[int]) -> "SessionScript":
        """Run trials; those with even numbers are felt."""
        for number in numbers:
            self.trial(number, felt=number % 2 == 0)
        return self

    def all_trials(self) -> "SessionScript":
        """Run the whole session."""
        return self.block(1).trials(trial.trial for trial in self.plan.trials).end()

    def pause(self, reason: str = "asked by the experimenter") -> "SessionScript":
        """Pause."""
        return self._log(Pause, reason=reason)

    def resume(self, *, after_crash: bool = True) -> "SessionScript":
        """Go on, after a crash or a pause."""
        return self._log(Resume, after_crash=after_crash, confirmed_by="person")

    def note(self, text: str) -> "SessionScript":
        """Take a note."""
        return self._log(Note, text=text)

    def fault(self, device: str = "array", what: str = "lost") -> "SessionScript":
        """Have a device fail."""
        return self._log(Fault, device=device, what=what, happened_t_s=self.t_s)

    def end(self, status: Any = "success", why: str = "all trials complete") -> "SessionScript":
        """End the session."""
        return self._log(SessionEnd, status=status, why=why)

    def _log(self, kind: Callable[..., Any], **fields: Any) -> "SessionScript":
        utc = (self.start + timedelta(seconds=self.t_s)).isoformat(timespec="microseconds")
        self.events.append(kind(t_s=round(self.t_s, 6), utc=utc, **fields))
        self.t_s += 0.75
        return self

    def save(self, study: Path, *, durable: bool = False) -> Path:
        """Write the log to its place in a study's folder and return its path."""
        path = SessionPaths(study, self.participant, self.session, self.protocol.task).log
        write_log(path, self.events, durable=durable)
        return path


def write_log(path: Path, events: Sequence[Event], *, durable: bool = False) -> None:
    """Write events to a new log."""
    with EventLog.create(path, durable=durable) as log:
        log.append_all(events)
