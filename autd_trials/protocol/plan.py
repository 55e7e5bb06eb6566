"""Every trial of a session, in order, from a seed."""

from collections.abc import Sequence
from typing import Literal

from autd_trials.errors import UsageError
from autd_trials.model import Model
from autd_trials.protocol.conditions import combinations, names_varied
from autd_trials.protocol.latin_square import balanced_rows
from autd_trials.protocol.order import random_order
from autd_trials.protocol.randomness import Draws
from autd_trials.protocol.schema import Factor, Level, Protocol, StimulusSpec
from autd_trials.tables import Column, level_text, require_reserved, tsv

TrialType = Literal["stimulus", "catch"]

_Kind = dict[str, Level] | None
"""The levels of the factors within a block that tell a kind of trial from another; None is a catch trial."""


class PlannedTrial(Model):
    """One trial.

    `conditions` holds every factor by name; a within-block factor is None on a catch trial. A catch trial's
    `stimulus` has drive 0, so that the host does exactly the same for it. What an adaptive method will choose
    is None in `conditions`, and at its largest level in `stimulus`.
    """

    trial: int
    block: int
    trial_type: TrialType
    conditions: dict[str, Level | None]
    stimulus: StimulusSpec
    pause_before_s: float


class PlannedBlock(Model):
    """One block: the levels of the factors between blocks, and their descriptions."""

    block: int
    conditions: dict[str, Level]
    descriptions: tuple[str, ...]


class Plan(Model):
    """A session's plan. `trials` are numbered from 1 over the whole session, `blocks` from 1."""

    protocol: str
    place: int
    session: int
    seed: int
    blocks: tuple[PlannedBlock, ...]
    trials: tuple[PlannedTrial, ...]


def make_plan(protocol: Protocol, *, place: int, session: int, seed: int) -> Plan:
    """Plan a session; the same arguments give the same plan on every machine.

    Parameters
    ----------
    protocol
        What is to be done.
    place
        The participant's place in the roster, from 1. With counterbalanced blocks it alone (with `session`)
        gives their order.
    session
        The session's number, from 1.
    seed
        Seed of everything that is drawn: orders and pauses. Not negative.

    Raises
    ------
    UsageError
        A number is out of its range, or no order of a block's trials keeps to the longest run.
    """
    _refuse_numbers(place=place, session=session, seed=seed)
    blocks = _blocks(protocol, place, session, seed)
    trials: list[PlannedTrial] = []
    for block in blocks:
        draws = Draws("trials", seed, place, session, block.block)
        for kind in _order_of_kinds(protocol, draws):
            pause_s = _pause_before_s(protocol, draws)
            trials.append(_trial(protocol, block, kind, len(trials) + 1, pause_s))
    return Plan(
        protocol=protocol.name,
        place=place,
        session=session,
        seed=seed,
        blocks=tuple(blocks),
        trials=tuple(trials),
    )


def plan_to_tsv(plan: Plan) -> str:
    """Return a plan as a tab-separated table with a line per trial."""
    return tsv(plan_columns(plan), [(plan, trial) for trial in plan.trials])


def plan_columns(plan: Plan) -> list[Column[tuple[Plan, PlannedTrial]]]:
    """Return the columns of a plan's table; a row is a plan and one of its trials."""
    return [*_LEADING, *map(_condition_column, plan.trials[0].conditions), _PAUSE]


def _condition_column(name: str) -> Column[tuple[Plan, PlannedTrial]]:
    return Column(name, f"Level of {name}; n/a where it does not apply.", lambda row: row[1].conditions[name])


_LEADING: tuple[Column[tuple[Plan, PlannedTrial]], ...] = (
    Column("place", "The participant's place in the roster, from 1.", lambda row: row[0].place),
    Column("session", "The session's number, from 1.", lambda row: row[0].session),
    Column("seed", "Seed of the plan.", lambda row: row[0].seed),
    Column("block", "Number of the block, from 1.", lambda row: row[1].block),
    Column("trial", "Number of the trial in the session, from 1.", lambda row: row[1].trial),
    Column("trial_type", "Whether there is something to feel.", lambda row: row[1].trial_type),
)
_PAUSE: Column[tuple[Plan, PlannedTrial]] = Column(
    "pause_before_s", "From the end of the trial before to this one.", lambda row: row[1].pause_before_s, "s"
)
require_reserved([*_LEADING, _PAUSE])


