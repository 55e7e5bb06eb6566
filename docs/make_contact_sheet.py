"""Makes contact sheets of the figures of results, to be looked at: ``make contact-sheet``.

A sheet for each script and width with every number of levels, people and factors, of constant stimuli; sheets
of thresholds, of psychometric functions and of timing. The studies are made up.
"""

import argparse
import dataclasses
import functools
import io
import itertools
import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.data.foreign.request import TableRequest
from autd_analysis.data.foreign.tables import read_tables
from autd_analysis.psychometric import PSYCHOMETRIC
from autd_analysis.rates import RATES
from autd_analysis.report.facets import study_facets
from autd_analysis.report.figure_options import WIDTHS_MM, FigureOptions, labelled
from autd_analysis.report.style import figure_style
from autd_analysis.results import Outcome, Results
from autd_analysis.study import analyse
from autd_analysis.subject import Subject
from autd_analysis.thresholds import THRESHOLDS
from autd_analysis.thresholds.comparisons import Thresholds, compared_thresholds
from autd_analysis.thresholds.numbers import Threshold, over_participants
from autd_analysis.timing import TIMING
from PIL import Image

from autd_trials.protocol.method import QuestPlusMethod, Range, Staircase
from autd_trials.protocol.schema import Comparison, Level

_DPI = 100
_COLUMNS = {"single": 8, "double": 4}
_LEVELS, _PEOPLE, _FACTORS = (1, 2, 12), (1, 60), (1, 2, 3, 4)
_METHODS = (
    Staircase(
        kind="staircase",
        varies="drive",
        range=Range(smallest=0.1, largest=1, levels=21),
        start=1,
        felt_to_go_down=2,
    ),
    QuestPlusMethod(kind="quest_plus", varies="drive", range=Range(smallest=0.1, largest=1, levels=21)),
)
_WORDS = ("clothing", "posture", "hand")
_NAMES = {
    "latin": ("clothing", "posture", "hand", "thick woollen jumper over a shirt of kind {}", "no {}"),
    "japanese": ("衣服", "姿勢", "手", "厚いセーターと綿のシャツ{}番", "なし{}"),
    "arabic": ("الملابس", "الوضعية", "اليد", "سترة صوفية سميكة {}", "بدون {}"),
}


