"""Every trial of a session, in order, from a seed."""

from collections.abc import Sequence
from typing import Literal

from autd_trials.errors import UsageError
from autd_trials.model import Model
from autd_trials.protocol.conditions import combinations, level_text, names_varied
from autd_trials.protocol.latin_square import balanced_rows
from autd_trials.protocol.order import random_order
from autd_trials.protocol.randomness import Draws
from autd_trials.protocol.schema import Factor, Level, Protocol, StimulusSpec

TrialType = Literal["stimulus", "catch"]

_MICRO = 1_000_000
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
    """Return a plan as a table: a header, then a line per trial, tab-separated; missing is ``n/a``."""
    factors = list(plan.trials[0].conditions)
    header = ["place", "session", "seed", "block", "trial", "trial_type", *factors, "pause_before_s"]
    lines = ["\t".join(header)]
    for trial in plan.trials:
        numbers = (plan.place, plan.session, plan.seed, trial.block, trial.trial)
        levels = (trial.conditions[factor] for factor in factors)
        cells = [*map(str, numbers), trial.trial_type, *map(_cell, levels), _cell(trial.pause_before_s)]
        lines.append("\t".join(cells))
    return "\n".join(lines) + "\n"


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
    shortest, longest = (
        round(protocol.timing.pause_min_s * _MICRO),
        round(protocol.timing.pause_max_s * _MICRO),
    )
    return (shortest + draws.below(longest - shortest + 1)) / _MICRO


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


def _cell(value: Level | None) -> str:
    return "n/a" if value is None else level_text(value)
