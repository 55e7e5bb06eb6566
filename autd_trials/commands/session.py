"""One session, begun or resumed: bench, log and runner wired together."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from autd_trials.commands.bench import Bench, Choices, bench
from autd_trials.commands.output import say
from autd_trials.commands.provenance import git_commit, versions
from autd_trials.commands.study import Study
from autd_trials.errors import UsageError
from autd_trials.host import since_boot
from autd_trials.protocol.plan import Plan, make_plan
from autd_trials.protocol.schema import Protocol
from autd_trials.records.history import participant_lock, used_before
from autd_trials.records.layout import SessionPaths
from autd_trials.records.log import EventLog
from autd_trials.records.roster import known_participant
from autd_trials.records.sessions import NewSession, StudySession, new_session, study_lock, take_up
from autd_trials.session.axis import taken_up
from autd_trials.session.changes import device_changes, refuse_less_safe, rig_changes
from autd_trials.session.events import (
    DeviceDescriptions,
    HostTime,
    Note,
    Resume,
    SessionStart,
    TrialEnd,
)
from autd_trials.session.preflight import preflight
from autd_trials.session.recorder import Recorder
from autd_trials.session.runner import Done, SessionRunner, confirm_beginning
from autd_trials.session.standing import Standing

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


def begin(
    study: Study,
    choices: Choices,
    participant: str,
    session: str | None,
    seed: int,
    place: int | None = None,
) -> Started:
    """Run a new session from its first trial to its end.

    Nothing is recorded before everything was judged, all devices are there and the first block is confirmed.

    Raises
    ------
    TrialsError
        The session could not begin, or ended before its last trial; what was recorded stays.
    """

    def planned(session: str | None) -> NewSession:
        return new_session(
            study.folder, study.protocol.task, participant, session, place=place, simulated=choices.simulated
        )

    new = planned(session)
    with participant_lock(study.folder, new.paths.participant):
        while not _begin(study, choices, new, seed, planned):
            new = planned(session)
            say(f"another session was begun meanwhile; this one is planned anew, for place {new.place}")
    return Started(participant, new.paths.session, new.paths.log)


def resume(study: Study, choices: Choices, found: StudySession) -> Started:
    """Go on with a session after a person has confirmed; with the plan and the protocol of its log.

    Raises
    ------
    TrialsError
        As in `begin`; or the session would go on otherwise than it was begun.
    """
    with participant_lock(study.folder, found.paths.participant):
        _resume(study, choices, found)
    return Started(found.paths.participant, found.paths.session, found.paths.log)


def _begin(
    study: Study,
    choices: Choices,
    new: NewSession,
    seed: int,
    planned: Callable[[str | None], NewSession],
) -> bool:
    """Run a new session; return False, with nothing recorded, if its place was taken meanwhile."""
    plan = make_plan(study.protocol, place=new.place, session=new.number, seed=seed)
    now = datetime.now(UTC)
    used = used_before(study.folder, new.paths.participant, now)
    with ExitStack() as stack:
        here = stack.enter_context(bench(study, choices, study.protocol, plan, start_utc=now, used=used))
        judged = preflight(study.protocol, plan, here.devices.array, here.limits, used, plan.trials)
        for remark in judged.remarks:
            say(f"warning: {remark}")
        devices = here.devices.open()
        stack.callback(here.devices.close)
        here.interrupts.obey()
        if not choices.simulated and (known := known_participant(study.folder, new.paths.participant)):
            here.operator.confirm_known(known)
        confirm_beginning(here.operator, study.protocol, plan, frozenset())
        with study_lock(study.folder):
            if planned(new.paths.session) != new:
                return False
            log = stack.enter_context(EventLog.create(new.paths.log))
            recorder = Recorder(log, here.clock, listeners=here.listeners)
            _record_start(recorder, study, here, plan, new.paths, devices)
        _run(here, recorder, study.protocol, plan, here.remarks, Done())
    return True


def _resume(study: Study, choices: Choices, found: StudySession) -> None:
    start, standing = found.log.start, found.standing
    _refuse_other_kind(choices, start)
    used = used_before(study.folder, start.participant, datetime.now(UTC), start.session)
    start_utc = max(datetime.now(UTC), datetime.fromisoformat(standing.last_utc) + timedelta(microseconds=1))
    with ExitStack() as stack:
        here = stack.enter_context(
            bench(study, choices, start.protocol, start.plan, start_utc=start_utc, used=used)
        )
        rig = study.loaded_rig.rig.model_dump(mode="json")
        refuse_less_safe(standing, rig, here.limits)
        preflight(start.protocol, start.plan, here.devices.array, here.limits, used, standing.remaining)
        devices = here.devices.open()
        stack.callback(here.devices.close)
        here.interrupts.obey()
        deviations = _deviations(study, standing, devices)
        here.operator.confirm_resume(_summary(found, deviations))
        confirm_beginning(here.operator, start.protocol, start.plan, standing.complete)
        log = stack.enter_context(take_up(found))
        for display in here.listeners:
            display.catch_up(found.log.events)
        axis = taken_up(found.log.events, _host_time(here), here.clock.utc_now())
        recorder = Recorder(log, here.clock, offset_s=axis.t_s, listeners=here.listeners)
        _record_resume(recorder, study, here, standing, devices)
        remarks = (*axis.remarks, *(f"deviation: {text}" for text in deviations), *here.remarks)
        done = Done(standing.complete, standing.attempts, standing.answers)
        _run(here, recorder, start.protocol, start.plan, remarks, done)


def _refuse_other_kind(choices: Choices, start: SessionStart) -> None:
    """Refuse to go on with a person's session by a program, or in another time: the record would lie."""
    begun, now = (start.simulated, start.virtual_time), (choices.simulated, choices.virtual)
    if begun != now:
        raise UsageError(
            f"the session was begun {_KINDS[begun]}, and would go on {_KINDS[now]}",
            do=_OPTIONS[begun],
        )