def main() -> None:
    """Make them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("build/contact-sheet"))
    parser.add_argument("--script", choices=_NAMES, action="append", help="which scripts (all)")
    options = parser.parse_args()
    folder = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    for script, width in itertools.product(options.script or _NAMES, _COLUMNS):
        for kind, figures in (("rates", _rates()), ("thresholds", _thresholds()), ("others", _others())):
            pictures = (
                _picture(_named(results, script), WIDTHS_MM[width], subject) for results, subject in figures
            )
            file = folder / f"{kind}-{script}-{width}.png"
            _tiled(list(pictures), _COLUMNS[width]).save(file)
            print(file)  # noqa: T201


def _rates() -> Iterator[tuple[Results, Subject[Any]]]:
    for levels, people, factors in itertools.product(_LEVELS, _PEOPLE, _FACTORS):
        results = _study(levels, people, factors)
        yield results, COMPARISONS if results[COMPARISONS] else RATES


def _thresholds() -> Iterator[tuple[Results, Subject[Any]]]:
    for method, levels, people in itertools.product(_METHODS, _LEVELS, _PEOPLE):
        yield _adaptive(_study(levels, people, 1 + people // 20), method), THRESHOLDS


def _others() -> Iterator[tuple[Results, Subject[Any]]]:
    for levels, factors in ((2, 1), (12, 2), (2, 4)):
        results = _study(levels, 6, factors, hertz=5)
        if results[PSYCHOMETRIC]:
            yield results, PSYCHOMETRIC
        yield results, TIMING


@functools.cache
def _study(levels: int, people: int, factors: int, hertz: int = 2) -> Results:
    """Return rates and comparisons of a made-up study: frequencies, and up to three factors of words."""
    rng = np.random.default_rng(1000 * levels + 10 * people + factors)
    words: dict[str, Sequence[Level]] = {
        "clothing": [f"kind{n}" for n in range(levels)],
        "posture": ["a_1", "a 1"],
        "hand": ["+", "\N{MINUS SIGN}"],
    }
    chosen = dict(list(words.items())[: max(1, factors - 1)])
    if factors > 1:
        chosen["modulation_hz"] = [25 * 2**n for n in range(hertz)]
    rows = [",".join(["participant", "response", "response_time", "trial_type", *chosen])]
    for person in range(people):
        for place, cell in enumerate(itertools.product(*chosen.values())):
            rate = min(0.98, max(0.02, 0.5 + 0.4 * math.sin(place) + rng.normal(0, 0.15)))
            for _ in range(5):
                response = (int(rng.random() < rate), f"{rng.gamma(4, 0.2):.3f}", "stimulus")
                rows.append(",".join(map(str, (f"p{person}", *response, *cell))))
        rows += [
            ",".join((f"p{person}", str(int(rng.random() < 0.1)), "", "catch", *("" for _ in chosen)))
            for _ in range(5 * (factors % 2))
        ]
    compared = [name for name, its in chosen.items() if len(its) > 1]
    comparisons = [
        Comparison.model_construct(
            factor=name,
            first=str(chosen[name][0]),
            second=str(chosen[name][1]),
            at_each=next(iter(others), None),
        )
        for name, *others in filter(None, [compared])
    ]
    columns = {name: name for name in ("participant", "response", "response_time", "trial_type", *chosen)}
    its_levels = {name: tuple(map(str, each)) for name, each in chosen.items()}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")
        trials = read_tables([path], TableRequest(columns, its_levels, tuple(comparisons)))
    return analyse(trials, only=["rates", "comparisons", "timing", *(["psychometric"] if hertz > 2 else [])])


def _named(results: Results, script: str) -> Results:
    """Return a study whose factors and levels have names in a script."""
    *titles, long, short = _NAMES[script]
    design = results.trials.design
    names = {factor.name for factor in design.factors}
    kinds = [level for factor in design.factors if factor.name == "clothing" for level in factor.levels]
    options = FigureOptions(
        titles={name: title for name, title in zip(_WORDS, titles, strict=True) if name in names},
        labels={
            "clothing": {str(kind): (short if n % 2 else long).format(n + 1) for n, kind in enumerate(kinds)}
        },
    )
    size = f"{len(kinds)}x{len(names)}"
    named = dataclasses.replace(labelled(design, options), protocol=f"{titles[0]} {size}")
    return dataclasses.replace(results, trials=dataclasses.replace(results.trials, design=named))


def _adaptive(results: Results, method: Staircase | QuestPlusMethod) -> Results:
    """Return a study with made-up thresholds instead of rates; some lie beyond the levels."""
    rng = np.random.default_rng(1)
    design = dataclasses.replace(results.trials.design, method=method)
    found = []
    for rate in results[RATES].participants:
        level = 0.4 * 10 ** rng.normal(0, 0.2)
        beyond = int(level > 1) - int(level < 0.1)
        threshold = None if beyond else level
        found.append(Threshold(rate.participant, rate.condition, threshold, 0.5, 1.0, 40, beyond, None))
    thresholds = Thresholds(
        method, tuple(found), over_participants(found), compared_thresholds(found, design)
    )
    trials = dataclasses.replace(results.trials, design=design)
    return Results(trials, (Outcome(THRESHOLDS, thresholds),))


def _picture(results: Results, width_mm: float, subject: Subject[Any]) -> Image.Image:
    options = FigureOptions(width=width_mm)
    with figure_style(study_facets(results.trials.design, options).text):
        figure = next(iter(subject.figures(results[subject], results))).draw(options)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=_DPI)
    return Image.open(buffer).convert("RGB")


def _tiled(pictures: Sequence[Image.Image], columns: int) -> Image.Image:
    """Return pictures side by side in columns, each below the last in the column that is shortest."""
    width = max(picture.width for picture in pictures) + 10
    heights = [0] * columns
    places = []
    for picture in pictures:
        column = heights.index(min(heights))
        places.append((column * width, heights[column]))
        heights[column] += picture.height + 10
    sheet = Image.new("RGB", (columns * width, max(heights)), "#888888")
    for picture, place in zip(pictures, places, strict=True):
        sheet.paste(picture, place)
    return sheet


if __name__ == "__main__":
    main()
