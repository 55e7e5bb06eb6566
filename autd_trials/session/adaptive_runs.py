"""The levels that an adaptive method chooses in a session, from the answers before."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

from autd_trials.adaptive.answers import Answer
from autd_trials.adaptive.rule import rule_of
from autd_trials.array.driver import Stimulus
from autd_trials.protocol.method import Method
from autd_trials.protocol.plan import Plan, PlannedTrial
from autd_trials.protocol.schema import Level, Protocol
from autd_trials.session.devices import array_stimulus

_Run = tuple[int, tuple[tuple[str, Level | None], ...]]


class AdaptiveRuns:
    """The adaptive runs of a session: one for each condition of each block, interleaved as planned.

    Parameters
    ----------
    method
        The protocol's method; None for constant stimuli, which stay as they were planned.
    plan
        The session's plan.
    answers
        The answers so far by trial, for a session that is resumed.
    """

    def __init__(self, method: Method | None, plan: Plan, answers: Mapping[int, Answer]) -> None:
        self._method = method
        self._rule = None if method is None else rule_of(method)
        self._answers: defaultdict[_Run, list[Answer]] = defaultdict(list)
        for trial in plan.trials:
            if method is not None and trial.trial in answers:
                self._answers[run_of(trial, method)].append(answers[trial.trial])

    def at_its_level(self, trial: PlannedTrial) -> PlannedTrial:
        """Return a planned trial that is to come now with the level chosen for it; a catch trial has none."""
        if self._method is None or self._rule is None or trial.trial_type == "catch":
            return trial
        return _at(trial, self._method, self._rule.next_level(self._answers[run_of(trial, self._method)]))

    def take_in(self, trial: PlannedTrial, *, felt: bool) -> None:
        """Take in the answer to a trial at its level."""
        if self._method is not None and trial.trial_type == "stimulus":
            level = getattr(trial.stimulus, self._method.varies)
            self._answers[run_of(trial, self._method)].append(Answer(level, felt))


def possible_stimuli(protocol: Protocol, trials: Sequence[PlannedTrial]) -> Iterator[Stimulus]:
    """Yield what an adaptive method could choose besides the largest level, of one planned trial.

    Levels differ in nothing that depends on the other conditions, so that one trial is enough.
    """
    stimuli = (trial for trial in trials if trial.trial_type == "stimulus")
    if protocol.method is not None and (trial := next(stimuli, None)) is not None:
        for level in protocol.method.levels:
            yield array_stimulus(protocol, _at(trial, protocol.method, level))


def _at(trial: PlannedTrial, method: Method, level: float) -> PlannedTrial:
    return trial.model_copy(
        update={
            "conditions": {**trial.conditions, method.varies: level},
            "stimulus": trial.stimulus.model_copy(update={method.varies: level}),
        }
    )


def run_of(trial: PlannedTrial, method: Method) -> _Run:
    """Return the adaptive run that a trial belongs to: its block and its other conditions."""
    return trial.block, tuple(
        (name, level) for name, level in trial.conditions.items() if name != method.varies
    )
