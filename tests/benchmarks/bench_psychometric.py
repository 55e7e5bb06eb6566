"""How right psychometric fits are: maxima, mixed models, and the coverage of what is reported.

``python tests/benchmarks/bench_psychometric.py [maxima] [profiles] [mixed] [coverage] [speed]``; all parts
without a name. Maxima are compared with a global search of its own (dense grids, then a pattern search from
the best points, and the closed forms of steps and flat functions), information with numeric Hessians of plain
quadrature, and coverage is counted over simulated studies. ``--sets N`` changes how many sets of a kind.
"""

import argparse
import itertools
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

sys.path.insert(0, str(Path(__file__).parents[2]))

from autd_analysis.psychometric.fit import NOT_AT_REST, fit
from autd_analysis.psychometric.functions import (
    LOGISTIC,
    NORMAL,
    WEIBULL,
    Axis,
    Core,
    predictor_at_threshold,
    psychometric_function,
)
from autd_analysis.psychometric.model import Answers, Model, answers

OCTAVES = Axis(logarithmic=True)
CORES = (NORMAL, LOGISTIC, WEIBULL)
SETS = 300
Array = np.ndarray


def main() -> None:
    """Print the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART")
    parser.add_argument("--sets", type=int, default=SETS)
    options = parser.parse_args()
    for name in options.parts or PARTS:
        PARTS[name](options.sets)


# Harsh kinds of answers


@dataclass(frozen=True)
class Case:
    """Answers of one participant, and how they are fitted."""

    conditions: tuple[Answers, ...]
    model: Model


def table(
    levels: Array,
    felt: Sequence[float] | Array,
    n: Sequence[float] | Array,
    catch: tuple[float, float] = (0, 0),
) -> Answers:
    """Return answers at levels that are given in octaves."""
    rows = [(2.0**x, float(f), float(k)) for x, f, k in zip(levels, felt, n, strict=True)]
    return answers(rows, OCTAVES, catch)


def drawn(
    generator: np.random.Generator,
    levels: Array,
    n: Array,
    *,
    guess: float = 0.0,
    lapse: float = 0.02,
    catch: int = 0,
    core: Core = NORMAL,
) -> Answers:
    """Return answers of somebody with a threshold among the levels or nearby."""
    threshold = generator.uniform(levels[0] - 1, levels[-1] + 1)
    slope = math.exp(generator.normal(-0.7, 1.0))
    p = psychometric_function(
        core, OCTAVES, 2.0**levels, threshold=2.0**threshold, slope=slope, guess=guess, lapse=lapse
    )
    silent = (float(generator.binomial(catch, guess)), float(catch)) if catch else (0.0, 0.0)
    return table(levels, generator.binomial(n, p), n, silent)


def few_levels(g: np.random.Generator, core: Core) -> Case:
    """Return two to four levels with one to six trials."""
    levels = np.sort(g.uniform(0, 5, g.integers(2, 5)))
    return Case(
        (drawn(g, levels, g.integers(1, 7, len(levels))),), Model(core, 0.0, g.choice([0.0, 0.02, 0.1]))
    )


def nearly_all_or_none(g: np.random.Generator, core: Core) -> Case:
    """Return answers that are all the same, but one or two."""
    levels, n = np.arange(5.0), g.integers(3, 12, 5)
    felt = n * g.integers(0, 2)
    for _ in range(g.integers(0, 3)):
        at = g.integers(0, 5)
        felt[at] = np.clip(felt[at] + g.choice([-1, 1]), 0, n[at])
    return Case((table(levels, felt, n),), free(g, core))


def not_rising(g: np.random.Generator, core: Core) -> Case:
    """Return answers that fall, or have nothing to do with the level."""
    count = g.integers(3, 9)
    rates = g.uniform(0, 1, count)
    rates = np.sort(rates)[::-1] if g.random() < 0.5 else rates
    n = g.integers(2, 15, count)
    return Case((table(np.arange(count, dtype=float), g.binomial(n, rates), n),), free(g, core))


def separated(g: np.random.Generator, core: Core) -> Case:
    """Return a step, between two levels or at one, perhaps with a slip."""
    count = int(g.integers(3, 9))
    n, at = g.integers(2, 20, count), g.integers(1, count)
    felt = n * (np.arange(count) >= at)
    if g.random() < 0.5:
        felt[at] = g.integers(0, n[at] + 1)
    if g.random() < 0.5:
        slip = g.integers(0, count)
        felt[slip] = abs(felt[slip] - 1)
    return Case((table(np.sort(g.uniform(0, 5, count)), felt, n),), free(g, core))


def lapsing(g: np.random.Generator, core: Core) -> Case:
    """Return a lapse rate of 20 to 45 %, which is estimated."""
    levels, n = np.arange(7.0), np.full(7, g.integers(6, 30))
    made = drawn(g, levels, n, guess=0.03, lapse=g.uniform(0.2, 0.45))
    return Case((made,), Model(core, g.choice([0.0, 0.03]), "free"))


def two_alternatives(g: np.random.Generator, core: Core) -> Case:
    """Return two alternatives, with a lapse rate that is estimated in half of the sets."""
    levels, n = np.arange(6.0), np.full(6, g.integers(8, 60))
    made = drawn(g, levels, n, guess=0.5, lapse=g.uniform(0, 0.3))
    return Case((made,), Model(core, 0.5, "free" if g.random() < 0.5 else 0.02))


def both_free(g: np.random.Generator, core: Core) -> Case:
    """Return guess and lapse rates that are estimated, with few catch trials or none."""
    levels, n = np.linspace(0, 5, 8), g.integers(4, 20, 8)
    made = drawn(g, levels, n, guess=g.uniform(0, 0.3), lapse=g.uniform(0, 0.3), catch=int(g.integers(0, 20)))
    return Case((made,), Model(core, "free", "free"))


def adaptive(g: np.random.Generator, core: Core) -> Case:
    """Return thirty different levels with a trial each."""
    levels = np.sort(g.normal(2.5, 1, 30))
    return Case((drawn(g, levels, np.ones(30, int), guess=0.05),), free(g, core))


def many_trials(g: np.random.Generator, core: Core) -> Case:
    """Return thousands of trials of another form than is fitted: hardly any freedom, and misfit."""
    levels, n = np.linspace(0, 5, 6), g.integers(500, 3000, 6)
    made = drawn(g, levels, n, guess=0.1, lapse=0.05, core=CORES[g.integers(3)])
    return Case((made,), Model(core, g.choice([0.0, 0.1]), "free"))


def shared(g: np.random.Generator, core: Core) -> Case:
    """Return two conditions that share a guess rate, and in half of the sets a lapse rate."""
    levels, n = np.arange(5.0), np.full(5, g.integers(3, 15))
    guess = g.uniform(0, 0.2)
    pair = tuple(drawn(g, levels, n, guess=guess, catch=int(g.integers(0, 12))) for _ in range(2))
    return Case(pair, Model(core, "shared", "shared" if g.random() < 0.5 else 0.02))


def free(g: np.random.Generator, core: Core) -> Model:
    """Return a model with rates that are fixed or estimated."""
    rates = (0.0, 0.05, 0.25, "free"), (0.0, 0.02, 0.1, "free")
    guess, lapse = (each[g.integers(4)] for each in rates)
    return Model(core, guess, lapse)  # type: ignore[arg-type]


KINDS: dict[str, Callable[[np.random.Generator, Core], Case]] = {
    kind.__name__: kind
    for kind in (
        few_levels,
        nearly_all_or_none,
        not_rising,
        separated,
        lapsing,
        two_alternatives,
        both_free,
        adaptive,
        many_trials,
        shared,
    )
}


# The global search


def highest_log_likelihood(case: Case, generator: np.random.Generator) -> float:
    """Return the largest log likelihood that a search without any of the fit's code finds."""
    search = Search(case)
    starts = search.starts()
    best = search.improved(starts, generator)
    return max(float(best.max()), search.closed_forms())


