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
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

sys.path.insert(0, str(Path(__file__).parents[2]))

from autd_analysis.models.glmm import fit_glmm
from autd_analysis.models.marginal import BinomialRows
from autd_analysis.psychometric.fit import NOT_AT_REST, fit
from autd_analysis.psychometric.functions import (
    LOGISTIC,
    NORMAL,
    WEIBULL,
    Axis,
    Core,
    predictor_at_threshold,
    psychometric_function,
    slope_per_steepness,
)
from autd_analysis.psychometric.hierarchical import KnownRates, mean_threshold, mixed_curve
from autd_analysis.psychometric.intervals import OpenInterval, profile_intervals
from autd_analysis.psychometric.model import Answers, Model, answers
from autd_analysis.psychometric.resampling import resample

OCTAVES = Axis(logarithmic=True)
CORES = (NORMAL, LOGISTIC, WEIBULL)
SETS = 300
Array = np.ndarray


def main() -> None:
    """Print the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART")
    parser.add_argument("--sets", type=int, default=SETS)
    parser.add_argument("--kinds", help="only kinds with this in their name", default="")
    options = parser.parse_args()
    for name in options.parts or PARTS:
        PARTS[name](options.sets, options.kinds)


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

    def improved(
        self, points: Array, generator: np.random.Generator, steps: int = 400, given: int | None = None
    ) -> Array:
        """Return log likelihoods after a pattern search along random directions with shrinking steps.

        One of the parameters may be given.
        """
        best = self.log_likelihood(points)
        free = np.array([True] * (points.shape[1] - 2) + self.rates)
        if given is not None:
            free[given] = False
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

    def coordinate(self, which: int, value: float) -> float:
        """Return the search's coordinate of a threshold (0), or of a slope (1)."""
        if which == 0:
            return float((math.log2(value) - self.low) / self.reach)
        return math.log(value * self.reach / slope_per_steepness(self.case.model.core))

    def best_with(self, which: int, value: float, generator: np.random.Generator) -> float:
        """Return the largest log likelihood where the first threshold or log steepness is given."""
        points = self.starts(most=2000)
        points[:, which] = value
        if which == 0:  # so steep that F is intermediate at the nearest level alone, or gentler
            points[:, 1] = generator.uniform(-5, 12, len(points))
        points = points[np.argsort(-self.log_likelihood(points))[:20]]
        return float(self.improved(points, generator, 120, given=which).max())

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


def maxima(sets: int, kinds: str) -> None:
    """Compare the fits' log likelihoods with the global search, kind by kind."""
    print(f"Maxima of {sets} random sets of each kind, against a global search:")
    for name, kind in KINDS.items():
        if kinds not in name:
            continue
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


# Profiles


def profiles(sets: int, kinds: str) -> None:
    """Compare the ends of profile intervals with searches for the best function that has a value beyond.

    What is inside was reached by the fit itself; the question is whether it missed anything outside.
    """
    print(f"Profile intervals of {sets} random sets of each kind, against searches beyond their ends:")
    for name, kind in KINDS.items():
        if kinds not in name:
            continue
        found = Parallel(n_jobs=2)(delayed(wrong_ends)(kind, seed) for seed in range(sets))
        wrong = [(seed, *each) for seed, (_, every) in enumerate(found) for each in every]
        print(
            f"  {name:<20} ends {sum(count for count, _ in found)}, wrong {len(wrong)}"
            f"{'; ' + str(wrong[:4]) if wrong else ''}",
            flush=True,
        )


def wrong_ends(kind: Callable[[np.random.Generator, Core], Case], seed: int) -> tuple[int, list[Any]]:
    """Return how many ends of intervals there are, and which are wrong with what is lost there."""
    generator = np.random.default_rng([seed, *map(ord, kind.__name__)])
    case = kind(generator, CORES[seed % 3])
    fitted = fit(case.conditions, case.model, OCTAVES)
    search = Search(case)
    intervals = profile_intervals(fitted)[0]
    ends, wrong = 0, []
    for which, interval in enumerate((intervals.threshold, intervals.slope)):
        if interval is None:
            continue
        for side, end in ((-1, interval.low), (1, interval.high)):
            if end is None or end == 0:
                continue
            ends += 1
            at = search.coordinate(which, end)
            beyond = at + side * np.array([0.01, 0.04, 0.1, 0.2, 0.4, 0.8, 1.6, 3.0, 6.0])
            lost = fitted.log_likelihood - max(
                search.best_with(which, each, generator) for each in beyond if which == 0 or abs(each) < 9
            )
            if lost < 1.92 - 0.05:
                wrong.append((("threshold", "slope")[which], side, round(lost, 3)))
    return ends, wrong


