"""Studies as the runner records them: sessions run on a stage, their logs and the data set made from them."""

import json
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

from autd_trials.errors import StoppedByPerson
from autd_trials.protocol.plan import Plan
from autd_trials.protocol.schema import Level, Protocol
from autd_trials.records.bids import export_study
from autd_trials.records.layout import SessionPaths
from autd_trials.records.protocol_hash import protocol_sha256
from autd_trials.session.events import Event, SessionEnd, SessionStart, TrialEnd
from autd_trials.testing.script import write_log
from autd_trials.testing.stage import Stage, make_stage
from autd_trials.testing.studies import make_protocol, start_fields

Answer = Callable[[Mapping[str, Level | None], int], bool | None]
"""Whether a trial was felt, from its conditions and its repetition (from 0); None: the log has no answer."""


_FIRST_DAY = datetime(2026, 1, 1, 10, tzinfo=UTC)


@dataclass
class StudyWriter:
    """Writes sessions into one study folder, each as if it had been run.

    Parameters
    ----------
    path
        The study's folder.
    protocol
        The protocol of the sessions that are added next.
    """

    path: Path
    protocol: Protocol = field(default_factory=make_protocol)
    _exported: bool = True

    @property
    def folder(self) -> Path:
        """The study's folder, with the data set of all sessions that were added."""
        if not self._exported:
            export_study(self.path)
            self._exported = True
        return self.path

    def add(
        self,
        participant: str,
        answer: Answer,
        *,
        session: str = "01",
        simulated: bool = True,
        ends: bool = True,
        trials: int | None = None,
        interrupted: Collection[int] = (),
        start: datetime | None = None,
    ) -> Path:
        """Run a session, write its log and return the log's path.

        Parameters
        ----------
        participant, session
            Their ids; the participant's is a number, the place in the roster.
        answer
            Which trials are felt. Each is pressed to 0.4 s and its number in ms after the onset, and some
            microseconds by which no two sessions are alike.
        simulated
            Whether the log calls the participant simulated, and the time virtual.
        ends
            Whether the log has the session's end; without, it stops as after a crash.
        trials
            After how many trials the experimenter aborts; None for never.
        interrupted
            Trials whose first attempt fails, as the responder is lost in it.
        start
            Wall-clock time at which the session begins, aware; a day of its own in 2026 if None.
        """
        start = start or _FIRST_DAY + timedelta(days=int(participant) - 1, hours=int(session) - 1)
        stage = make_stage(self.protocol, place=int(participant), session=int(session), start=start)
        stage.operator.go_on = len(interrupted)
        stage.script.lost_in = {(trial, 1) for trial in interrupted}
        answers = _answers(stage.plan, answer)
        late_s = (int(participant) - 1) * 1e-5 + (int(session) - 1) * 5e-6  # no two sessions are alike
        stage.script.answer = lambda shown: (
            (0.4 + shown.trial / 1000 + late_s,) if answers[shown.trial] else ()
        )
        stage.script.kind = "simulated" if simulated else "scripted"
        stage.operator.confirmed_by = "unattended" if simulated else "person"
        if trials is not None:
            stage.listeners.append(lambda event: _abort_after(stage, event, trials))
        fields = start_fields(self.protocol, stage.plan, participant, session, simulated=simulated)
        sha256 = protocol_sha256(self.protocol.model_dump(mode="json"))
        with suppress(StoppedByPerson):
            stage.run(
                begin=lambda recorder, devices: recorder.record(
                    SessionStart, **fields, devices=devices, protocol_sha256=sha256
                )
            )
        unanswered = {trial for trial, felt in answers.items() if felt is None}
        events = [_without_answer(event, unanswered) for event in stage.log.events]
        paths = self.paths(participant, session)
        write_log(paths.log, [event for event in events if ends or not isinstance(event, SessionEnd)])
        self._exported = False
        return paths.log

    def paths(self, participant: str, session: str = "01") -> SessionPaths:
        """Return where a session's files lie."""
        return SessionPaths(self.path, participant, session, self.protocol.task)


def _answers(plan: Plan, answer: Answer) -> dict[int, bool | None]:
    """Return the answers by trial: the trials of each kind are answered by their repetition."""
    answers: dict[int, bool | None] = {}
    seen: dict[str, int] = {}
    for trial in plan.trials:
        kind = json.dumps([trial.trial_type, trial.conditions])
        answers[trial.trial] = answer(trial.conditions, seen.setdefault(kind, 0))
        seen[kind] += 1
    return answers


def _without_answer(event: Event, unanswered: Collection[int]) -> Event:
    if isinstance(event, TrialEnd) and event.trial in unanswered:
        return event.model_copy(update={"response": None, "response_time_s": None})
    return event


def _abort_after(stage: Stage, event: Event, trials: int) -> None:
    if isinstance(event, TrialEnd) and event.status == "complete" and event.trial == trials:
        stage.interrupts.request_abort()
