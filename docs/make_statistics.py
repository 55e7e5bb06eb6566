"""Writes the tables of docs/statistics.md: how often tests find what is not there. ``make statistics``.

Studies of the paper's design are simulated in which all conditions are felt equally often; people differ by a
standard deviation of 1 logit, and by 0.57 in each condition, so that the difference of two conditions varies
over people by 0.8 logits. 10,000 studies for the fast tests, 1000 for the others; takes a quarter of an hour.
"""

import re
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from analysis.comparisons import planned_comparisons
from analysis.interaction import interactions, trends
from analysis.intervals import Interval, wilson_interval
from analysis.models.cell_model import cell_models
from analysis.models.other_models import other_estimates
from analysis.order_effects import order_effects
from analysis.power.model import Counts, StudyModel, study_model
from analysis.power.run import Question, power_analysis
from analysis.rates import ParticipantRate
from analysis.trial_table import TrialRow
from analysis.trials import Trials, data_frame
from autd_trials.protocol.load import find_protocol, load_protocol

PAGE = Path(__file__).parent / "statistics.md"
CASES = ((0.5, 8), (0.8, 8), (0.95, 8), (0.5, 16), (0.8, 16))
FAST_STUDIES, STUDIES = 10_000, 1000
COMMON_SD, CELL_SD = 1.0, 0.8 / np.sqrt(2)
ALPHA = 0.05
AT = 100.0
"""The planned comparison that is counted: at this modulation frequency in Hz."""

ROUNDING = 1e-9


def main() -> None:
    """Simulate, and replace the tables in the page."""
    studies = int(sys.argv[1]) if len(sys.argv) > 1 else STUDIES
    fast_studies = FAST_STUDIES * studies // STUDIES
    text = PAGE.read_text(encoding="utf-8")
    text = replaced(text, "fast", table(fast_rows(fast_studies), fast_studies))
    text = replaced(text, "all", table(all_rows(studies), studies))
    PAGE.write_text(text, encoding="utf-8")


def replaced(text: str, name: str, content: str) -> str:
    """Return the text with what stands between a pair of marks replaced."""
    mark = f"<!-- made by docs/make_statistics.py: {name} -->"
    pattern = re.compile(f"{re.escape(mark)}.*?<!-- end -->", re.DOTALL)
    assert pattern.search(text), mark
    return pattern.sub(lambda _: f"{mark}\n\n{content}\n<!-- end -->", text)


def table(rows: dict[str, list[float]], studies: int) -> str:
    """Return a table of shares, one line a test; those whose interval lies over the level are marked."""
    header = " | ".join(f"{rate:g}, n = {people}" for rate, people in CASES)
    lines = [f"| test | {header} |", "|---|" + "---|" * len(CASES)]
    for name, shares in rows.items():
        lines.append(f"| {name} | {' | '.join(cell(share, studies) for share in shares)} |")
    return "\n".join(lines) + "\n"


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
    """Return the shares of the tests that are made for many studies at once."""
    shares: dict[str, list[float]] = {"exact sign-flip": [], "paired t": []}
    for rate, people in CASES:
        rows = power_analysis(
            null_model(rate), Question((people,), studies, ("sign_flip", "paired_t")), jobs=-1
        )
        at = [row for row in rows if f"{AT:g}" in row.comparison]
        for values, row in zip(shares.values(), at, strict=True):
            values.append(row.power)
    return shares


def all_rows(studies: int) -> dict[str, list[float]]:
    """Return the shares of all tests of the default analysis."""
    shares: dict[str, list[float]] = {}
    for rate, people in CASES:
        model = null_model(rate)
        work = (delayed(p_values)(model, people, number) for number in range(studies))
        found = list(Parallel(n_jobs=-1)(work))
        for name in found[0]:
            p = [each[name] for each in found]
            rejected = sum(value is not None and value <= ALPHA + ROUNDING for value in p)
            shares.setdefault(name, []).append(rejected / studies)
    return shares


def p_values(model: StudyModel, people: int, number: int) -> dict[str, float | None]:
    """Return p of every test in one simulated study; None where it could not be made."""
    generator = np.random.default_rng([number, people])
    counts = model.answers(model.people(1, people, generator), generator)[0]
    rates = study_rates(model, counts)
    comparisons = planned_comparisons(rates, model.design)
    at = next(result for result in comparisons if dict(result.at).get("modulation_hz") == AT)
    (interaction,), (trend,) = interactions(comparisons), trends(comparisons)
    logit_model = cell_models(rates, model.design)[0]
    others = {each.method: each for each in other_estimates(rates, model.design) if each.at == at.at}
    effects = {effect.at: effect.p for effect in logit_model.effects}
    return {
        "exact sign-flip": at.sign_flip.p if at.sign_flip else None,
        "paired t": at.paired_t.p if at.paired_t else None,
        "exact Wilcoxon": at.wilcoxon.p if at.wilcoxon else None,
        "mixed model at the level, likelihood ratio (the planned test)": at.mixed_model.p
        if at.mixed_model
        else None,
        "interaction, Hotelling": interaction.f_p,
        "interaction, sign-flip": interaction.sign_flip_p,
        "trend, paired t": trend.paired_t.p if trend.paired_t else None,
        "mixed model of all answers, simple effect, Wald": effects.get(at.at),
        "mixed model of all answers, interaction, likelihood ratio": logit_model.interaction.p
        if logit_model.interaction
        else None,
        **{method: each.ratio_p or each.wald_p for method, each in others.items()},
        **dict(order_p(model, counts, generator)),
    }


def study_rates(model: StudyModel, counts: Counts) -> list[ParticipantRate]:
    """Return the rates of one study's counts, shape (participants, cells)."""
    return [
        ParticipantRate(
            f"{person:02d}", cell, int(felt), model.trials, Fraction(int(felt), model.trials), None
        )
        for person, row in enumerate(counts)
        for cell, felt in zip(model.cells, row, strict=True)
    ]


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
