"""One session, begun or resumed: bench, log and runner wired together."""

from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from autd_trials.commands.bench import Bench, Choices, bench
from autd_trials.commands.provenance import git_commit, versions
from autd_trials.commands.study import Study
from autd_trials.errors import UsageError
from autd_trials.protocol.plan import Plan, make_plan
from autd_trials.protocol.schema import Protocol
from autd_trials.records.log import EventLog
from autd_trials.records.progress import Progress
from autd_trials.records.sessions import StudySession, new_session, study_lock, take_up
from autd_trials.session.events import Note, Resume, SessionStart, TrialEnd
from autd_trials.session.recorder import Recorder
from autd_trials.session.runner import SessionRunner, Standing

_KINDS = {
    (False, False): "with a person",
    (True, False): "by a simulated participant in real time",
    (True, True): "by a simulated participant in virtual time",
}
_OPTIONS = {
    (False, False): "leave --simulate out",
    (True, False): "give --simulate 1 and --real-time",
    (True, True): "give --simulate 1 without --real-time",
}


@dataclass(frozen=True)
class Started:
    """A session that was begun or resumed, for the summary at the end."""

    participant: str
    session: str
    log: Path


def begin(study: Study, choices: Choices, participant: str, session: str | None, seed: int) -> Started:
    """Run a new session from its first trial to its end.

    Raises
    ------
    TrialsError
        The session could not begin, or ended before its last trial; what was recorded stays.
    """
    with ExitStack() as stack:
        locked = stack.enter_context(ExitStack())
        locked.enter_context(study_lock(study.folder))
        new = new_session(study.folder, study.protocol.task, participant, session)
        plan = make_plan(study.protocol, place=new.place, session=new.number, seed=seed)
        now = datetime.now(UTC)
        here = stack.enter_context(
            bench(study, choices, study.protocol, plan, start_utc=now, exposure_used_s=0.0)
        )
        devices = here.devices.open()
        stack.callback(here.devices.close)
        log = stack.enter_context(EventLog.create(new.paths.log))
        recorder = Recorder(log, here.clock, listeners=here.listeners)
        _record_start(recorder, study, here, plan, new.paths.participant, new.paths.session, devices)
        locked.close()
        _run(here, recorder, study.protocol, plan, Standing())
        return Started(participant, new.paths.session, new.paths.log)


def resume(study: Study, choices: Choices, found: StudySession) -> Started:
    """Go on with a session after a person has confirmed; with the plan and the protocol of its log.

    Raises
    ------
    TrialsError
        As in `begin`.
    """
    start, progress = found.log.start, found.progress
    _refuse_other_kind(choices, start)
    offset_s, now = _session_time_now(found)
    with ExitStack() as stack:
        here = stack.enter_context(
            bench(
                study, choices, start.protocol, start.plan, start_utc=now, exposure_used_s=progress.exposure_s
            )
        )
        here.operator.confirm_resume(_summary(found))
        devices = here.devices.open()
        stack.callback(here.devices.close)
        log = stack.enter_context(take_up(found))
        for display in here.listeners:
            display.catch_up(found.log.events)
        recorder = Recorder(log, here.clock, offset_s=offset_s, listeners=here.listeners)
        _record_resume(recorder, study, here, found, devices)
        standing = Standing(progress.complete, progress.attempts, progress.answers)
        _run(here, recorder, start.protocol, start.plan, standing)
        return Started(found.paths.participant, found.paths.session, found.paths.log)


def _refuse_other_kind(choices: Choices, start: SessionStart) -> None:
    """Refuse to go on with a person's session by a program, or in another time: the record would lie."""
    begun, now = (start.simulated, start.virtual_time), (choices.simulated, choices.virtual)
    if begun != now:
        raise UsageError(
            f"the session was begun {_KINDS[begun]}, and would go on {_KINDS[now]}",
            do=_OPTIONS[begun],
        )


def _run(here: Bench, recorder: Recorder, protocol: Protocol, plan: Plan, standing: Standing) -> None:
    for remark in here.remarks:
        recorder.record(Note, text=remark)
    SessionRunner(
        protocol,
        plan,
        devices=here.devices,
        operator=here.operator,
        clock=here.clock,
        interrupts=here.interrupts,
        recorder=recorder,
        standing=standing,
    ).run()


def _record_start(
    recorder: Recorder,
    study: Study,
    here: Bench,
    plan: Plan,
    participant: str,
    session: str,
    devices: dict[str, Any],
) -> None:
    rig = study.loaded_rig
    recorder.record(
        SessionStart,
        participant=participant,
        session=session,
        simulated=here.simulated,
        virtual_time=here.virtual,
        protocol=study.protocol,
        protocol_sha256=study.protocol_sha256,
        plan=plan,
        rig=rig.rig.model_dump(mode="json"),
        calibration=rig.calibration.model_dump(mode="json"),
        calibration_sha256=rig.calibration_sha256,
        devices=devices,
        versions=versions(),
        git_commit=git_commit(),
    )


def _record_resume(
    recorder: Recorder, study: Study, here: Bench, found: StudySession, devices: dict[str, Any]
) -> None:
    start, progress = found.log.start, found.progress
    if progress.open_trial is not None:
        trial, attempt = progress.open_trial
        recorder.record(
            TrialEnd, trial=trial, attempt=attempt, status="interrupted", response=None, response_time_s=None
        )
    recorder.record(
        Resume,
        after_crash=not progress.finished,
        confirmed_by=here.operator.confirmed_by,
        devices=devices,
        versions=versions(),
    )
    if study.protocol != start.protocol:
        recorder.record(
            Note, text="the protocol file was changed since; the session goes on with the recorded one"
        )
    if study.loaded_rig.calibration_sha256 != start.calibration_sha256:
        text = f"deviation: resumed with another calibration, sha256 {study.loaded_rig.calibration_sha256}"
        recorder.record(Note, text=text)


def _session_time_now(found: StudySession) -> tuple[float, datetime]:
    """Return session time in s and wall-clock time now; after the last event, whatever the clocks say."""
    last_utc = datetime.fromisoformat(found.progress.last_utc)
    now = max(datetime.now(UTC), last_utc + timedelta(microseconds=1))
    return found.progress.last_t_s + (now - last_utc).total_seconds(), now


def _summary(found: StudySession) -> str:
    start, progress = found.log.start, found.progress
    return (
        f"participant {start.participant}, session {start.session} of {start.protocol.name}\n"
        f"{progress.status}: {progress.why}\n"
        f"{len(progress.complete)} of {len(start.plan.trials)} trials complete\n"
        f"last event at {progress.last_utc}"
        + ("\nThe log has damaged lines; they stay in it." if found.log.damaged else "")
        + _open_trial(progress)
    )


def _open_trial(progress: Progress) -> str:
    if progress.open_trial is None:
        return ""
    return f"\nTrial {progress.open_trial[0]} was interrupted and will be run again."
