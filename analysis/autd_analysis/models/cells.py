"""Answers by participant and cell of the design, as the models take them; separation and Firth's penalty.

Every cell (condition) has a fixed effect of its own. Answers are then separated exactly where all or none
were felt in a cell: its logit is infinite. Firth's penalty keeps it finite, and for cell means alone it is
half a felt and half an unfelt answer that are added to every cell. D. Firth (1993), Biometrika 80, 27-38.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Condition, describe_condition
from autd_analysis.models.marginal import BinomialRows
from autd_analysis.rates.numbers import ParticipantRate

FEWEST_PARTICIPANTS = 4
PENALTY = 0.5
"""Answers of each kind that are added to every cell where answers are separated."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NoModel:
    """Why there is no model."""

    cause: str


def compared_rows(
    rates: Sequence[ParticipantRate], contrast: Contrast
) -> tuple[BinomialRows, Array] | NoModel:
    """Return the responses that inform a comparison, and the weights of their cells in it.

    Parameters
    ----------
    rates
        Rates in the single cells.
    contrast
        What is compared; at a level of another factor, by the trials there alone.

    Returns
    -------
    (BinomialRows, array) or NoModel
        The cause with fewer than 4 participants, or without trials in a cell that is compared.
    """
    there = [rate for rate in rates if contrast.takes(rate.condition)]
    planned = list(dict.fromkeys(rate.condition for rate in there))
    people = len({rate.participant for rate in there if rate.n > 0})
    if people < FEWEST_PARTICIPANTS:
        return too_few(people)
    rows, cells = cell_rows(there, contrast)
    weights = zip(planned, contrast_weights(planned, contrast), strict=True)
    empty = [describe_condition(cell) for cell, weight in weights if weight and cell not in cells]
    if empty:
        return NoModel(f"no trials in {'; '.join(empty)}")
    return rows, contrast_weights(cells, contrast)


def too_few(people: int) -> NoModel:
    """Return that a mixed model needs more people."""
    return NoModel(f"{people} participant(s) with answers, and it takes {FEWEST_PARTICIPANTS}")


def cell_rows(
    rates: Sequence[ParticipantRate], compared: Contrast | None
) -> tuple[BinomialRows, list[Condition]]:
    """Return the answers with cells as fixed effects, and the cells.

    Random effects are an intercept and, if levels are compared, the slope of the compared factor, which is
    1/2 at the first level, -1/2 at the second and 0 elsewhere. Cells and participants without trials are left
    out.
    """
    counted = [rate for rate in rates if rate.n > 0]
    seen = {rate.condition for rate in counted}
    cells = [cell for cell in dict.fromkeys(rate.condition for rate in rates) if cell in seen]
    people = list(dict.fromkeys(rate.participant for rate in counted))
    random = [np.ones(len(counted))]
    if compared:
        sides = {compared.first: 0.5, compared.second: -0.5}
        random.append(np.array([sides.get(dict(rate.condition)[compared.factor], 0.0) for rate in counted]))
    rows = BinomialRows(
        felt=np.array([float(rate.felt) for rate in counted]),
        trials=np.array([float(rate.n) for rate in counted]),
        fixed=np.eye(len(cells))[[cells.index(rate.condition) for rate in counted]],
        random=np.column_stack(random),
        participant=np.array([people.index(rate.participant) for rate in counted], dtype=np.intp),
    )
    return rows, cells


def contrast_weights(cells: Sequence[Condition], contrast: Contrast) -> Array:
    """Return weights of the cells: mean of those with the first level minus mean of those with the second."""
    weights = np.zeros(len(cells))
    for level, sign in zip(contrast.levels, (1.0, -1.0), strict=True):
        chosen = [contrast.side(level) <= set(cell) for cell in cells]
        weights[chosen] = sign / max(1, sum(chosen))
    return weights


def participants(rows: BinomialRows) -> int:
    """Return the number of participants with answers."""
    return len(np.unique(rows.participant))


def is_separated(rows: BinomialRows) -> bool:
    """Return whether a cell's answers are all the same: with cells as fixed effects there is no other way."""
    felt, trials = rows.fixed.T @ rows.felt, rows.fixed.T @ rows.trials
    return bool(((felt == 0) | (felt == trials)).any())


def penalised(rows: BinomialRows) -> BinomialRows:
    """Return the answers with Firth's penalty, spread over the participants of each cell."""
    share = PENALTY / (rows.fixed @ rows.fixed.sum(axis=0))  # of a cell's penalty, for each of its rows
    return BinomialRows(rows.felt + share, rows.trials + 2 * share, rows.fixed, rows.random, rows.participant)