# Mixed models

_EVEN = np.linspace(-1, 1, 61)


@dataclass(frozen=True)
class Study:
    """Participants' answers at the same levels, in octaves about their middle, and their known rates."""

    levels: Array
    felt: Array
    n: Array
    guess: Array
    lapse: Array
    core: Core

    def log_likelihood(self, parameters: Array, region: Array | None = None) -> float:
        """Return the marginal log likelihood by plain sums over a fine grid of random effects.

        The grid covers each participant's posterior, or the `region` of another place.
        """
        logs, cell = self._on_grid(parameters, self.region(parameters) if region is None else region)
        largest = logs.max(axis=1)
        sums = largest + np.log(np.exp(logs - largest[:, None]).sum(axis=1))
        return float((sums + np.log(cell)).sum())

    def region(self, parameters: Array) -> Array:
        """Return where each participant's posterior lies: centres and half widths, (people, 2, 2)."""
        region = np.tile([[0.0, 6.5], [0.0, 6.5]], (len(self.felt), 1, 1))
        for _ in range(2):
            logs, _ = self._on_grid(parameters, region)
            weights = np.exp(logs - logs.max(axis=1, keepdims=True))
            weights /= weights.sum(axis=1, keepdims=True)
            places = self._places(region)
            means = [(weights * each).sum(axis=1) for each in places]
            spreads = [
                np.sqrt((weights * (each - mean[:, None]) ** 2).sum(axis=1) + 1e-4)
                for each, mean in zip(places, means, strict=True)
            ]
            region = np.stack([np.array(means).T, 8 * np.array(spreads).T], axis=2)
        return region

    def _places(self, region: Array) -> tuple[Array, Array]:
        u, v = (each.ravel() for each in np.meshgrid(_EVEN, _EVEN, indexing="ij"))
        centre, half_width = region[..., 0, None], region[..., 1, None]
        return centre[:, 0] + half_width[:, 0] * u, centre[:, 1] + half_width[:, 1] * v

    def _on_grid(self, parameters: Array, region: Array) -> tuple[Array, Array]:
        """Return log densities at the nodes, (people, nodes), and the areas of cells, (people,)."""
        u, v = self._places(region)
        a, b, factor_a, factor_ab, factor_b = parameters
        intercept, steepness = a + factor_a * u, b + factor_ab * u + factor_b * v
        guess, lapse = self.guess[:, None], self.lapse[:, None]
        logs = -0.5 * (u**2 + v**2) - math.log(2 * math.pi)
        for place, felt, n in zip(self.levels, self.felt.T, self.n.T, strict=True):
            below, above = self.core.distribution(intercept + steepness * place)
            p = np.maximum(guess + (1 - guess - lapse) * below, 1e-300)
            not_p = np.maximum(lapse + (1 - guess - lapse) * above, 1e-300)
            logs += felt[:, None] * np.log(p) + (n - felt)[:, None] * np.log(not_p)
        return logs, region[:, :, 1].prod(axis=1) * (_EVEN[1] - _EVEN[0]) ** 2

    def rows(self) -> BinomialRows:
        """Return the same for the product's mixed model."""
        people, count = self.felt.shape
        columns = np.tile(np.column_stack([np.ones(count), self.levels]), (people, 1))
        participant = np.repeat(np.arange(people), count)
        return BinomialRows(self.felt.ravel(), self.n.ravel(), columns, columns, participant)


def study(
    generator: np.random.Generator,
    core: Core,
    *,
    people: int = 6,
    trials: int = 12,
    levels: int = 5,
    guess: tuple[float, float] = (0.0, 0.05),
    lapse: tuple[float, float] = (0.02, 0.02),
    spread: float = 0.6,
) -> Study:
    """Return a study whose thresholds differ by so many octaves and whose log slopes half as much."""
    x = np.linspace(-2, 2, levels)
    guesses, lapses = generator.uniform(*guess, people), generator.uniform(*lapse, people)
    felt = np.empty((people, levels))
    for person in range(people):
        p = psychometric_function(
            core, Axis(logarithmic=False), x,
            threshold=generator.normal(generator.uniform(-0.5, 0.5), spread),
            slope=0.5 * math.exp(generator.normal(0, spread / 2)),
            guess=guesses[person], lapse=lapses[person],
        )  # fmt: skip
        felt[person] = generator.binomial(trials, p)
    return Study(x, felt, np.full(felt.shape, float(trials)), guesses, lapses, core)