def _refuse_numbers(*, place: int, session: int, seed: int) -> None:
    for name, number, smallest in (("place", place, 1), ("session", session, 1), ("seed", seed, 0)):
        if number < smallest:
            raise UsageError(f"the {name} is {number}", do=f"give a whole number from {smallest} on")


def _blocks(protocol: Protocol, place: int, session: int, seed: int) -> list[PlannedBlock]:
    factors = protocol.factors.between_blocks
    declared = list(combinations(factors))
    match protocol.order.blocks:
        case "balanced_latin_square":
            rows = balanced_rows(len(declared))
            order = rows[(place - 1 + session - 1) % len(rows)]  # a second session gets the next order
        case "shuffled":
            order = Draws("blocks", seed, place, session).shuffled(range(len(declared)))
        case "fixed":
            order = list(range(len(declared)))
    return [
        PlannedBlock(
            block=number,
            conditions=declared[index],
            descriptions=_descriptions(factors, declared[index]),
        )
        for number, index in enumerate(order, start=1)
    ]


def _descriptions(factors: dict[str, Factor], conditions: dict[str, Level]) -> tuple[str, ...]:
    sentences = (factors[name].describe.get(level_text(level)) for name, level in conditions.items())
    return tuple(sentence for sentence in sentences if sentence is not None)


def _order_of_kinds(protocol: Protocol, draws: Draws) -> list[_Kind]:
    """Return the kinds of a block's trials in order."""
    kinds: list[_Kind] = [*combinations(protocol.factors.within_block), None]
    counts = [protocol.repetitions] * (len(kinds) - 1) + [protocol.catch_trials_per_block]
    if protocol.order.trials == "fixed":
        rounds = range(max(counts))
        return [kind for turn in rounds for kind, count in zip(kinds, counts, strict=True) if turn < count]
    return _shuffled_kinds(kinds, counts, protocol, draws)


def _shuffled_kinds(
    kinds: Sequence[_Kind], counts: Sequence[int], protocol: Protocol, draws: Draws
) -> list[_Kind]:
    """Return one of the orders that keep to the longest run, all equally probable.

    Runs are counted over groups of kinds. First the groups are ordered, then the trials of each group.
    """
    groups: dict[str, list[_Kind]] = {}
    for kind, count in zip(kinds, counts, strict=True):
        groups.setdefault(_run_group(kind, protocol.order.max_run_of), []).extend([kind] * count)
    sizes = [len(trials) for trials in groups.values()]
    order = random_order(sizes, protocol.order.max_run_length, draws)
    queues = [iter(draws.shuffled(trials)) for trials in groups.values()]
    return [next(queues[group]) for group in order]


def _run_group(kind: _Kind, run_of: str | None) -> str:
    """Return what a run is made of: the whole condition, the trial type or the level of one factor."""
    if kind is None:
        return "catch"
    if run_of == "trial_type":
        return "stimulus"
    levels = kind.values() if run_of is None else [kind[run_of]]
    return "stimulus " + " ".join(map(level_text, levels))


def _pause_before_s(protocol: Protocol, draws: Draws) -> float:
    """Draw a pause, even over the whole microseconds from the shortest to the longest."""
    shortest, longest = protocol.timing.pauses_us
    return (shortest + draws.below(longest - shortest + 1)) / 1e6


def _trial(
    protocol: Protocol, block: PlannedBlock, kind: _Kind, number: int, pause_before_s: float
) -> PlannedTrial:
    stimulus = protocol.stimulus_for({**block.conditions, **(kind or {})})
    levels: dict[str, Level | None] = {**block.conditions, **(kind or {})}
    return PlannedTrial(
        trial=number,
        block=block.block,
        trial_type="catch" if kind is None else "stimulus",
        conditions={name: levels.get(name) for name in names_varied(protocol)},
        stimulus=stimulus.model_copy(update={"drive": 0.0}) if kind is None else stimulus,
        pause_before_s=pause_before_s,
    )
