"""Writes the tables of docs/statistics.md: how often tests find what is not there. ``make statistics``.

Studies of the paper's design are simulated in which all conditions are felt equally often; people differ by a
standard deviation of 1 logit, and by 0.57 in each condition, so that the difference of two conditions varies
over people by 0.8 logits. 10,000 studies for tests of differences, 2000 for models; takes half an hour.
"""

import dataclasses
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from autd_analysis.basics.exact import wilcoxon_test
from autd_analysis.basics.intervals import Interval, wilson_interval
from autd_analysis.comparisons.numbers import ComparisonResult, planned_comparisons
from autd_analysis.data.trial_table import TrialRow
from autd_analysis.data.trials import Trials, data_frame
from autd_analysis.interactions.numbers import interactions, trends
from autd_analysis.models.cell_model import cell_models
from autd_analysis.models.planned import mixed_model_test
from autd_analysis.order.numbers import order_effects
from autd_analysis.power.model import Counts, PlannedContrast, StudyModel, study_model
from autd_analysis.power.run import Question, power_analysis
from autd_analysis.sensitivity.numbers import other_estimates
from joblib import Parallel, delayed
from marks import fill

from autd_trials.protocol.load import find_protocol, load_protocol

PAGE = Path(__file__).parent / "statistics.md"
CASES = ((0.5, 8), (0.8, 8), (0.95, 8), (0.5, 16), (0.8, 16))
FAST_STUDIES, STUDIES = 10_000, 2000
COMMON_SD, CELL_SD = 1.0, 0.8 / np.sqrt(2)
ALPHA = 0.05
AT = 100.0
"""The planned comparison that is counted: at this modulation frequency in Hz."""

ROUNDING = 1e-9


def main() -> None:
    """Simulate, and replace the tables in the page."""
    studies = int(sys.argv[1]) if len(sys.argv) > 1 else STUDIES
    fast_studies = FAST_STUDIES * studies // STUDIES
    differences = fast_rows(fast_studies) | difference_rows(fast_studies)
    models = model_rows(studies)
    fill(
        PAGE,
        "make_statistics.py",
        {"differences": table(differences, fast_studies), "models": table(models, studies)},
    )


def table(rows: dict[str, list[float]], studies: int) -> str:
    """Return a table of shares, one line a test; those whose interval lies over the level are marked."""
    header = " | ".join(f"{rate:g}, n = {people}" for rate, people in CASES)
    lines = [f"| test | {header} |", "|---|" + "---|" * len(CASES)]
    for name, shares in rows.items():
        lines.append(f"| {name} | {' | '.join(cell(share, studies) for share in shares)} |")
    return "\n".join(lines)


def cell(share: float, studies: int) -> str:
    """Return a share with its Monte Carlo interval; in bold if all of that is over the level."""
    interval = wilson_interval(round(share * studies), studies)
    assert isinstance(interval, Interval)
    text = f"{share:.3f} [{interval.low:.3f}, {interval.high:.3f}]"
    return f"**{text}**" if interval.low > ALPHA else text


def null_model(rate: float) -> StudyModel:
    """Return the paper's design with the same rate everywhere."""
    protocol = load_protocol(find_protocol("chest"))
    cells = study_model(protocol, None, (0, 0)).cells
    return study_model(protocol, dict.fromkeys(cells, rate), (COMMON_SD, CELL_SD))


def fast_rows(studies: int) -> dict[str, list[float]]:
    """Return the shares of the planned tests that are made for many studies at once."""
    shares: dict[str, list[float]] = {"planned: exact sign-flip": [], "planned: paired t": []}
    for rate, people in CASES:
        rows = power_analysis(
            null_model(rate), Question((people,), studies, ("sign_flip", "paired_t")), jobs=-1
        )
        at = [row for row in rows if f"{AT:g}" in row.comparison]
        for values, row in zip(shares.values(), at, strict=True):
            values.append(row.power)
    return shares


def difference_rows(studies: int) -> dict[str, list[float]]:
    """Return the shares of the other tests of participants' differences."""
    shares: dict[str, list[float]] = {}
    for rate, people in CASES:
        model = null_model(rate)
        templates = planned_comparisons(model.rates(simulated(model, people, 0)), model.design)
        work = (delayed(difference_p)(model, people, number, templates) for number in range(studies))
        add_shares(shares, Parallel(n_jobs=-1, batch_size=100)(work))
    return shares


