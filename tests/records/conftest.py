"""A small protocol, its plan and sessions of it, written by hand."""

import resource
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from autd_trials.array.driver import ArrayInfo
from autd_trials.masking.masker import MaskerInfo
from autd_trials.protocol.plan import Plan, PlannedBlock, PlannedTrial
from autd_trials.protocol.schema import (
    Factor,
    Factors,
    Level,
    Masking,
    Protocol,
    Response,
    Safety,
    StimulusSpec,
    Study,
    Target,
    Timing,
)
from autd_trials.records.layout import SessionPaths
from autd_trials.records.log import EventLog
from autd_trials.responses.responder import ResponderInfo
from autd_trials.session.events import (
    BlockStart,
    DeviceDescriptions,
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

START = datetime(2026, 11, 22, 9, 0, tzinfo=UTC)
FREQUENCIES_HZ = (25.0, 50.0, 100.0)
DEVICES = DeviceDescriptions(
    array=ArrayInfo(
        driver="virtual",
        link="none",
        emulated=True,
        devices=18,
        transducers=18 * 249,
        firmware=("v12.0.0",),
    ),
    masker=MaskerInfo(
        kind="pink", device="null sink", level_dbfs=-30.0, level_dba=None, sample_rate_hz=48000
    ),
    responder=ResponderInfo(kind="simulated", device="simulated", time_uncertainty_s=0.0),
)
CLOTHING = ("inner", "inner+outer")


def make_protocol(name: str = "chest-catch", **changes: Any) -> Protocol:
    protocol = Protocol(
        name=name,
        description="Detection of a focus on the clothed chest.",
        study=Study(
            title="Midair stimuli on the chest",
            authors=("A. One", "B. Two"),
            institution_name="An Institute",
            institution_address="1 Street, Town",
            department="Haptics",
            ethics_approval="none needed: nobody took part",
        ),
        instructions="Press when you feel something.",
        targets={"sternum": Target(x_mm=0.0, y_mm=0.0, z_mm=1000.0)},
        stimulus=StimulusSpec(duration_s=1.0, modulation_hz=50.0, target="sternum"),
        factors=Factors(
            within_block={"modulation_hz": Factor(levels=FREQUENCIES_HZ)},
            between_blocks={"clothing": Factor(levels=CLOTHING, describe={"inner": "Undershirt."})},
        ),
        repetitions=2,
        catch_trials_per_block=1,
        timing=Timing(response_window_s=2.0, pause_min_s=2.0, pause_max_s=4.0),
        masking=Masking(level_dbfs=-30.0),
        response=Response(question="Did you feel something?"),
        safety=Safety(longest_burst_s=1.0, largest_duty=0.5, session_exposure_s=100.0),
    )
    return protocol.model_copy(update=changes)


def make_plan(protocol: Protocol, place: int = 1, session: int = 1) -> Plan:
    numbers = count(1)
    trials = [
        trial
        for block, clothing in enumerate(CLOTHING, start=1)
        for trial in _block_trials(protocol, block, clothing, numbers)
    ]
    blocks = tuple(
        PlannedBlock(block=block, conditions={"clothing": clothing}, descriptions=())
        for block, clothing in enumerate(CLOTHING, start=1)
    )
    return Plan(
        protocol=protocol.name, place=place, session=session, seed=7, blocks=blocks, trials=tuple(trials)
    )


def _block_trials(
    protocol: Protocol, block: int, clothing: str, numbers: Iterable[int]
) -> list[PlannedTrial]:
    frequencies: list[float | None] = [
        *FREQUENCIES_HZ * protocol.repetitions,
        *[None] * protocol.catch_trials_per_block,
    ]
    return [
        PlannedTrial(
            trial=number,
            block=block,
            trial_type="stimulus" if frequency_hz else "catch",
            conditions={"modulation_hz": frequency_hz, "clothing": clothing},
            stimulus=protocol.stimulus.model_copy(
                update={"modulation_hz": frequency_hz} if frequency_hz else {"drive": 0.0}
            ),
            pause_before_s=3.0,
        )
        for frequency_hz, number in zip(frequencies, numbers, strict=False)
    ]


@dataclass
class SessionScript:
    """Makes the events of a session, as the runner would, on a time axis of its own."""

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
        self.plan = make_plan(self.protocol, self.place, int(self.session) if self.session.isdecimal() else 1)
        self._log(
            SessionStart,
            participant=self.participant,
            session=self.session,
            simulated=self.simulated,
            virtual_time=self.simulated,
            protocol=self.protocol,
            protocol_sha256=self.protocol_sha256,
            plan=self.plan,
            rig={"name": "emulated"},
            calibration={"method": "by hand", "made_up": True, "time": "2026-11-22T08:00:00Z"},
            calibration_sha256="cd" * 32,
            devices=DEVICES,
            versions={"autd-trials": "0.1.0", "python": "3.11.7"},
            git_commit=None,
        )

    def block(self, block: int) -> "SessionScript":
        conditions: dict[str, Level] = dict(self.plan.blocks[block - 1].conditions)
        return self._log(BlockStart, block=block, conditions=conditions, confirmed_by="unattended")

    def begin(self, number: int, attempt: int = 1) -> "SessionScript":
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
        return self._log(
            TrialEnd, trial=number, attempt=attempt, status="interrupted", response=None, response_time_s=None
        )

    def trial(self, number: int, attempt: int = 1, *, felt: bool = True) -> "SessionScript":
        self.begin(number, attempt).stimulate(number, attempt)
        if felt:
            self.press(number, attempt)
        return self.finish(number, attempt, felt=felt)

    def trials(self, numbers: Iterable[int]) -> "SessionScript":
        for number in numbers:
            self.trial(number, felt=number % 2 == 0)
        return self

    def all_trials(self) -> "SessionScript":
        return self.block(1).trials(trial.trial for trial in self.plan.trials).end()

    def pause(self, reason: str = "asked by the experimenter") -> "SessionScript":
        return self._log(Pause, reason=reason)

    def resume(self, *, after_crash: bool = True) -> "SessionScript":
        return self._log(Resume, after_crash=after_crash, confirmed_by="person")

    def note(self, text: str) -> "SessionScript":
        return self._log(Note, text=text)

    def fault(self, device: str = "array", what: str = "lost") -> "SessionScript":
        return self._log(Fault, device=device, what=what, happened_t_s=self.t_s)

    def end(self, status: Any = "success", why: str = "all trials complete") -> "SessionScript":
        return self._log(SessionEnd, status=status, why=why)

    def _log(self, kind: Callable[..., Any], **fields: Any) -> "SessionScript":
        utc = (self.start + timedelta(seconds=self.t_s)).isoformat(timespec="microseconds")
        self.events.append(kind(t_s=round(self.t_s, 6), utc=utc, **fields))
        self.t_s += 0.75
        return self

    def save(self, study: Path, *, durable: bool = False) -> Path:
        path = SessionPaths(study, self.participant, self.session, self.protocol.task).log
        write_log(path, self.events, durable=durable)
        return path


def write_log(path: Path, events: Sequence[Event], *, durable: bool = False) -> None:
    with EventLog.create(path, durable=durable) as log:
        for event in events:
            log.append(event)


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Let the kernel refuse to let files grow beyond a size in bytes, as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    return tmp_path / "chest-catch"
