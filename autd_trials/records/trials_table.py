"""The table of trials of a session (``_events.tsv``): one row for every attempt at a trial."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from autd_trials.errors import UsageError
from autd_trials.protocol.plan import PlannedTrial
from autd_trials.protocol.schema import Factor, Protocol, StimulusSpec
from autd_trials.records.log import LogContents
from autd_trials.records.table import SIMULATED, Column, Value, cell, to_us
from autd_trials.session.events import Event, ResponseMade, StimulusStart, TrialEnd, TrialStart

_LEADING = (
    Column(
        "onset",
        "Onset of the stimulus (of the silent interval in a catch trial), timed by the array and counted "
        "from the session's start. A trial interrupted before its stimulus was started has the time at "
        "which it began.",
        units="s",
    ),
    Column(
        "duration",
        "Commanded length of the burst; 0 where nothing was emitted. Where a trial was interrupted within "
        "its burst, the time until it was surely cut off.",
        units="s",
    ),
    Column(
        "trial_type",
        "Whether there was something to feel.",
        levels={
            "stimulus": "A focus was presented.",
            "catch": "Everything as ever, but nothing was emitted.",
        },
    ),
    Column("trial", "Number of the trial in the session's plan, from 1; interrupted trials are run again."),
    Column("block", "Number of the block in the session's plan, from 1."),
    Column("attempt", "Which attempt at this trial the row is about, from 1."),
    Column(
        "trial_status",
        "Whether the attempt counts.",
        levels={
            "complete": "Ran to the end of its response window.",
            "interrupted": "Cut short by a fault, a crash or a person; does not count.",
        },
    ),
)

_TRAILING = (
    Column(
        "drive",
        "Commanded peak pressure amplitude as a fraction of the array's largest; in catch trials 0, or n/a "
        "if the drive is a factor.",
        units="1",
    ),
    Column(
        "response",
        "The answer; n/a for an interrupted attempt.",
        levels={
            "felt": "A press within the response window.",
            "not_felt": "No press within the response window.",
        },
    ),
    Column("response_time", "From the onset to the first press within the response window.", units="s"),
    Column("button", "The button, key or line of the press that made the answer; n/a if there was none."),
    Column("onset_lateness", "Actual onset minus planned onset.", units="s"),
    Column(
        "start_margin",
        "What was left between the moment at which the array had accepted the start command and the onset.",
        units="s",
    ),
    Column("silent_before", "How long before the onset the array was last read back as silent.", units="s"),
    Column(
        "emitting_after", "How long after the onset the array was first read back as emitting.", units="s"
    ),
    Column("presses_before_onset", "Presses from the beginning of the trial to its onset."),
    Column("presses_in_window", "Presses within the response window, repeated ones included."),
    Column("presses_late", "Presses after the response window."),
    Column(
        "exposure_s",
        "Commanded exposure: drive squared times duration, as counted against the session's budget.",
        units="s",
    ),
    Column(
        "ear_level",
        "Predicted largest sound pressure level at the ears (free field, linear theory, less the hearing "
        "protection); n/a where nothing was emitted or the head's place was not given.",
        units="dB",
    ),
    Column("underruns", "Gaps in the masking noise during the trial."),
    SIMULATED,
)

_UNITS = {"_hz": "Hz", "_s": "s", "_mm": "mm", "_db": "dB", "_pa": "Pa"}


def trial_columns(protocols: Iterable[Protocol]) -> list[Column]:
    """Return the columns of a study; the factors are those of all its protocols."""
    factors: dict[str, Column] = {}
    for protocol in protocols:
        for name, factor, where in _factors(protocol):
            column = _factor_column(name, factor, where)
            known = factors.get(column.name)
            levels = {**(known.levels if known else {}), **column.levels}
            factors[column.name] = Column(column.name, column.description, column.units, levels)
    return [*_LEADING, *(column for name, column in factors.items() if name != "drive"), *_TRAILING]


def trial_rows(log: LogContents) -> list[dict[str, Value]]:
    """Return a row for every attempt at a trial, in the order of their onsets.

    Raises
    ------
    UsageError
        The log speaks of a trial that its plan does not have.
    """
    plan = {trial.trial: trial for trial in log.start.plan.trials}
    attempts: dict[tuple[int, int], _Attempt] = {}
    for event in log.events:
        if not isinstance(event, TrialStart | StimulusStart | ResponseMade | TrialEnd):
            continue
        if event.trial is None or event.attempt is None:
            continue
        if event.trial not in plan:
            raise UsageError(f"trial {event.trial} is not in the session's plan", where=str(log.path))
        key = (event.trial, event.attempt)
        attempts.setdefault(key, _Attempt(plan[event.trial], event.attempt, event.t_s)).take(event)
    rows = [{**attempt.row(), SIMULATED.name: log.start.simulated} for attempt in attempts.values()]
    return sorted(rows, key=lambda row: (row["onset"], row["trial"], row["attempt"]))


@dataclass
class _Attempt:
    """What is known of one attempt at a trial; any of its lines may be missing from a damaged log."""

    planned: PlannedTrial
    number: int
    began_t_s: float
    start: TrialStart | None = None
    stimulus: StimulusStart | None = None
    end: TrialEnd | None = None
    presses: list[ResponseMade] = field(default_factory=list)

    def take(self, event: Event) -> None:
        if isinstance(event, TrialStart):
            self.start = event
        elif isinstance(event, StimulusStart):
            self.stimulus = event
        elif isinstance(event, TrialEnd):
            self.end = event
        elif isinstance(event, ResponseMade):
            self.presses.append(event)

    def row(self) -> dict[str, Value]:
        stimulus, end = self.stimulus, self.end
        complete = end is not None and end.status == "complete"
        return {
            "onset": to_us(stimulus.onset_t_s if stimulus else self.began_t_s),
            "duration": to_us(self._duration_s()),
            "trial_type": self.planned.trial_type,
            "trial": self.planned.trial,
            "block": self.planned.block,
            "attempt": self.number,
            "trial_status": "complete" if complete else "interrupted",
            "drive": self.planned.stimulus.drive,
            **(self.start.conditions if self.start else self.planned.conditions),
            "response": end.response if end else None,
            "response_time": to_us(end.response_time_s) if end else None,
            "button": self._button(),
            "onset_lateness": to_us(stimulus.onset_t_s - stimulus.planned_onset_t_s) if stimulus else None,
            "start_margin": to_us(stimulus.margin_s) if stimulus else None,
            "silent_before": to_us(end.silent_before_s) if end else None,
            "emitting_after": to_us(end.emitting_after_s) if end else None,
            "presses_before_onset": self._count("before_onset"),
            "presses_in_window": self._count("window"),
            "presses_late": self._count("late"),
            "exposure_s": to_us(stimulus.exposure_s) if stimulus else 0.0,
            "ear_level": stimulus.ear_level_db if stimulus else None,
            "underruns": end.underruns if end else None,
        }

    def _count(self, phase: str) -> int:
        return sum(press.phase == phase for press in self.presses)

    def _button(self) -> str | None:
        """Return which button made the answer."""
        if self.end is None or self.end.response_time_s is None:
            return None
        answers = (
            press.button
            for press in self.presses
            if press.phase == "window" and press.response_time_s == self.end.response_time_s
        )
        return next(answers, None)

    def _duration_s(self) -> float:
        if self.stimulus is None or self.stimulus.drive == 0:
            return 0.0
        if self.end is None or self.end.status == "complete":
            return self.stimulus.duration_s
        # The array is silenced before an interrupted trial's end is logged.
        return min(self.stimulus.duration_s, max(0.0, self.end.t_s - self.stimulus.onset_t_s))


def _factors(protocol: Protocol) -> Iterable[tuple[str, Factor, str]]:
    for name, factor in protocol.factors.within_block.items():
        yield name, factor, "varied from trial to trial"
    for name, factor in protocol.factors.between_blocks.items():
        yield name, factor, "varied from block to block"
    if protocol.method is not None:
        levels = Factor(levels=protocol.method.levels)
        yield protocol.method.varies, levels, "chosen by the adaptive method from the answers before"


def _factor_column(name: str, factor: Factor, where: str) -> Column:
    field_info = StimulusSpec.model_fields.get(name)
    meaning = f" {field_info.description}" if field_info and field_info.description else ""
    units = next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), None)
    numeric = all(isinstance(level, float) for level in factor.levels)
    return Column(
        name,
        f"Factor {name}, {where}; n/a where it does not apply.{meaning}",
        units=units if numeric else None,
        levels=_described_levels(factor) if factor.describe or not numeric else {},
    )


def _described_levels(factor: Factor) -> dict[str, str]:
    spelled = [cell(level) for level in factor.levels]
    return {level: factor.describe.get(level, level) for level in spelled}