class Search:
    """The likelihood of a case by threshold and log steepness of each condition, guess, and lapse rate."""

    def __init__(self, case: Case) -> None:
        self.case = case
        every = np.log2(np.concatenate([each.x for each in case.conditions]))
        self.low, self.reach = every.min(), max(float(np.ptp(every)), 1e-9)
        self.places = [(np.log2(each.x) - self.low) / self.reach for each in case.conditions]
        self.rates = [isinstance(rate, str) for rate in (case.model.guess, case.model.lapse)]
        fixed = [0.0 if isinstance(rate, str) else rate for rate in (case.model.guess, case.model.lapse)]
        self.highest = min(0.4, 0.9 - fixed[1]), min(0.5, 0.9 - fixed[0])
        self.fixed = fixed

    def log_likelihood(self, points: Array) -> Array:
        """Return values of points (points, 2 conditions + 2)."""
        core, total = self.case.model.core, np.zeros(len(points))
        guess, lapse = points[:, -2, None], points[:, -1, None]
        for number, (each, place) in enumerate(zip(self.case.conditions, self.places, strict=True)):
            threshold, steepness = points[:, 2 * number, None], np.exp(points[:, 2 * number + 1, None])
            below, above = core.distribution(predictor_at_threshold(core) + steepness * (place - threshold))
            p = np.maximum(guess + (1 - guess - lapse) * below, 1e-300)
            not_p = np.maximum(lapse + (1 - guess - lapse) * above, 1e-300)
            total += (each.felt * np.log(p) + (each.n - each.felt) * np.log(not_p)).sum(axis=1)
            if self.rates[0]:
                total += each.catch_felt * np.log(np.maximum(guess[:, 0], 1e-300))
                total += (each.catch_n - each.catch_felt) * np.log1p(-guess[:, 0])
        return total

    def starts(self, most: int = 40) -> Array:
        """Return the best points of dense grids, conditions taken one by one at given rates."""
        thresholds = np.concatenate([np.linspace(-1, 2, 61), [-30, -8, -4, -2, 3, 5, 9, 30], *self.places])
        steepnesses = np.linspace(math.log(0.005), math.log(2000), 26)
        grid = np.stack(np.meshgrid(thresholds, steepnesses, indexing="ij"), axis=2).reshape(-1, 2)
        tried = [
            np.linspace(0, highest, 6) if estimated else [fixed]
            for estimated, highest, fixed in zip(self.rates, self.highest, self.fixed, strict=True)
        ]
        points = np.concatenate([self._of_rates(grid, *rates) for rates in itertools.product(*tried)])
        return points[np.argsort(-self.log_likelihood(points))[:most]]

    def _of_rates(self, grid: Array, guess: float, lapse: float, each: int = 8) -> Array:
        count = len(self.case.conditions)
        found = np.tile([*[0.5, 0.0] * count, guess, lapse], (each, 1))
        for number in range(count):
            tried = np.tile(found[0], (len(grid), 1))
            tried[:, 2 * number : 2 * number + 2] = grid
            best = np.argsort(-self.log_likelihood(tried))[: each * 25 : 25]
            found[:, 2 * number : 2 * number + 2] = grid[best]
        return found

    def improved(self, points: Array, generator: np.random.Generator, steps: int = 400) -> Array:
        """Return log likelihoods after a pattern search along random directions with shrinking steps."""
        best = self.log_likelihood(points)
        free = np.array([True] * (points.shape[1] - 2) + self.rates)
        size = np.full(len(points), 0.3)
        low = np.array([-np.inf] * (points.shape[1] - 2) + [0.0, 0.0])
        high = np.array([25.0, 12.0] * len(self.case.conditions) + list(self.highest))
        for _ in range(steps):
            direction = generator.normal(size=points.shape) * free
            direction *= generator.random(points.shape) < 0.6
            better = np.zeros(len(points), bool)
            for sign in (1, -1):
                moved = points + sign * size[:, None] * direction
                tried = np.where(free, np.clip(moved, low, high), points)
                value = self.log_likelihood(tried)
                gained = value > best
                points, best = np.where(gained[:, None], tried, points), np.where(gained, value, best)
                better |= gained
            size *= np.where(better, 1.5, 0.85)
            size = np.maximum(size, 1e-6)
        return best

    def closed_forms(self) -> float:
        """Return the likeliest step or flat function of a single condition; rates are clipped shares."""
        if len(self.case.conditions) > 1:
            return -math.inf
        (each,) = self.case.conditions
        catch = (each.catch_felt, each.catch_n) if self.rates[0] else (0.0, 0.0)
        # a flat function may have any rate between, while catch trials tell of the guess rate
        guess = min(catch[0] / max(catch[1], 1), self.highest[0]) if self.rates[0] else self.fixed[0]
        rate = each.felt.sum() / each.n.sum()
        best = -math.inf
        for lapse in (0.0, 1 - rate) if self.rates[1] else (self.fixed[1],):
            share = min(max(rate, guess), 1 - min(lapse, self.highest[1]))
            flat = binomial(each.felt.sum(), each.n.sum(), share) + binomial(*catch, guess)
            best = max(best, flat)
        count = len(each.x)
        for first in range(count + 1):
            for inside in (False, True):
                after = first + inside
                if after > count:
                    continue
                lower = each.felt[:first].sum() + catch[0], each.n[:first].sum() + catch[1]
                upper = (each.n[after:] - each.felt[after:]).sum(), each.n[after:].sum()
                guess = min(lower[0] / max(lower[1], 1), self.highest[0]) if self.rates[0] else self.fixed[0]
                lapse = min(upper[0] / max(upper[1], 1), self.highest[1]) if self.rates[1] else self.fixed[1]
                total = binomial(*lower, guess) + binomial(*upper, lapse)
                if not self.rates[0] and catch[1] == 0 and first == 0:
                    total = binomial(*upper, lapse)
                if inside:
                    share = np.clip(each.felt[first] / each.n[first], guess, 1 - lapse)
                    total += binomial(each.felt[first], each.n[first], float(share))
                best = max(best, total)
        return best


