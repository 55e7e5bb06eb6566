"""A session's stage in virtual time: runner and array driver are real, all around them is scripted."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np

from autd_trials.array.geometry import UnitPose
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError
from autd_trials.masking.emulated import EmulatedMasker
from autd_trials.protocol.plan import Plan, PlannedBlock, make_plan
from autd_trials.protocol.schema import Protocol
from autd_trials.responses.responder import Responder
from autd_trials.session.devices import Devices
from autd_trials.session.events import ConfirmedBy, DeviceDescriptions, Event
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Decision
from autd_trials.session.preflight import Used, preflight
from autd_trials.session.recorder import Listener, Recorder
from autd_trials.session.runner import Done, SessionRunner, confirm_beginning
from autd_trials.stimulus import Limits
from autd_trials.testing.responder import ScriptedResponder

Begin = Callable[[Recorder, DeviceDescriptions], object]
"""Records what comes before the first trial."""

LIMITS = Limits(
    largest_drive=1, longest_burst_s=2, largest_duty=1, session_exposure_s=1000, daily_exposure_s=1000
)
UNUSED = Used()


@dataclass
class MemoryLog:
    """Keeps events; fails from a given number on, as a full disk does.

    Attributes
    ----------
    events
        What was recorded.
    full_after
        How many events there is room for; None for any number.
    waits
        How often somebody waited for the disk.
    on_append
        Called with every event, once it is kept.
    """

    events: list[Event] = field(default_factory=list)
    full_after: int | None = None
    waits: int = 0
    on_append: Callable[[Event], object] = lambda _event: None

    def append_all(self, events: Iterable[Event]) -> None:
        """Keep events; raises DeviceError where there is no room."""
        self.waits += 1
        for event in events:
            if self.full_after is not None and len(self.events) >= self.full_after:
                raise DeviceError("no space left", where="disk", do="free some")
            self.events.append(event)
            self.on_append(event)


@dataclass
class ScriptedOperator:
    """Confirms everything; after a pause goes on as often as `go_on` says, then stops.

    Attributes
    ----------
    go_on
        How many more pauses the session goes on after.
    notes
        What is noted in every pause.
    confirmed_by
        Whom the log names.
    asked
        What was asked so far.
    """

    go_on: int = 0
    notes: tuple[str, ...] = ()
    confirmed_by: ConfirmedBy = "person"
    asked: list[str] = field(default_factory=list)

    def read_out(self, instructions: str) -> None:
        """Take note of the instructions."""
        self.asked.append(instructions)

    def confirm_block(self, block: PlannedBlock) -> None:
        """Take note of the block."""
        self.asked.append(f"block {block.block}")

    def confirm_known(self, summary: str) -> None:
        """Take note of the summary."""
        self.asked.append(summary)

    def confirm_resume(self, summary: str) -> None:
        """Take note of the summary."""
        self.asked.append(summary)

    def decide_after_pause(self, reason: str) -> Decision:
        """Go on, or stop if that was done often enough."""
        self.asked.append(reason)
        self.go_on -= 1
        return Decision(go_on=self.go_on >= 0, notes=self.notes)


@dataclass
class Stage:
    """Everything a session needs; bend any part of it before `run`.

    Attributes
    ----------
    protocol, plan
        What is to be done.
    clock
        Virtual time: waiting costs nothing.
    backend
        Virtual devices, with `faults` to set and `emissions` to look at afterwards.
    masker
        Plays nothing; `inject` harms it.
    responder
        A scripted one, or the device under test.
    operator, interrupts, listeners
        The experimenter, and whoever hears every event.
    log
        Where events are kept.
    limits, used, earlier_bursts
        What may be emitted, what was emitted before, and when it was, on the host's clock.
    """

    protocol: Protocol
    plan: Plan
    clock: VirtualClock
    backend: VirtualBackend
    masker: EmulatedMasker
    responder: Responder
    operator: ScriptedOperator = field(default_factory=ScriptedOperator)
    interrupts: Interrupts = field(default_factory=Interrupts)
    log: MemoryLog = field(default_factory=MemoryLog)
    listeners: list[Listener] = field(default_factory=list)
    limits: Limits = LIMITS
    used: Used = UNUSED
    earlier_bursts: tuple[tuple[float, float], ...] = ()

    @property
    def script(self) -> ScriptedResponder:
        """The scripted responder."""
        assert isinstance(self.responder, ScriptedResponder), "this stage has a responder of its own"
        return self.responder

    def run(
        self, done: Done | None = None, *, begin: Begin = lambda _recorder, _devices: None
    ) -> list[Event]:
        """Run the session to its end and return its events; raises what the runner raises.

        Parameters
        ----------
        done
            What the session has behind it, if it is one that is taken up again.
        begin
            Records what comes before the first trial: a session's start, say.
        """
        done = done or Done()
        array = PhasedArray(
            [UnitPose("unit 1", np.eye(3), np.zeros(3))],
            self.backend,
            self.limits,
            self.clock,
            speed_of_sound_m_s=343.0,
            exposure_used_s=self.used.session_s,
            daily_used_s=self.used.today_s,
            earlier_bursts=self.earlier_bursts,
        )
        devices = Devices(array, self.masker, self.responder)
        to_do = [trial for trial in self.plan.trials if trial.trial not in done.complete]
        preflight(self.protocol, self.plan, array, self.limits, self.used, to_do)
        descriptions = devices.open()
        self.interrupts.on_abort = array.halt
        try:
            confirm_beginning(self.operator, self.protocol, self.plan, done.complete)
            recorder = Recorder(self.log, self.clock, listeners=self.listeners)
            begin(recorder, descriptions)
            SessionRunner(
                self.protocol,
                self.plan,
                devices=devices,
                operator=self.operator,
                clock=self.clock,
                interrupts=self.interrupts,
                recorder=recorder,
                done=done,
            ).run()
        finally:
            devices.close()
        return self.log.events

    def of(self, kind: str) -> list[Event]:
        """Return the events of a kind, as the log names it ("trial-end", say)."""
        return [event for event in self.log.events if event.event == kind]


def make_stage(
    protocol: Protocol,
    *,
    place: int = 1,
    session: int = 1,
    start: datetime = datetime(2026, 11, 22, 9, 0, tzinfo=UTC),
    responder: Callable[[VirtualClock], Responder] = ScriptedResponder,
) -> Stage:
    """Return a stage for a session of a protocol.

    Parameters
    ----------
    protocol
        What is to be done; `autd_trials.testing.studies.make_protocol` makes a small one.
    place, session
        As in `make_plan`.
    start
        Wall-clock time at which virtual time begins; aware.
    responder
        Makes the responder from the stage's clock.
    """
    clock = VirtualClock(start)
    return Stage(
        protocol=protocol,
        plan=make_plan(protocol, place=place, session=session, seed=1),
        clock=clock,
        backend=VirtualBackend(clock),
        masker=EmulatedMasker(-30.0, clock),
        responder=responder(clock),
    )
