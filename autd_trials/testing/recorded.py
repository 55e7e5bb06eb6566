"""Studies as the runner records them: sessions run on a stage, their logs and the data set made from them."""

import json
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from autd_trials.errors import StoppedByPerson
from autd_trials.protocol.schema import Level, Protocol
from autd_trials.records.bids import export_study
from autd_trials.records.layout import SessionPaths
from autd_trials.records.protocol_hash import protocol_sha256
from autd_trials.responses.responder import Presentation
from autd_trials.session.events import Event, SessionEnd, SessionStart, TrialEnd
from autd_trials.testing.script import write_log
from autd_trials.testing.stage import Stage, make_stage
from autd_trials.testing.studies import make_protocol, start_fields

Answer = Callable[[Mapping[str, Level | None], int], bool]
"""Whether a trial was felt, from its conditions and its repetition (from 0)."""


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
        start: datetime = datetime(2026, 1, 1, 10, tzinfo=UTC),
    ) -> Path:
        """Run a session, write its log and return the log's path.

        Parameters
        ----------
        participant, session
            Their ids; the participant's is a number, the place in the roster.
        answer
            Which trials are felt. Each is pressed to 0.4 s and its number in ms after the onset.
        simulated
            Whether the log calls the participant simulated, and the time virtual.
        ends
            Whether the log has the session's end; without, it stops as after a crash.
        trials
            After how many trials the experimenter aborts; None for never.
        interrupted
            Trials whose first attempt fails, as the responder is lost in it.
        start
            Wall-clock time at which the session begins; aware.
        """
        stage = make_stage(self.protocol, place=int(participant), session=int(session), start=start)
        stage.operator.go_on = len(interrupted)
        stage.script.lost_in = {(trial, 1) for trial in interrupted}
        stage.script.answer = _answers(stage, answer)
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
        events = [event for event in stage.log.events if ends or not isinstance(event, SessionEnd)]
        paths = self.paths(participant, session)
        write_log(paths.log, events)
        self._exported = False
        return paths.log

    def paths(self, participant: str, session: str = "01") -> SessionPaths:
        """Return where a session's files lie."""
        return SessionPaths(self.path, participant, session, self.protocol.task)


def _answers(stage: Stage, answer: Answer) -> Callable[[Presentation], tuple[float, ...]]:
    """Return when to press after an onset: the trials of each kind are answered by their repetition."""
    repetitions: dict[int, int] = {}
    seen: dict[str, int] = {}
    for trial in stage.plan.trials:
        kind = json.dumps([trial.trial_type, trial.conditions])
        repetitions[trial.trial] = seen.setdefault(kind, 0)
        seen[kind] += 1

    def press_after_s(presentation: Presentation) -> tuple[float, ...]:
        felt = answer(presentation.conditions, repetitions[presentation.trial])
        return (0.4 + presentation.trial / 1000,) if felt else ()

    return press_after_s


def _abort_after(stage: Stage, event: Event, trials: int) -> None:
    if isinstance(event, TrialEnd) and event.status == "complete" and event.trial == trials:
        stage.interrupts.request_abort()