def _run(
    here: Bench, recorder: Recorder, protocol: Protocol, plan: Plan, remarks: tuple[str, ...], done: Done
) -> None:
    for remark in remarks:
        recorder.record(Note, text=remark)
    SessionRunner(
        protocol,
        plan,
        devices=here.devices,
        operator=here.operator,
        clock=here.clock,
        interrupts=here.interrupts,
        recorder=recorder,
        done=done,
    ).run()


def _record_start(
    recorder: Recorder,
    study: Study,
    here: Bench,
    plan: Plan,
    paths: SessionPaths,
    devices: DeviceDescriptions,
) -> None:
    rig = study.loaded_rig
    recorder.record(
        SessionStart,
        participant=paths.participant,
        session=paths.session,
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
        limits=here.limits,
        exposure_today_s=here.used.today_s,
        host=_host_time(here),
    )


def _record_resume(
    recorder: Recorder, study: Study, here: Bench, standing: Standing, devices: DeviceDescriptions
) -> None:
    rig = study.loaded_rig
    if standing.open_trial is not None:
        trial, attempt = standing.open_trial
        recorder.record(
            TrialEnd, trial=trial, attempt=attempt, status="interrupted", response=None, response_time_s=None
        )
    recorder.record(
        Resume,
        after_crash=not standing.finished,
        confirmed_by=here.operator.confirmed_by,
        devices=devices,
        versions=versions(),
        rig=rig.rig.model_dump(mode="json"),
        calibration=rig.calibration.model_dump(mode="json"),
        calibration_sha256=rig.calibration_sha256,
        limits=here.limits,
        exposure_today_s=here.used.today_s,
        host=_host_time(here),
    )


def _deviations(study: Study, standing: Standing, devices: DeviceDescriptions) -> tuple[str, ...]:
    """Return what is not as it was when the session was begun or last taken up."""
    rig = study.loaded_rig
    changes = rig_changes(standing, rig.rig.model_dump(mode="json"), rig.calibration_sha256)
    protocol = (
        ("the protocol file was changed; the session goes on with the recorded one",)
        if study.protocol != standing.start.protocol
        else ()
    )
    return (*protocol, *changes, *device_changes(standing.devices, devices))


def _host_time(here: Bench) -> HostTime | None:
    """Return the clock that nobody sets; virtual time has none."""
    if here.virtual:
        return None
    boot, since_boot_s = since_boot()
    return HostTime(boot=boot, since_boot_s=since_boot_s)


def _summary(found: StudySession, deviations: tuple[str, ...]) -> str:
    start, standing = found.log.start, found.standing
    lines = [
        f"participant {start.participant}, session {start.session} of {start.protocol.name}",
        f"{standing.status}: {standing.why}",
        f"{len(standing.complete)} of {len(start.plan.trials)} trials complete",
        f"last event at {standing.last_utc}",
    ]
    if found.log.damaged:
        lines.append("The log has damaged lines; they stay in it.")
    if standing.open_trial is not None:
        lines.append(f"Trial {standing.open_trial[0]} was interrupted and will be run again.")
    if deviations:
        lines.append("NOT AS BEFORE:")
        lines += deviations
    return "\n".join(lines)
