"""Writes docs/paper.md: the paper's study simulated, and what its one p value can be. ``make paper``."""

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from autd_analysis.models.planned import mixed_model_test
from autd_analysis.power.fast import paired_t_p, sign_flip_p
from autd_analysis.power.model import Counts, PlannedContrast, StudyModel, study_model
from autd_analysis.sensitivity.pooled import chi_squared_p
from joblib import Parallel, delayed
from marks import fill
from numpy.typing import NDArray
from scipy import stats

from autd_trials.protocol.load import find_protocol, load_protocol

PAGE = Path(__file__).parent / "paper.md"
PAPER_P = 4.2e-3
"""Section 5.2: inner against inner + outer at 100 Hz; the test is not named."""

PARTICIPANTS, TRIALS = 8, 10
FREQUENCIES_HZ, CLOTHING = (25.0, 50.0, 100.0), ("inner", "inner_outer")
STUDIES, MODEL_STUDIES = 20_000, 1000
SEED = 1

Array = NDArray[np.float64]


def main() -> None:
    """Compute everything and write it into the page."""
    model = study_model(load_protocol(find_protocol("chest")), None, (0, 0))
    generator = np.random.default_rng(SEED)
    counts = model.answers(model.people(STUDIES, PARTICIPANTS, generator), generator)
    contrast = next(each for each in model.contrasts if dict(each.at) == {"modulation_hz": 100.0})
    contents = {
        "rates": f"{rates_table(model, counts)}\n\n{best_at_100(model, counts)}",
        "attainable": attainable_table(),
        "p": p_table(model, contrast, counts),
    }
    fill(PAGE, "make_paper.py", contents)


def rates_table(model: StudyModel, counts: Counts) -> str:
    """Return mean rates by frequency and clothing."""
    means = counts.mean(axis=(0, 1)) / TRIALS
    lines = ["| modulation frequency | inner | inner + outer |", "|---|---|---|"]
    for hz in FREQUENCIES_HZ:
        rates = [means[cell_of(model, hz, clothing)] for clothing in CLOTHING]
        lines.append(f"| {hz:g} Hz | {rates[0]:.3f} | {rates[1]:.3f} |")
    return "\n".join(lines)


def best_at_100(model: StudyModel, counts: Counts) -> str:
    """Return in how many studies 100 Hz has the highest mean rate in both clothings."""
    means = counts.mean(axis=1)
    best = np.ones(len(counts), bool)
    for clothing, hz in itertools.product(CLOTHING, FREQUENCIES_HZ[:-1]):
        best &= means[:, cell_of(model, 100.0, clothing)] > means[:, cell_of(model, hz, clothing)]
    return (
        f"Of {len(counts):,} studies of {PARTICIPANTS} participants {best.mean():.1%} have the highest mean "
        'rate at 100 Hz in both clothings; the paper found that "in all the cases".'
    )


def cell_of(model: StudyModel, hz: float, clothing: str) -> int:
    """Return the number of a condition's cell."""
    wanted = {("modulation_hz", hz), ("clothing", clothing)}
    return next(number for number, cell in enumerate(model.cells) if set(cell) == wanted)


def attainable_table() -> str:
    """Return which tests can give the paper's p, and what that would need."""
    steps = 2**PARTICIPANTS
    exact = "can" if any(gives_papers_p(count / steps) for count in range(steps + 1)) else "**cannot**"
    drops = drops_of_t()
    t = float(stats.t.isf(PAPER_P / 2, PARTICIPANTS - 1))
    dz = t / math.sqrt(PARTICIPANTS)
    lines = [
        "| test | 4.2e-3 | what it needs |",
        "|---|---|---|",
        f"| exact sign-flip, exact Wilcoxon | {exact} | p is a multiple of 1/{steps}; the smallest is "
        f"{2 / steps:.4f} |",
        f"| the same, one-sided | {exact} | the smallest is {1 / steps:.4f}, then {2 / steps:.4f} |",
        f"| paired t on rates | can | t({PARTICIPANTS - 1}) = {t:.2f}, dz = {dz:.2f}: "
        f"a mean drop of at least {drops.min():.3f} ({len(drops):,} sets of differences in tenths) |",
    ]
    for name, test in POOLED_TESTS.items():
        drops = pooled_drops(test)
        size = f"{drops.min():.3f}" if np.ptp(drops) == 0 else f"{drops.min():.3f} to {drops.max():.3f}"
        lines.append(f"| {name} | can | a drop of {size} ({len(drops)} pairs of counts) |")
    lines.append("| CMH, GEE, mixed models | can | p takes any value; it depends on all answers |")
    return "\n".join(lines)