def difference_p(
    model: StudyModel, people: int, number: int, templates: tuple[ComparisonResult, ...]
) -> dict[str, float | None]:
    """Return p of the tests of participants' differences in one simulated study."""
    counts = simulated(model, people, number)
    comparisons = [
        dataclasses.replace(template, differences=tuple(differences(counts, contrast, model.trials)))
        for template, contrast in zip(templates, model.contrasts, strict=True)
    ]
    at = next(result for result in comparisons if dict(result.at)["modulation_hz"] == AT)
    wilcoxon = wilcoxon_test([difference for _, difference in at.differences])
    (interaction,), (trend,) = interactions(comparisons), trends(comparisons)
    return {
        "exact Wilcoxon": wilcoxon.p if wilcoxon else None,
        "interaction, Hotelling": interaction.f_p,
        "interaction, exact sign-flip": interaction.sign_flip_p,
        "trend, paired t": trend.paired_t.p if trend.paired_t else None,
        "trend, exact sign-flip": trend.sign_flip.p if trend.sign_flip else None,
    }


def differences(counts: Counts, contrast: PlannedContrast, trials: int) -> Iterator[tuple[str, Fraction]]:
    """Yield each participant's difference of rates."""
    (first,), (second,) = contrast.first, contrast.second
    for person, felt in enumerate(counts):
        yield f"{person:02d}", Fraction(int(felt[first] - felt[second]), trials)


def model_rows(studies: int) -> dict[str, list[float]]:
    """Return the shares of the models, and of the checks for effects of order."""
    shares: dict[str, list[float]] = {}
    for rate, people in CASES:
        model = null_model(rate)
        work = (delayed(model_p)(model, people, number) for number in range(studies))
        add_shares(shares, Parallel(n_jobs=-1)(work))
    return shares


def add_shares(shares: dict[str, list[float]], found: list[dict[str, float | None]]) -> None:
    """Add to each test's shares in how many studies it finds a difference."""
    for name in found[0]:
        p = [each[name] for each in found]
        rejected = sum(value is not None and value <= ALPHA + ROUNDING for value in p)
        shares.setdefault(name, []).append(rejected / len(found))


def simulated(model: StudyModel, people: int, number: int) -> Counts:
    """Return the counts of one study, shape (participants, cells)."""
    generator = np.random.default_rng([number, people])
    counts: Counts = model.answers(model.people(1, people, generator), generator)[0]
    return counts


def model_p(model: StudyModel, people: int, number: int) -> dict[str, float | None]:
    """Return p of every model in one simulated study; None where it could not be made."""
    counts = simulated(model, people, number)
    rates = model.rates(counts)
    contrast = next(each for each in model.contrasts if dict(each.at)["modulation_hz"] == AT)
    planned = mixed_model_test(rates, contrast.factor, *contrast.levels, contrast.at)
    all_answers = cell_models(rates, model.design)[0]
    effects = {effect.at: effect.p for effect in all_answers.effects}
    others = (each for each in other_estimates(rates, model.design) if each.at == contrast.at)
    return {
        "planned: mixed model at the level, likelihood ratio": planned.p if planned else None,
        "mixed model of all answers, simple effect, Wald": effects.get(contrast.at),
        "mixed model of all answers, interaction, likelihood ratio": all_answers.interaction.p
        if all_answers.interaction
        else None,
        **{each.method: each.wald_p if each.ratio_p is None else each.ratio_p for each in others},
        **dict(order_p(model, counts, np.random.default_rng([number, people, 1]))),
    }


def order_p(
    model: StudyModel, counts: Counts, generator: np.random.Generator
) -> Iterator[tuple[str, float | None]]:
    """Yield p of the checks for effects of order, with the trials of each block in random order."""
    rows = [row for person, felt in enumerate(counts) for row in trial_rows(model, person, felt, generator)]
    trials = Trials(model.design, data_frame(rows, model.design), simulated=True, warnings=(), inputs=())
    for effect in order_effects(trials):
        if effect.name not in ("session", "carry-over"):  # there is one session; carry-over is a slope here
            yield f"order: {effect.name}", effect.p


def trial_rows(
    model: StudyModel, person: int, felt: Counts, generator: np.random.Generator
) -> Iterator[TrialRow]:
    """Yield a person's trials, two blocks whose order alternates from person to person."""
    levels = model.design.factor("clothing").levels
    blocks = levels if person % 2 == 0 else levels[::-1]
    number = 0
    for block, clothing in enumerate(blocks, start=1):
        answers = [
            (cell, answer < count)
            for cell, count in zip(model.cells, felt, strict=True)
            if dict(cell)["clothing"] == clothing
            for answer in range(model.trials)
        ]
        for place in generator.permutation(len(answers)):
            number += 1
            cell, answer = answers[place]
            yield TrialRow(
                participant=f"{person:02d}",
                session="01",
                block=block,
                trial=number,
                attempt=1,
                trial_type="stimulus",
                trial_status="complete",
                felt=bool(answer),
                response_time_s=None,
                levels=dict(cell),
            )


if __name__ == "__main__":
    main()
