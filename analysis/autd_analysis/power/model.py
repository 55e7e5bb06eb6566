"""What is simulated: the cells of a protocol's design, how likely they are felt, and what is compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Protocol as Interface

import numpy as np
from numpy.typing import NDArray

from autd_analysis.data.contrasts import Contrast, planned_contrasts
from autd_analysis.data.design import Condition, Design, conditions, describe_condition, protocol_design
from autd_analysis.rates.numbers import ParticipantRate
from autd_trials.errors import UsageError
from autd_trials.participants.population import Presented, detection_probabilities
from autd_trials.participants.simulated import CLOTHING_LAYERS
from autd_trials.participants.traits import Layer
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.schema import Protocol
from autd_trials.tables import level_text, number, read_table

_PEOPLE, _SEED = 20_000, 1

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


class Population(Interface):
    """People who may be drawn."""

    def probabilities(self, people: tuple[int, ...], generator: np.random.Generator) -> Array:
        """Return how likely each person answers "felt" in each cell, shape (*people, cells)."""


@dataclass(frozen=True)
class AssumedPopulation:
    """The simulated participants' assumed model."""

    presented: tuple[Presented, ...]

    def probabilities(self, people: tuple[int, ...], generator: np.random.Generator) -> Array:
        """Return how likely each person answers "felt" in each cell, shape (*people, cells)."""
        return detection_probabilities(self.presented, people, generator)


@dataclass(frozen=True, eq=False)
class GivenRates:
    """Given rates of an average person; people differ by normal deviations of logits, common and per cell."""

    rates: Array
    common_sd: float
    cell_sd: float

    def probabilities(self, people: tuple[int, ...], generator: np.random.Generator) -> Array:
        """Return how likely each person answers "felt" in each cell, shape (*people, cells)."""
        from scipy.special import expit, logit

        common = generator.normal(0, self.common_sd, (*people, 1))
        own = generator.normal(0, self.cell_sd, (*people, len(self.rates)))
        probabilities: Array = expit(logit(self.rates) + common + own)
        return probabilities


@dataclass(frozen=True, eq=False)
class CellContrast:
    """A planned contrast over cells: its name, and which are added up on each side."""

    contrast: Contrast
    name: str
    first: tuple[int, ...]
    second: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class StudyModel:
    """Everything that a simulated study needs.

    Attributes
    ----------
    design
        Factors and comparisons.
    cells
        All conditions.
    trials
        Trials in each cell, the same in all.
    contrasts
        The planned comparisons.
    population
        Who is drawn.
    """

    design: Design
    cells: tuple[Condition, ...]
    trials: int
    contrasts: tuple[CellContrast, ...]
    population: Population

    def people(self, studies: int, participants: int, generator: np.random.Generator) -> Array:
        """Draw people; return how likely each feels the stimulus, shape (studies, participants, cells)."""
        return self.population.probabilities((studies, participants), generator)

    def answers(self, chances: Array, generator: np.random.Generator) -> Counts:
        """Return how often people feel the stimuli, of the same shape as their chances."""
        return generator.binomial(self.trials, chances)

    def rates(self, counts: Counts) -> list[ParticipantRate]:
        """Return the rates of one study's counts, shape (participants, cells), as tests take them."""
        return [
            ParticipantRate(
                f"{person:04d}", cell, int(felt), self.trials, Fraction(int(felt), self.trials), None
            )
            for person, row in enumerate(counts)
            for cell, felt in zip(self.cells, row, strict=True)
        ]

    @cached_property
    def mean_logits(self) -> Array:
        """Mean over people of the logits of their chances, by a draw of 20,000, shape (cells,)."""
        from scipy.special import logit

        chances = self.population.probabilities((_PEOPLE,), np.random.default_rng(_SEED))
        mean: Array = logit(chances).mean(axis=0)
        return mean

    def without_difference(
        self, chances: Array, contrast: CellContrast, generator: np.random.Generator
    ) -> Array:
        """Return people's chances in the compared cells if these did not differ on average.

        People keep their slopes: from each one's difference of logits the mean over people is taken away, and
        what is left has either sign as likely, so that no test of any kind has a difference to find.

        Returns
        -------
        ndarray
            Shape (studies, participants, 2, compared cells on each side).
        """
        from scipy.special import expit, logit

        first, second = list(contrast.first), list(contrast.second)
        logits = logit(chances[..., [first, second]])
        middle = logits.mean(axis=-2)
        shift = self.mean_logits[first] - self.mean_logits[second]
        half = (logits[..., 0, :] - logits[..., 1, :] - shift) / 2
        half = half * generator.choice((-1.0, 1.0), (*half.shape[:-1], 1))
        return np.stack([expit(middle + half), expit(middle - half)], axis=-2)