STUDIES: dict[str, dict[str, Any]] = {
    "usual": {},
    "known lapses of .02": {"guess": (0.0, 0.0)},
    "high, differing rates": {"guess": (0.0, 0.45), "lapse": (0.0, 0.3)},
    "two alternatives": {"guess": (0.5, 0.5), "trials": 30},
    "people alike": {"spread": 0.0},
    "people very different": {"spread": 1.5},
    "few trials": {"people": 10, "trials": 3},
    "three levels": {"levels": 3, "trials": 8},
}


def mixed(sets: int, kinds: str) -> None:
    """Compare the mixed model's standard errors with numeric Hessians, and its maxima with other searches."""
    print(f"Mixed models of {sets} random studies of each kind, against plain sums on a grid:")
    for name, made in STUDIES.items():
        if kinds not in name:
            continue
        found = Parallel(n_jobs=2)(delayed(agreement)(name, made, seed) for seed in range(sets))
        fits = [each for each in found if each is not None]
        error, short = (np.array([each[place] for each in fits]) for place in range(2))
        print(
            f"  {name:<22} fitted {len(fits)}, standard errors off by over 2 %: {int((error > 0.02).sum())}, "
            f"by over .5 %: {int((error > 0.005).sum())}, median {np.median(error):.0e}; a likelier place by "
            f"over .01: {int((short > 0.01).sum())} of {int((~np.isnan(short)).sum())} searched"
            f"{'; worst seeds ' + str(np.argsort(-error)[:3].tolist()) if error.max() > 0.005 else ''}",
            flush=True,
        )


def agreement(name: str, made: dict[str, Any], seed: int) -> tuple[float, float] | None:
    """Return how far standard errors are off, and by how much another place is likelier."""
    from scipy.optimize import minimize

    generator = np.random.default_rng([seed, *map(ord, name)])
    answered = study(generator, CORES[seed % 3], **made)
    link = KnownRates(answered.core, answered.guess, answered.lapse)
    fitted = fit_glmm(answered.rows(), link=link)
    if not fitted.converged or fitted.coefficients[1] <= 0:
        return None
    at = np.concatenate([fitted.coefficients, fitted.factor[np.tril_indices(2)]])
    region = answered.region(at)
    numeric = np.linalg.pinv(-hessian(lambda x: answered.log_likelihood(x, region), at))[:2, :2]
    ours, its = np.sqrt(np.diag(fitted.covariance)), np.sqrt(np.abs(np.diag(numeric)))
    error = float(np.abs(ours / its - 1).max())
    if seed % 5:
        return error, math.nan

    def loss(x: Array) -> float:
        return -answered.log_likelihood(x)

    tops = [
        -float(minimize(loss, start, method="L-BFGS-B").fun)
        for start in (at, np.array([0.0, 1.0, 0.5, 0.0, 0.2]), np.array([0.0, 2.0, 1.5, 0.3, 1.0]))
    ]
    return error, max(tops) - answered.log_likelihood(at)


def hessian(function: Callable[[Array], float], at: Array, step: float = 2e-3) -> Array:
    """Return second differences."""
    moves, size = step * np.eye(len(at)), len(at)
    found = np.empty((size, size))
    for i, j in itertools.combinations_with_replacement(range(size), 2):
        signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
        corners = [function(at + a * moves[i] + b * moves[j]) for a, b in signs]
        found[i, j] = found[j, i] = (corners[0] - corners[1] - corners[2] + corners[3]) / (4 * step**2)
    return found


# Coverage


@dataclass(frozen=True)
class Task:
    """A participant's task: what is true, and how it is fitted."""

    guess: float
    lapse: float
    model: Model
    trials: int
    catch: int = 0


TASKS = {
    "yes/no": Task(0.0, 0.02, Model(NORMAL, 0.0, 0.02), 20),
    "yes/no, few trials": Task(0.0, 0.02, Model(NORMAL, 0.0, 0.02), 8),
    "catch trials, guesses": Task(0.1, 0.02, Model(NORMAL, "shared", 0.02), 20, 40),
    "two alternatives": Task(0.5, 0.02, Model(NORMAL, 0.5, 0.02), 40),
    "lapses of .3, free": Task(0.0, 0.3, Model(NORMAL, 0.0, "free"), 20),
    "two alternatives, lapses": Task(0.5, 0.15, Model(WEIBULL, 0.5, "free"), 40),
}


