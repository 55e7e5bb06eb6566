"""The table of trials of a session (``_events.tsv``): one row for every attempt at a trial."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from autd_trials.protocol.plan import PlannedTrial
from autd_trials.protocol.schema import Factor, Level, Protocol, StimulusSpec
from autd_trials.records.columns import simulated_column, to_us
from autd_trials.records.log import LogContents
from autd_trials.session.events import Event, ResponseMade, StimulusStart, TrialEnd, TrialStart
from autd_trials.tables import Column, level_text, of, require_reserved

_UNITS = {"_hz": "Hz", "_s": "s", "_mm": "mm", "_db": "dB", "_pa": "Pa"}


@dataclass
class Attempt:
    """What is known of one attempt at a trial; any of its lines may be missing from a damaged log."""

    planned: PlannedTrial
    number: int
    began_t_s: float
    simulated: bool
    start: TrialStart | None = None
    stimulus: StimulusStart | None = None
    end: TrialEnd | None = None
    presses: list[ResponseMade] = field(default_factory=list)

    def take(self, event: Event) -> None:
        """Keep what an event of this attempt says."""
        if isinstance(event, TrialStart):
            self.start = event
        elif isinstance(event, StimulusStart):
            self.stimulus = event
        elif isinstance(event, TrialEnd):
            self.end = event
        elif isinstance(event, ResponseMade):
            self.presses.append(event)

    @property
    def onset_s(self) -> float:
        """When its stimulus began, or the attempt if it had none, from the session's start."""
        return self.stimulus.onset_t_s if self.stimulus else self.began_t_s

    @property
    def duration_s(self) -> float:
        """How long the array emitted."""
        if self.stimulus is None or self.stimulus.drive == 0:
            return 0.0
        if self.end is None or self.complete:
            return self.stimulus.duration_s
        # The array is silenced before an interrupted trial's end is logged.
        return min(self.stimulus.duration_s, max(0.0, self.end.t_s - self.stimulus.onset_t_s))

    @property
    def complete(self) -> bool:
        """Whether it ran to the end of its response window."""
        return self.end is not None and self.end.status == "complete"

    @property
    def button(self) -> str | None:
        """Which button, key or line made the answer; None if there was none."""
        if self.end is None or self.end.response_time_s is None:
            return None
        answers = (
            press.button
            for press in self.presses
            if press.phase == "window" and press.response_time_s == self.end.response_time_s
        )
        return next(answers, None)

    def count(self, phase: str) -> int:
        """Return how many presses fell into a phase."""
        return sum(press.phase == phase for press in self.presses)

    @property
    def levels(self) -> Mapping[str, Level | None]:
        """The levels of all that is varied, by name; None where there is none."""
        return self.start.conditions if self.start else self.planned.conditions


def trial_rows(log: LogContents) -> list[Attempt]:
    """Return every attempt at a trial, in the order of their onsets."""
    plan = {trial.trial: trial for trial in log.start.plan.trials}
    attempts: dict[tuple[int, int], Attempt] = {}
    for event in log.events:
        if not isinstance(event, TrialStart | StimulusStart | ResponseMade | TrialEnd):
            continue
        if event.trial is None or event.attempt is None:
            continue
        key = (event.trial, event.attempt)
        new = Attempt(plan[event.trial], event.attempt, event.t_s, log.start.simulated)
        attempts.setdefault(key, new).take(event)
    return sorted(attempts.values(), key=lambda each: (each.onset_s, each.planned.trial, each.number))


def trial_columns(protocols: Iterable[Protocol]) -> list[Column[Attempt]]:
    """Return the columns of a study; the factors are those of all its protocols."""
    factors: dict[str, Column[Attempt]] = {}
    for protocol in protocols:
        for name, factor, where in _factors(protocol):
            column = _factor_column(name, factor, where)
            known = factors.get(column.name)
            levels = {**(known.levels if known else {}), **column.levels}
            factors[column.name] = replace(column, levels=levels)
    return [*_LEADING, *(column for name, column in factors.items() if name != _DRIVE.name), *_TRAILING]


def _factors(protocol: Protocol) -> Iterable[tuple[str, Factor, str]]:
    for name, factor in protocol.factors.within_block.items():
        yield name, factor, "varied from trial to trial"
    for name, factor in protocol.factors.between_blocks.items():
        yield name, factor, "varied from block to block"
    if protocol.method is not None:
        levels = Factor(levels=protocol.method.levels)
        yield protocol.method.varies, levels, "chosen by the adaptive method from the answers before"


def _factor_column(name: str, factor: Factor, where: str) -> Column[Attempt]:
    field_info = StimulusSpec.model_fields.get(name)
    meaning = f" {field_info.description}" if field_info and field_info.description else ""
    units = next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), None)
    numeric = all(isinstance(level, float) for level in factor.levels)
    return Column(
        name,
        f"Factor {name}, {where}; n/a where it does not apply.{meaning}",
        lambda attempt: attempt.levels.get(name),
        units=units if numeric else None,
        levels=_described_levels(factor) if factor.describe or not numeric else {},
    )


