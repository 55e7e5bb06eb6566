"""A session, from the instructions to its end: one piece of code in real and in virtual time."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field

from autd_trials.adaptive.answers import Answer
from autd_trials.array.driver import Exposure
from autd_trials.clock import Clock
from autd_trials.errors import DeviceError, StoppedByPerson, TrialsError
from autd_trials.protocol.plan import Plan, PlannedBlock, PlannedTrial
from autd_trials.protocol.schema import Protocol
from autd_trials.session.adaptive_runs import AdaptiveRuns
from autd_trials.session.devices import Devices, array_stimulus
from autd_trials.session.events import BlockStart, Fault, Note, Pause, Resume, SessionEnd
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Operator
from autd_trials.session.presses import PressBook
from autd_trials.session.recorder import Recorder
from autd_trials.session.silence import silence
from autd_trials.session.trial import Ended, TrialRunner
from autd_trials.session.watch import Watch

_RESUME_ADVICE = (
    "to go on with this session, add --resume with its --participant and --session to the same command"
)
_NOTED_S = 0.001  # a delay that is worth a note; less is rounding
_MASKER_LEAD_S = 2.0
"""The masker plays this long before a trial may start: sound devices begin with gaps of up to 0.9 s."""


@dataclass(frozen=True)
class Done:
    """What a session has behind it: the trials that are complete, and how often each was attempted.

    `answers` are, by trial, those to stimuli whose level an adaptive method chose.
    """

    complete: Set[int] = frozenset()
    attempts: Mapping[int, int] = field(default_factory=dict)
    answers: Mapping[int, Answer] = field(default_factory=dict)


def blocks_to_do(plan: Plan, complete: Set[int]) -> list[tuple[PlannedBlock, list[PlannedTrial]]]:
    """Return the blocks of a plan that have trials left, each with these, in order."""
    left: dict[int, list[PlannedTrial]] = {}
    for trial in plan.trials:
        if trial.trial not in complete:
            left.setdefault(trial.block, []).append(trial)
    return [(block, left[block.block]) for block in plan.blocks if block.block in left]


def confirm_beginning(operator: Operator, protocol: Protocol, plan: Plan, complete: Set[int]) -> None:
    """Have the instructions read out and the first block's conditions confirmed, before anything is recorded.

    Raises
    ------
    StoppedByPerson
        The session is not to begin.
    """
    operator.read_out(protocol.instructions)
    for block, _ in blocks_to_do(plan, complete)[:1]:
        operator.confirm_block(block)


class SessionRunner:
    """Runs the trials of a plan that are not yet complete.

    Parameters
    ----------
    protocol, plan
        What is to be done; it was judged (`preflight`), and its beginning confirmed (`confirm_beginning`).
    devices
        What it is done with; already open.
    operator
        Confirms, and decides after a pause.
    clock, interrupts
        Time, and requests to stop.
    recorder
        Where everything goes.
    done
        What is already done, for a session that is resumed.
    """

    def __init__(
        self,
        protocol: Protocol,
        plan: Plan,
        *,
        devices: Devices,
        operator: Operator,
        clock: Clock,
        interrupts: Interrupts,
        recorder: Recorder,
        done: Done | None = None,
    ) -> None:
        done = done or Done()
        self._protocol = protocol
        self._devices = devices
        self._operator = operator
        self._clock = clock
        self._interrupts = interrupts
        self._recorder = recorder
        self._attempts = dict(done.attempts)
        self._to_do = blocks_to_do(plan, done.complete)
        self._adaptive_runs = AdaptiveRuns(protocol.method, plan, done.answers)
        self._masker_started = False
        presses = PressBook(recorder)
        self._watch = Watch(devices, clock, interrupts, recorder, presses)
        self._trials = TrialRunner(protocol, devices, clock, recorder, presses, self._watch)

    def run(self) -> None:
        """Run the session to its end, and record how it ended.

        Whatever happens, the array is silenced first and `session-end` is logged then.

        Raises
        ------
        StoppedByPerson, DeviceError, UnsafeError
            The session ended before its last trial.
        """
        try:
            self._run_blocks()
        except BaseException as error:
            silence(self._devices.array, self._recorder, self._clock)
            why, by_person = self._why(error)
            self._recorder.record(SessionEnd, status="aborted" if by_person else "failed", why=why)
            if by_person:
                raise StoppedByPerson(why, do=_RESUME_ADVICE) from error
            raise
        silence(self._devices.array, self._recorder, self._clock)
        self._recorder.record(SessionEnd, status="success", why="all trials complete")

    def _why(self, error: BaseException) -> tuple[str, bool]:
        """Return why the session ended and whether a person ended it, which makes other things fail too."""
        if self._interrupts.abort_requested:
            return self._interrupts.why, True
        why = error.what if isinstance(error, TrialsError) else repr(error)
        return why, isinstance(error, StoppedByPerson | KeyboardInterrupt)

    def _run_blocks(self) -> None:
        for number, (block, trials) in enumerate(self._to_do):
            if number > 0:
                self._take_break()
                self._operator.confirm_block(block)
            self._run_block(block, trials)

    def _take_break(self) -> None:
        self._recorder.record(Pause, reason="break between blocks")
        self._watch.until(self._clock.now_s() + self._protocol.timing.break_s)
        self._recorder.record(Resume, after_crash=False, confirmed_by=self._operator.confirmed_by)

    def _run_block(self, block: PlannedBlock, trials: list[PlannedTrial]) -> None:
        self._recorder.record(
            BlockStart,
            block=block.block,
            conditions=block.conditions,
            confirmed_by=self._operator.confirmed_by,
        )
        ready_s: float | None = None
        for trial in trials:
            ready_s = self._complete(trial, ready_s)

    def _complete(self, planned: PlannedTrial, ready_s: float | None) -> float:
        """Attempt a trial until it is complete; return the end of its response window on the host's clock.

        `ready_s` is when the trial before ended; None asks for a lead-in first.
        """
        trial = self._adaptive_runs.at_its_level(planned)
        while True:
            try:
                onset_s = (self._lead_in() if ready_s is None else ready_s) + trial.pause_before_s
                onset_s = self._when_the_duty_allows(trial, onset_s)
                exposure = self._trials.arm(trial, onset_s)
                if not self._interrupts.pause_requested:
                    ended = self._run_armed(trial, onset_s, exposure)
                    self._adaptive_runs.take_in(trial, felt=ended.felt)
                    return ended.window_end_s
                self._pause("asked by the experimenter")
            except DeviceError as fault:
                self._interrupts.obey()
                self._pause_for(fault)
            ready_s = None

    def _when_the_duty_allows(self, trial: PlannedTrial, onset_s: float) -> float:
        """Return the onset, later if bursts before a pause or a resume leave too little of any 60 s."""
        earliest_s = self._devices.array.earliest_s(array_stimulus(self._protocol, trial), onset_s)
        if earliest_s > onset_s + _NOTED_S:
            text = (
                f"trial {trial.trial} waits {earliest_s - onset_s:.1f} s longer: the share of on-time in 60 s"
            )
            self._recorder.record(Note, text=text)
        return earliest_s

    def _run_armed(self, trial: PlannedTrial, onset_s: float, exposure: Exposure) -> Ended:
        attempt = self._attempts.get(trial.trial, 0) + 1
        self._attempts[trial.trial] = attempt
        return self._trials.run(trial, attempt, onset_s, exposure)

    def _lead_in(self) -> float:
        """Wait before the first trial after a start or a pause, with the masker playing; return the time."""
        lead_in_s = self._protocol.timing.lead_in_s
        if self._devices.masker is not None:
            if not self._masker_started:
                self._devices.masker.start()
                self._masker_started = True
            lead_in_s = max(lead_in_s, _MASKER_LEAD_S)
        end_s = self._clock.now_s() + lead_in_s
        self._watch.until(end_s, pausable=True)
        return end_s

    def _pause(self, reason: str) -> None:
        if not self._ask_to_go_on(reason):
            raise StoppedByPerson("stopped in a pause")
        self._recorder.record(Resume, after_crash=False, confirmed_by=self._operator.confirmed_by)

    def _pause_for(self, fault: DeviceError) -> None:
        """Pause until the devices are back; raises the fault if the experimenter gives up."""
        while True:
            self._recorder.record(
                Fault,
                device=fault.where or "unknown",
                what=fault.what,
                happened_t_s=self._recorder.session_time(self._clock.now_s()),
            )
            if not self._ask_to_go_on(str(fault)):
                raise fault
            self._devices.close()
            self._masker_started = False
            try:
                devices = self._devices.open()
            except DeviceError as still:
                fault = still
                continue
            self._recorder.record(
                Resume, after_crash=False, confirmed_by=self._operator.confirmed_by, devices=devices
            )
            return

    def _ask_to_go_on(self, reason: str) -> bool:
        silence(self._devices.array, self._recorder, self._clock)
        self._recorder.record(Pause, reason=reason)
        decision = self._operator.decide_after_pause(reason)
        self._interrupts.clear()
        for text in decision.notes:
            self._recorder.record(Note, text=text)
        return decision.go_on