def coverage(sets: int, kinds: str) -> None:
    """Count how often 95 % intervals hold the truth, of participants and of the mixed model."""
    print(f"Share of {sets} studies whose 95 % interval holds the truth (profile; bootstrap):")
    for name, task in TASKS.items():
        if kinds not in name:
            continue
        held = np.array(Parallel(n_jobs=2)(delayed(participant_held)(task, seed) for seed in range(sets)))
        share = [f"{each:.3f}" for each in np.nanmean(held, axis=0)]
        print(
            f"  {name:<26} threshold {share[0]}; {share[1]}   slope {share[2]}; {share[3]}   misfit told at "
            f".05: {share[4]}",
            flush=True,
        )
    print("The same of an average participant by the mixed model, and of mean thresholds by t:")
    for people, trials, guess in ((4, 20, 0.0), (8, 12, 0.0), (12, 12, 0.0), (24, 12, 0.0), (8, 30, 0.5)):
        name = f"{people} people, {trials} trials a level, guess {guess:g}"
        if kinds not in name:
            continue
        every = Parallel(n_jobs=2)(delayed(mixed_held)(people, trials, guess, seed) for seed in range(sets))
        held = np.array([each for each in every if each is not None])
        share = [f"{each:.3f}" for each in np.nanmean(held, axis=0)]
        print(
            f"  {name:<40} threshold {share[0]}   slope {share[1]}   mean threshold {share[2]}   "
            f"of {len(held)}",
            flush=True,
        )


def participant_held(task: Task, seed: int) -> tuple[float, ...]:
    """Return which intervals hold the truth, and whether the function is said not to fit."""
    generator = np.random.default_rng([seed, 1])
    levels, core = np.arange(6.0), task.model.core
    p = psychometric_function(
        core, OCTAVES, 2.0**levels, threshold=2**2.4, slope=0.45, guess=task.guess, lapse=task.lapse
    )
    n = np.full(6, task.trials)
    catch = (float(generator.binomial(task.catch, task.guess)), float(task.catch))
    fitted = fit([table(levels, generator.binomial(n, p), n, catch)], task.model, OCTAVES)
    (profile,), (drawn_again,) = profile_intervals(fitted), resample(fitted)
    assert drawn_again is not None
    assert drawn_again.goodness is not None
    found = profile, drawn_again.intervals
    return (
        *(holds(each.threshold, 2**2.4) for each in found),
        *(holds(each.slope, 0.45) for each in found),
        float(drawn_again.goodness.p < 0.05),
    )


def holds(interval: OpenInterval | None, truth: float) -> float:
    """Return whether an interval holds the truth; NaN if there is none."""
    if interval is None:
        return math.nan
    return float((interval.low or 0) <= truth <= (math.inf if interval.high is None else interval.high))


def mixed_held(people: int, trials: int, guess: float, seed: int) -> tuple[float, float, float] | None:
    """Return whether intervals hold the threshold and slope of an average participant; None without a fit."""
    generator = np.random.default_rng([seed, people])
    levels, n = np.arange(-2.0, 3.0), np.full(5, trials)
    every = []
    for _ in range(people):
        intercept, steepness = generator.normal(0.4, 0.8), generator.normal(1.3, 0.3)
        p = guess + (1 - guess - 0.02) * NORMAL.distribution(intercept + steepness * levels)[0]
        every.append(table(levels, generator.binomial(n, p), n))
    curve = mixed_curve(every, [guess] * people, [0.02] * people, NORMAL, OCTAVES)
    if isinstance(curve, str):
        return None
    model = Model(NORMAL, guess, 0.02)
    mean = mean_threshold([fit([each], model, OCTAVES).curves[0] for each in every], OCTAVES).interval
    slope = 1.3 * slope_per_steepness(NORMAL)
    return (
        holds(curve.interval, 2 ** (-0.4 / 1.3)),
        float(curve.slope_interval.low <= slope <= curve.slope_interval.high),
        math.nan if mean is None else float(mean.low <= 2 ** (-0.4 / 1.3) <= mean.high),
    )


PARTS: dict[str, Callable[[int, str], None]] = {
    "maxima": maxima,
    "profiles": profiles,
    "mixed": mixed,
    "coverage": coverage,
}

if __name__ == "__main__":
    main()