def study_model(
    protocol: Protocol, rates: Mapping[Condition, float] | None, sds: tuple[float, float]
) -> StudyModel:
    """Return the model of a protocol's studies.

    Parameters
    ----------
    protocol
        Whose design and planned comparisons.
    rates
        Rates of an average person in each cell; the assumed participants if None.
    sds
        With given rates: standard deviations in logits, common to a person and of each cell.

    Raises
    ------
    UsageError
        The protocol plans no comparison, or its clothing is not one that the assumed participants know.
    """
    design = protocol_design(protocol)
    if design.method is not None:
        raise UsageError(
            "the protocol's levels are chosen by an adaptive method; power is simulated for constant stimuli",
            do="take a protocol without method:, or run simulated participants and analyse them",
        )
    if not design.comparisons:
        raise UsageError(
            "the protocol plans no comparison, so there is nothing to find", do="add comparisons:"
        )
    cells = conditions(design.factors)
    plan = make_plan(protocol, place=1, session=1, seed=1)
    stimuli = {
        tuple((factor.name, trial.conditions[factor.name]) for factor in design.factors): trial.stimulus
        for trial in plan.trials
        if trial.trial_type == "stimulus"
    }
    population: Population
    if rates is None:
        population = AssumedPopulation(
            tuple(Presented(stimuli[cell].drive, stimuli[cell].modulation_hz, _worn(cell)) for cell in cells)
        )
    else:
        population = GivenRates(np.array([rates[cell] for cell in cells]), *sds)
    return StudyModel(design, cells, protocol.repetitions, _contrasts(design, cells), population)


def read_rates(path: Path, design: Design) -> dict[Condition, float]:
    """Read a rate for each cell: a CSV with a column for each factor and one named ``rate``.

    Raises
    ------
    UsageError
        The file is wrong, or lacks a cell.
    """
    names = [factor.name for factor in design.factors]
    rates: dict[Condition, float] = {}
    table = read_table(path, "table of rates").with_decimal_points()
    table.require([*names, "rate"])
    for where, row in table.records():
        levels = [factor.parse(row[factor.name]) for factor in design.factors]
        for factor, level in zip(design.factors, levels, strict=True):
            if level is None:
                allowed = ", ".join(map(level_text, factor.levels))
                raise UsageError(
                    f"{factor.name} is {row[factor.name]!r}", where=where, do=f"one of {allowed}"
                )
        cell = tuple(zip(names, (level for level in levels if level is not None), strict=True))
        if cell in rates:
            raise UsageError(f"{describe_condition(cell)} has a rate already", where=where, do="give one")
        rates[cell] = _rate(row, where)
    missing = [describe_condition(cell) for cell in conditions(design.factors) if cell not in rates]
    if missing:
        raise UsageError(f"no rate for {'; '.join(missing)}", where=str(path))
    return rates


def _rate(row: Mapping[str, str], where: str) -> float:
    rate = number(row["rate"])
    if rate is None or not 0 < rate < 1:
        raise UsageError(f"rate is {row['rate']!r}", where=where, do="give a number over 0 and under 1")
    return rate


def _worn(cell: Condition) -> tuple[Layer, ...]:
    level = dict(cell).get("clothing")
    if level is None:
        return ()
    if str(level) not in CLOTHING_LAYERS:
        raise UsageError(
            f"the assumed participants do not know how much clothing {level!r} lets through",
            do=f"use one of {', '.join(CLOTHING_LAYERS)}, or give rates (--rates)",
        )
    return CLOTHING_LAYERS[str(level)]


def _contrasts(design: Design, cells: tuple[Condition, ...]) -> tuple[CellContrast, ...]:
    return tuple(
        CellContrast(
            contrast,
            f"{level_text(contrast.first)} - {level_text(contrast.second)}"
            + (f", {describe_condition(contrast.at)}" if contrast.at else ""),
            *(
                tuple(number for number, cell in enumerate(cells) if contrast.side(level) <= set(cell))
                for level in contrast.levels
            ),
        )
        for contrast in planned_contrasts(design)
    )
