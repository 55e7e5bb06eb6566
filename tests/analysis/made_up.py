"""Made-up studies for figures and reports: rates, comparisons and thresholds alone, which are quick."""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
from autd_analysis.basics.intervals import t_interval
from autd_analysis.basics.paired import paired_t_test, sign_flip_test
from autd_analysis.comparisons.numbers import ComparisonResult, Difference
from autd_analysis.data.foreign.request import TableRequest
from autd_analysis.data.foreign.tables import read_tables
from autd_analysis.rates import RATES
from autd_analysis.results import Outcome, Results
from autd_analysis.study import analyse
from autd_analysis.thresholds import THRESHOLDS
from autd_analysis.thresholds.comparisons import Thresholds, compared_thresholds
from autd_analysis.thresholds.numbers import Threshold, over_participants

from autd_trials.protocol.method import Method
from autd_trials.protocol.schema import Comparison, Level


def made_up(
    folder: Path,
    levels: Mapping[str, Sequence[Level]],
    *,
    compared: str | None = None,
    at: str | None = None,
    people: int = 2,
    catch: bool = False,
    name: str = "made-up",
) -> Results:
    """Return rates and comparisons of a table with every combination of levels, half of the trials felt."""
    path = folder / f"{name}.csv"
    columns = ("participant", "response", "response_time", "trial_type", *levels)
    rows = [
        (f"p{person}", (trial + place + person) % 2, 0.3 + person / 100, "stimulus", *cell)
        for person in range(people)
        for place, cell in enumerate(itertools.product(*levels.values()))
        for trial in range(3)
    ]
    if catch:
        rows += [(f"p{person}", person % 2, 0.4, "catch", *("" for _ in levels)) for person in range(people)]
    lines = [",".join(f'"{cell}"' for cell in row) for row in (columns, *rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    comparisons = (
        (
            Comparison.model_construct(
                factor=compared,
                first=str(levels[compared][0]),
                second=str(levels[compared][1]),
                at_each=at,
            ),
        )
        if compared
        else ()
    )
    request = TableRequest(
        {column: column for column in columns},
        {factor: tuple(map(str, its)) for factor, its in levels.items()},
        comparisons,
    )
    return analyse(read_tables([path], request), only=["rates", "comparisons", "timing"])


def with_method(results: Results, method: Method) -> Results:
    """Return the same study as an adaptive one, with a threshold instead of each rate; one lies beyond."""
    rng = np.random.default_rng(1)
    design = dataclasses.replace(results.trials.design, method=method)
    found = [
        Threshold(
            rate.participant,
            rate.condition,
            threshold=None if number == 0 else float(rng.uniform(0.2, 0.8)),
            rate=0.5,
            spread_db=1.0,
            trials=40,
            beyond=int(number == 0),
            note=None,
        )
        for number, rate in enumerate(results[RATES].participants)
    ]
    thresholds = Thresholds(
        method, tuple(found), over_participants(found), compared_thresholds(found, design)
    )
    trials = dataclasses.replace(results.trials, design=design)
    words = THRESHOLDS.words(thresholds, trials)
    return Results(trials, (Outcome(THRESHOLDS, thresholds, shown=words),))


def with_differences(result: ComparisonResult, differences: Sequence[float]) -> ComparisonResult:
    """Return a comparison in which participants have these differences, in hundredths exactly."""
    exact = [Fraction(round(100 * each), 100) for each in differences]
    floats = [float(each) for each in exact]
    flip, t = sign_flip_test(exact), paired_t_test(exact)
    return dataclasses.replace(
        result,
        differences=tuple(
            Difference(result.contrast, f"p{number}", each, None) for number, each in enumerate(exact)
        ),
        mean=sum(floats) / len(floats),
        interval=t_interval(floats),
        sign_flip=flip,
        paired_t=t,
        sign_flip_holm=flip.p if flip else None,
        paired_t_holm=t.p if t else None,
        family=1,
    )
