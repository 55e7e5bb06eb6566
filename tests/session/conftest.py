"""A session on the array driver in virtual time, with a scripted responder and a log in memory."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np
import pytest

from autd_trials.array.geometry import UnitPose
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError
from autd_trials.masking.emulated import EmulatedMasker
from autd_trials.protocol.plan import Plan, PlannedBlock, PlannedTrial
from autd_trials.protocol.schema import (
    Factor,
    Factors,
    Protocol,
    Response,
    Safety,
    StimulusSpec,
    Study,
    Target,
    Timing,
)
from autd_trials.responses.responder import Presentation, Press, ResponderInfo
from autd_trials.session.devices import Devices
from autd_trials.session.events import ConfirmedBy, Event
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Decision
from autd_trials.session.recorder import Listener, Recorder
from autd_trials.session.runner import Done, SessionRunner, confirm_beginning
from autd_trials.stimulus import Limits

WINDOW_S = 2.5
PAUSE_S = 1.5


@dataclass
class MemoryLog:
    """Keeps events; fails from a given event on, as a full disk does."""

    events: list[Event] = field(default_factory=list)
    full_after: int | None = None
    waits: int = 0
    on_append: Callable[[Event], None] = lambda _event: None

    def append_all(self, events: Iterable[Event]) -> None:
        self.waits += 1
        for event in events:
            if self.full_after is not None and len(self.events) >= self.full_after:
                raise DeviceError("no space left", where="disk", do="free some")
            self.events.append(event)
            self.on_append(event)


@dataclass
class ScriptedResponder:
    """Presses at given times after each onset, may be lost at a given host time."""

    clock: VirtualClock
    press_after_s: tuple[float, ...] = ()
    lost_at_s: float | None = None
    presented: list[Presentation] = field(default_factory=list)
    due: list[Press] = field(default_factory=list)

    def open(self) -> ResponderInfo:
        return ResponderInfo(kind="scripted", device="script", time_uncertainty_s=0.0)

    def present(self, presentation: Presentation) -> None:
        self.presented.append(presentation)
        self.due += [Press(presentation.onset_s + after_s, "a") for after_s in self.press_after_s]
        self.due.sort(key=lambda press: press.time_s)

    def read(self, until_s: float) -> list[Press]:
        if self.lost_at_s is not None and until_s >= self.lost_at_s:
            self.clock.sleep_until(self.lost_at_s)
            self.lost_at_s = None
            raise DeviceError("unplugged", where="responder", do="plug it in")
        self.clock.sleep_until(min([until_s, *(press.time_s for press in self.due[:1])]))
        presses = [press for press in self.due if press.time_s <= self.clock.now_s()]
        self.due = self.due[len(presses) :]
        return presses

    def close(self) -> None:
        self.due.clear()


@dataclass
class ScriptedOperator:
    """Answers from a script: goes on as often as told, then stops."""

    go_on: int = 0
    notes: tuple[str, ...] = ()
    confirmed_by: ConfirmedBy = "person"
    asked: list[str] = field(default_factory=list)

    def read_out(self, instructions: str) -> None:
        self.asked.append(instructions)

    def confirm_block(self, block: PlannedBlock) -> None:
        self.asked.append(f"block {block.block}")

    def confirm_resume(self, summary: str) -> None:
        self.asked.append(summary)

    def decide_after_pause(self, reason: str) -> Decision:
        self.asked.append(reason)
        self.go_on -= 1
        return Decision(go_on=self.go_on >= 0, notes=self.notes)


@dataclass
class Stage:
    """Everything a session needs, to be bent by a test before `run`."""

    protocol: Protocol
    plan: Plan
    clock: VirtualClock
    backend: VirtualBackend
    masker: EmulatedMasker
    responder: ScriptedResponder
    operator: ScriptedOperator
    interrupts: Interrupts
    log: MemoryLog
    listeners: list[Listener] = field(default_factory=list)

    def run(self, done: Done | None = None) -> list[Event]:
        units = [UnitPose("unit 1", np.eye(3), np.zeros(3))]
        limits = Limits(largest_drive=1, longest_burst_s=2, largest_duty=1, session_exposure_s=1000)
        array = PhasedArray(units, self.backend, limits, self.clock, speed_of_sound_m_s=343.0)
        devices = Devices(array, self.masker, self.responder)
        devices.open()
        self.interrupts.on_abort = array.halt
        try:
            confirm_beginning(self.operator, self.protocol, self.plan, (done or Done()).complete)
            SessionRunner(
                self.protocol,
                self.plan,
                devices=devices,
                operator=self.operator,
                clock=self.clock,
                interrupts=self.interrupts,
                recorder=Recorder(self.log, self.clock, listeners=self.listeners),
                done=done,
            ).run()
        finally:
            devices.close()
        return self.log.events

    def of(self, kind: str) -> list[Event]:
        return [event for event in self.log.events if event.event == kind]


@pytest.fixture
def stage() -> Stage:
    clock = VirtualClock(datetime(2026, 11, 22, 9, 0, tzinfo=UTC))
    return Stage(
        protocol=_protocol(),
        plan=_plan(),
        clock=clock,
        backend=VirtualBackend(clock),
        masker=EmulatedMasker(-30.0, clock),
        responder=ScriptedResponder(clock),
        operator=ScriptedOperator(),
        interrupts=Interrupts(),
        log=MemoryLog(),
    )


def _protocol() -> Protocol:
    return Protocol(
        name="small",
        description="Two blocks of three trials.",
        study=Study(
            title="Small",
            authors=("A. One", "B. Two"),
            institution_name="Institute",
            institution_address="Street",
            department="Department",
            ethics_approval="none needed: simulated",
        ),
        instructions="Raise a hand when you feel something.",
        targets={"chest": Target(x_mm=278.0, y_mm=217.0, z_mm=1000.0)},
        stimulus=StimulusSpec(duration_s=1.0, modulation_hz=100.0, target="chest"),
        factors=Factors(between_blocks={"clothing": Factor(levels=("inner", "inner_outer"))}),
        repetitions=2,
        catch_trials_per_block=1,
        timing=Timing(response_window_s=WINDOW_S, pause_min_s=PAUSE_S, pause_max_s=PAUSE_S, lead_in_s=3.0),
        response=Response(question="Felt?"),
        safety=Safety(longest_burst_s=1.0, largest_duty=1.0, session_exposure_s=100.0),
    )


def _plan() -> Plan:
    stimulus = StimulusSpec(duration_s=1.0, modulation_hz=100.0, target="chest")
    catch = stimulus.model_copy(update={"drive": 0.0})
    clothing = {1: "inner", 2: "inner_outer"}
    return Plan(
        protocol="small",
        place=1,
        session=1,
        seed=1,
        blocks=tuple(
            PlannedBlock(block=block, conditions={"clothing": level}, descriptions=())
            for block, level in clothing.items()
        ),
        trials=tuple(
            PlannedTrial(
                trial=trial,
                block=(trial + 2) // 3,
                trial_type="catch" if trial % 3 == 2 else "stimulus",
                conditions={"clothing": clothing[(trial + 2) // 3]},
                stimulus=catch if trial % 3 == 2 else stimulus,
                pause_before_s=PAUSE_S,
            )
            for trial in range(1, 7)
        ),
    )
