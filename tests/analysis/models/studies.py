"""The studies of tests/analysis/reference as the models take them, and what R found."""

import csv
from functools import cache
from pathlib import Path

import numpy as np
from autd_analysis.data.contrasts import Contrast
from autd_analysis.models.glmm import BinomialRows
from autd_analysis.rates.numbers import ParticipantRate

REFERENCE = Path(__file__).parents[1] / "reference"
CELLS = [f"{frequency} {clothing}" for frequency in (25, 50, 100) for clothing in ("inner", "both")]
STUDIES = [1, 2, 3, 4, 5]
CLOTHING = Contrast("clothing", "inner", "both")


def lines(number: int) -> list[dict[str, str]]:
    """The lines of a study: a participant in a cell each."""
    with (REFERENCE / "glmm_studies.csv").open() as file:
        return [line for line in csv.DictReader(file) if line["study"] == str(number)]


def study(number: int, *, slope: bool = True) -> BinomialRows:
    """A study's answers with cells as fixed effects in the order of `CELLS`."""
    found = lines(number)
    cells = [CELLS.index(f"{line['modulation_hz']} {line['clothing']}") for line in found]
    sides = np.array([0.5 if line["clothing"] == "both" else -0.5 for line in found])
    ones = np.ones(len(found))
    return BinomialRows(
        felt=np.array([float(line["felt"]) for line in found]),
        trials=np.array([float(line["trials"]) for line in found]),
        fixed=np.eye(len(CELLS))[cells],
        random=np.column_stack([ones, sides]) if slope else ones[:, None],
        participant=np.array([int(line["participant"]) - 1 for line in found]),
    )


def rates(number: int) -> list[ParticipantRate]:
    """A study's counts in the single cells."""
    return [
        ParticipantRate(
            participant=line["participant"],
            condition=(("modulation_hz", float(line["modulation_hz"])), ("clothing", line["clothing"])),
            felt=int(line["felt"]),
            n=int(line["trials"]),
            rate=None,
            interval=None,
        )
        for line in lines(number)
    ]


@cache
def r_values(file: str, number: int, model: str) -> dict[str, float]:
    """What R found, from a reference file."""
    with (REFERENCE / file).open() as opened:
        found = [
            line for line in csv.DictReader(opened) if (line["study"], line["model"]) == (str(number), model)
        ]
    return {line["name"]: float(line["value"]) for line in found}


def single_answers(rows: BinomialRows) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every answer by itself (1: felt), its fixed effects and its participant."""
    trials = rows.trials.astype(int)
    felt = [np.repeat([1.0, 0.0], [int(y), n - int(y)]) for y, n in zip(rows.felt, trials, strict=True)]
    return np.concatenate(felt), np.repeat(rows.fixed, trials, axis=0), np.repeat(rows.participant, trials)


def uneven(number: int) -> BinomialRows:
    """A study in which half the cells lost trials, as in reference/models.R."""
    rows = study(number)
    trials = np.maximum(rows.felt, 3 + 7 * (np.arange(1, len(rows.felt) + 1) % 2))
    return BinomialRows(rows.felt, trials, rows.fixed, rows.random, rows.participant)