def drops_of_t() -> Array:
    """Return the mean drops of all sets of eight differences in tenths whose paired t test gives the p."""
    sets = itertools.combinations_with_replacement(range(-TRIALS, TRIALS + 1), PARTICIPANTS)
    differences = np.fromiter(itertools.chain.from_iterable(sets), np.int8).reshape(-1, PARTICIPANTS)
    differences = differences[differences.sum(axis=1, dtype=int) > 0]
    p = np.concatenate([paired_t_p(part.astype(np.int64)) for part in np.array_split(differences, 20)])
    found: Array = differences[gives_papers_p(p)].mean(axis=1) / TRIALS
    return found


def pooled_drops(test: Callable[[int, int], float]) -> Array:
    """Return the drops at which a test of all answers gives the p."""
    trials = PARTICIPANTS * TRIALS
    pairs = itertools.combinations(range(trials + 1), 2)
    return np.array([(more - less) / trials for less, more in pairs if gives_papers_p(test(more, less))])


def chi_squared(more: int, less: int) -> float:
    """Return p without continuity correction."""
    trials = PARTICIPANTS * TRIALS
    return chi_squared_p(((more, trials), (less, trials))) or 1.0


def chi_squared_corrected(more: int, less: int) -> float:
    """Return p with Yates' correction."""
    trials = PARTICIPANTS * TRIALS
    if more + less in (0, 2 * trials):
        return 1.0
    table = np.array([[more, trials - more], [less, trials - less]])
    return float(stats.chi2_contingency(table, correction=True).pvalue)


def fisher(more: int, less: int) -> float:
    """Return Fisher's exact p."""
    trials = PARTICIPANTS * TRIALS
    return float(stats.fisher_exact(np.array([[more, trials - more], [less, trials - less]])).pvalue)


POOLED_TESTS = {
    "pooled chi-squared": chi_squared,
    "pooled chi-squared, Yates": chi_squared_corrected,
    "pooled Fisher": fisher,
}


def gives_papers_p(p: Any) -> Any:
    """Return whether p, a number or an array, is the paper's when rounded to two digits."""
    return (p >= 4.15e-3) & (p < 4.25e-3)


def p_table(model: StudyModel, contrast: PlannedContrast, counts: Counts) -> str:
    """Return quartiles of p, and how often it is at most .05, of every test."""
    (first,), (second,) = contrast.first, contrast.second
    differences = counts[..., first] - counts[..., second]
    sums = counts.sum(axis=1)
    rows = {
        "exact sign-flip": sign_flip_p(differences, TRIALS),
        "paired t": np.nan_to_num(paired_t_p(differences), nan=1.0),
        "mixed model, likelihood ratio": mixed_model_p(model, contrast, counts[:MODEL_STUDIES]),
        "pooled chi-squared": np.array([chi_squared(a, b) for a, b in sums[:, [first, second]].tolist()]),
    }
    lines = ["| test | lower quartile | median | upper quartile | p at most .05 |", "|---|---|---|---|---|"]
    for name, p in rows.items():
        quartiles = " | ".join(f"{q:.2g}" for q in np.quantile(p, [0.25, 0.5, 0.75]))
        lines.append(f"| {name} | {quartiles} | {(p <= 0.05 + 1e-9).mean():.1%} |")
    return "\n".join(lines)


def mixed_model_p(model: StudyModel, contrast: PlannedContrast, counts: Counts) -> Array:
    """Return p of the planned mixed-model test of each study; 1 where it could not be made."""
    work = (delayed(one_mixed_model_p)(model, contrast, study) for study in counts)
    return np.array(Parallel(n_jobs=-1)(work))


def one_mixed_model_p(model: StudyModel, contrast: PlannedContrast, counts: Counts) -> float:
    """Return p of one study."""
    test = mixed_model_test(model.rates(counts), contrast.factor, *contrast.levels, contrast.at)
    return 1.0 if test is None else test.p


if __name__ == "__main__":
    main()
