"""What a session is run with: a person at a terminal, or a simulated participant."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import datetime

from autd_trials.clock import Clock, RealClock, VirtualClock
from autd_trials.commands.output import say
from autd_trials.commands.study import Study
from autd_trials.errors import UsageError
from autd_trials.protocol.plan import Plan
from autd_trials.protocol.schema import Protocol
from autd_trials.rig.build import NO_AUDIO, Builder
from autd_trials.rig.schema import KeyboardSpec, SerialSpec
from autd_trials.session.devices import Devices
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Operator, Unattended
from autd_trials.session.preflight import Used
from autd_trials.session.recorder import Display
from autd_trials.stimulus import Limits

_SWITCH_INTERVAL_S = 0.0005


@dataclass(frozen=True)
class Bench:
    """A session's clock, devices (not yet open), operator and listeners.

    `limits` are those of both rig and protocol, `used` is what was emitted before; `remarks` go into the log.
    """

    clock: Clock
    devices: Devices
    operator: Operator
    interrupts: Interrupts
    listeners: Sequence[Display]
    limits: Limits
    used: Used
    simulated: bool
    virtual: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Choices:
    """What the command line says about how sessions are run."""

    simulated: bool
    real_time: bool
    unattended: bool
    unblind: bool
    audio: str | None

    @property
    def virtual(self) -> bool:
        """Whether time is virtual."""
        return self.simulated and not self.real_time


@contextmanager
def bench(
    study: Study,
    choices: Choices,
    protocol: Protocol,
    plan: Plan,
    *,
    start_utc: datetime,
    used: Used,
) -> Iterator[Bench]:
    """Set a bench up for the sessions of a plan, and clear it away.

    Parameters
    ----------
    study, choices
        Rig and calibration, and what the command line says.
    protocol, plan
        What is to be done; a resumed session's come from its log.
    start_utc
        Wall-clock time at which virtual time begins.
    used
        What was emitted before.
    """
    virtual = choices.virtual
    clock: Clock = VirtualClock(start_utc) if virtual else RealClock()
    builder = Builder(
        study.loaded_rig,
        protocol,
        clock,
        virtual=virtual,
        audio=choices.audio,
    )
    interrupts = Interrupts()
    with ExitStack() as stack:
        if not virtual:
            stack.enter_context(_quick_threads())
        stack.enter_context(interrupts.on_signals(in_a_thread=not virtual))
        operator, listeners, devices = (
            _simulated(stack, builder, plan, choices, used)
            if choices.simulated
            else _live(stack, builder, plan, choices, interrupts, used)
        )
        if not virtual:
            interrupts.on_abort = devices.array.halt
        yield Bench(
            clock,
            devices,
            operator,
            interrupts,
            listeners,
            builder.limits,
            used,
            simulated=choices.simulated,
            virtual=virtual,
            remarks=_remarks(protocol, choices),
        )


@contextmanager
def _quick_threads() -> Iterator[None]:
    """Let the threads that stamp presses come to their turn within 0.5 ms of Python's switching."""
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    try:
        yield
    finally:
        sys.setswitchinterval(before_s)


_Parts = tuple[Operator, Sequence[Display], Devices]


def _simulated(
    stack: ExitStack,
    builder: Builder,
    plan: Plan,
    choices: Choices,
    used: Used,
) -> _Parts:
    from autd_trials.participants.simulated import SimulatedParticipant

    participant = SimulatedParticipant(
        builder.clock,
        seed=plan.seed,
        place=plan.place,
        session=plan.session,
        predicted_force_mn=builder.predicted_force_mn(),
    )
    for remark in participant.remarks(plan):
        say(f"warning: {remark}")
    devices = builder.simulated(participant, used=used, seed=plan.seed)
    return Unattended(), [_watcher(stack, builder.clock, choices)], devices


def _watcher(stack: ExitStack, clock: Clock, choices: Choices) -> Display:
    """Return a screen where there is a terminal and somebody has time to look at it, else lines."""
    from autd_trials.console.lines import Lines

    if not choices.real_time or not sys.stderr.isatty():
        return Lines(sys.stderr, blocks=choices.real_time)
    from rich.console import Console

    from autd_trials.console.controls import controls_line
    from autd_trials.console.screen import Screen

    footer = controls_line(answers=None, keys=False, attended=False)
    screen = Screen(Console(stderr=True), clock, unblind=choices.unblind, footer=footer)
    stack.enter_context(screen.shown())
    return screen


def _live(
    stack: ExitStack,
    builder: Builder,
    plan: Plan,
    choices: Choices,
    interrupts: Interrupts,
    used: Used,
) -> _Parts:
    if choices.unattended and not builder.rig.emulated:
        raise UsageError(
            f"rig {builder.rig.name!r} has a real array: a person must confirm", do="leave --yes out"
        )
    from rich.console import Console

    from autd_trials.console.controls import Controls, controls_line
    from autd_trials.console.operator import TerminalOperator
    from autd_trials.console.screen import Screen
    from autd_trials.terminal import Terminal

    terminal = Terminal(builder.clock)
    stack.enter_context(terminal)
    controls = stack.enter_context(Controls(terminal, interrupts, builder.clock))
    console = Console(stderr=True)
    footer = controls_line(
        answers=_answers(builder.rig.responses), keys=True, attended=not choices.unattended
    )
    screen = Screen(console, builder.clock, unblind=choices.unblind, footer=footer)
    stack.enter_context(screen.shown())
    operator: Operator = (
        Unattended()
        if choices.unattended
        else TerminalOperator(terminal, screen, console, interrupts, controls, builder.clock)
    )
    return operator, [screen], builder.live(terminal, used=used, seed=plan.seed)


def _answers(responses: KeyboardSpec | SerialSpec) -> str:
    """Return how an answer is given, in the words of the screen's footer."""
    if isinstance(responses, SerialSpec):
        return f"answers: box on {responses.port}"
    return f"{' or '.join(responses.keys)}: hand raised"


def _remarks(protocol: Protocol, choices: Choices) -> tuple[str, ...]:
    if protocol.masking is not None and choices.audio == NO_AUDIO:
        return ("deviation: the protocol asks for masking noise; it was declined with --audio none",)
    return ()