def binomial(hits: float, n: float, p: float) -> float:
    """Return a log likelihood without the coefficient."""
    return float(
        (hits * math.log(max(p, 1e-300)) if hits else 0)
        + ((n - hits) * math.log(max(1 - p, 1e-300)) if n > hits else 0)
    )


def maxima(sets: int) -> None:
    """Compare the fits' log likelihoods with the global search, kind by kind."""
    print(f"Maxima of {sets} random sets of each kind, against a global search:")
    for name, kind in KINDS.items():
        found = Parallel(n_jobs=2)(delayed(shortfall)(kind, seed) for seed in range(sets))
        short = np.array([each for each, _ in found])
        restless = sum(restless for _, restless in found)
        print(
            f"  {name:<20} short by over 1e-3: {int((short > 1e-3).sum()):>3}, by over 1e-5: "
            f"{int((short > 1e-5).sum()):>3}, most {max(short.max(), 0):.1e}; the search short by over 1e-3: "
            f"{int((short < -1e-3).sum()):>3}; not at rest: {restless}"
            f"{'; worst seeds ' + str(np.argsort(-short)[:4].tolist()) if short.max() > 1e-5 else ''}",
            flush=True,
        )


def shortfall(kind: Callable[[np.random.Generator, Core], Case], seed: int) -> tuple[float, bool]:
    """Return by how much the fit falls short of the global search, and whether it says it is not at rest."""
    generator = np.random.default_rng([seed, *map(ord, kind.__name__)])
    case = kind(generator, CORES[seed % 3])
    fitted = fit(case.conditions, case.model, OCTAVES)
    reference = highest_log_likelihood(case, generator)
    return reference - fitted.log_likelihood, any(NOT_AT_REST in each.notes for each in fitted.curves)


PARTS: dict[str, Callable[[int], None]] = {"maxima": maxima}

if __name__ == "__main__":
    main()