def _described_levels(factor: Factor) -> dict[str, str]:
    spelled = map(level_text, factor.levels)
    return {level: factor.describe.get(level, level) for level in spelled}


def _stimulus(attempt: Attempt) -> StimulusStart | None:
    return attempt.stimulus


def _end(attempt: Attempt) -> TrialEnd | None:
    return attempt.end


_LEADING: tuple[Column[Attempt], ...] = (
    Column(
        "onset",
        "Onset of the stimulus (of the silent interval in a catch trial), timed by the array and counted "
        "from the session's start. A trial interrupted before its stimulus was started has the time at "
        "which it began.",
        lambda attempt: to_us(attempt.onset_s),
        units="s",
    ),
    Column(
        "duration",
        "Commanded length of the burst; 0 where nothing was emitted. Where a trial was interrupted within "
        "its burst, the time until it was surely cut off.",
        lambda attempt: to_us(attempt.duration_s),
        units="s",
    ),
    Column(
        "trial_type",
        "Whether there was something to feel.",
        lambda attempt: attempt.planned.trial_type,
        levels={
            "stimulus": "A focus was presented.",
            "catch": "Everything as ever, but nothing was emitted.",
        },
    ),
    Column(
        "trial",
        "Number of the trial in the session's plan, from 1; interrupted trials are run again.",
        lambda attempt: attempt.planned.trial,
    ),
    Column(
        "block",
        "Number of the block in the session's plan, from 1.",
        lambda attempt: attempt.planned.block,
    ),
    Column(
        "attempt",
        "Which attempt at this trial the row is about, from 1.",
        lambda attempt: attempt.number,
    ),
    Column(
        "trial_status",
        "Whether the attempt counts.",
        lambda attempt: "complete" if attempt.complete else "interrupted",
        levels={
            "complete": "Ran to the end of its response window.",
            "interrupted": "Cut short by a fault, a crash or a person; does not count.",
        },
    ),
)

_DRIVE: Column[Attempt] = Column(
    "drive",
    "Commanded peak pressure amplitude as a fraction of the array's largest; in catch trials 0, or n/a "
    "if the drive is a factor.",
    lambda attempt: attempt.levels.get("drive", attempt.planned.stimulus.drive),
    units="1",
)
"""The one column that a factor may be: its levels are what the column says anyway."""

_TRAILING: tuple[Column[Attempt], ...] = (
    _DRIVE,
    Column(
        "response",
        "The answer; n/a for an interrupted attempt.",
        of(_end, lambda end: end.response),
        levels={
            "felt": "A press within the response window.",
            "not_felt": "No press within the response window.",
        },
    ),
    Column(
        "response_time",
        "From the onset to the first press within the response window.",
        of(_end, lambda end: to_us(end.response_time_s)),
        units="s",
    ),
    Column(
        "button",
        "The button, key or line of the press that made the answer; n/a if there was none.",
        lambda attempt: attempt.button,
    ),
    Column(
        "onset_lateness",
        "Actual onset minus planned onset.",
        of(_stimulus, lambda stimulus: to_us(stimulus.onset_t_s - stimulus.planned_onset_t_s)),
        units="s",
    ),
    Column(
        "start_margin",
        "What was left between the moment at which the array had accepted the start command and the onset.",
        of(_stimulus, lambda stimulus: to_us(stimulus.margin_s)),
        units="s",
    ),
    Column(
        "silent_before",
        "How long before the onset the array was last read back as silent.",
        of(_end, lambda end: to_us(end.silent_before_s)),
        units="s",
    ),
    Column(
        "emitting_after",
        "How long after the onset the array was first read back as emitting.",
        of(_end, lambda end: to_us(end.emitting_after_s)),
        units="s",
    ),
    Column(
        "presses_before_onset",
        "Presses from the beginning of the trial to its onset.",
        lambda attempt: attempt.count("before_onset"),
    ),
    Column(
        "presses_in_window",
        "Presses within the response window, repeated ones included.",
        lambda attempt: attempt.count("window"),
    ),
    Column("presses_late", "Presses after the response window.", lambda attempt: attempt.count("late")),
    Column(
        "exposure_s",
        "Commanded exposure: drive squared times duration, as counted against the session's budget.",
        lambda attempt: to_us(attempt.stimulus.exposure_s) if attempt.stimulus else 0.0,
        units="s",
    ),
    Column(
        "ear_level",
        "Predicted largest sound pressure level at the ears (free field, linear theory, less the hearing "
        "protection); n/a where nothing was emitted or the head's place was not given.",
        of(_stimulus, lambda stimulus: stimulus.ear_level_db),
        units="dB",
    ),
    Column("underruns", "Gaps in the masking noise during the trial.", of(_end, lambda end: end.underruns)),
    simulated_column(lambda attempt: attempt.simulated),
)

require_reserved(column for column in (*_LEADING, *_TRAILING) if column is not _DRIVE)
