"""Data sets that R's glm was fitted to (reference/psychometric.R)."""

import csv
from dataclasses import dataclass
from pathlib import Path

from autd_analysis.psychometric.functions import LOGISTIC, NORMAL, WEIBULL, Axis
from autd_analysis.psychometric.model import Answers, answers

OCTAVES = Axis(logarithmic=True)
CORES = {core.name: core for core in (LOGISTIC, NORMAL, WEIBULL)}
CASES = [(data, core) for data in ("three", "six", "single") for core in CORES]
REFERENCE = Path(__file__).parents[1] / "reference" / "psychometric.csv"


@dataclass(frozen=True)
class Reference:
    """A data set and what R says of it; thresholds are log2 of the stimulus."""

    answers: Answers
    values: dict[str, float]


def reference(data: str, core: str) -> Reference:
    with REFERENCE.open() as file:
        lines = [line for line in csv.DictReader(file) if (line["data"], line["core"]) == (data, core)]
    rows = [(float(line["x"]), float(line["felt"]), float(line["n"])) for line in lines]
    names = [name for name in lines[0] if name not in ("data", "core", "x", "felt", "n")]
    return Reference(answers(rows, OCTAVES), {name: float(lines[0][name]) for name in names})
