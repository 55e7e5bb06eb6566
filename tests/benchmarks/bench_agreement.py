"""Whether every model agrees with an independent computation, over random studies of harsh kinds.

``python tests/benchmarks/bench_agreement.py [--studies 300] [--seed 1] [--only MODEL...] [--kinds KIND...]``
prints for each model and kind the share of studies that agree, the worst difference, and what could not be
estimated and why. What it is compared with:

- mixed: the likelihood summed over a dense even grid of the random effects, its numeric Hessian, and searches
  for a higher maximum from other starts by scipy; small designs, logit and probit.
- laplace: lme4's glmer and glmmTMB on the same approximation, 2 to 24 conditions; needs Rscript with
  r-cran-lme4 and r-cran-glmmtmb. The studies of a kind go through one R process.
- gee: statsmodels' GEE with and without Mancl and DeRouen's correction, on single answers.
- conditional: the sum over all ways to fall, by plain convolution, with scipy's search and a numeric Hessian.
- firth: the penalised likelihood by scipy's search, its profile at zero too.
- beta_binomial: scipy's betabinom on a grid, then scipy's search; the profile by root finding.
"""

import argparse
import csv
import math
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy import optimize, stats
from scipy.special import expit, gammaln, log_ndtr, logsumexp

sys.path.insert(0, str(Path(__file__).parents[2]))

from autd_analysis.models.cells import is_separated, penalised
from autd_analysis.models.contrasts import null_space
from autd_analysis.models.glmm import Nested, fit_nested
from autd_analysis.models.links import LOGIT, PROBIT, Link
from autd_analysis.models.marginal import BinomialRows, Marginal
from autd_analysis.rates.beta_binomial import fit_beta_binomial
from autd_analysis.sensitivity.conditional import fit_conditional
from autd_analysis.sensitivity.firth import firth_effect
from autd_analysis.sensitivity.gee import fit_gee

Array = np.ndarray

KINDS = (
    "ordinary",
    "near 0 or 1",
    "few trials",
    "no variance",
    "correlation 1",
    "unbalanced",
    "missing cells",
    "large effect",
    "people far apart",
    "4 to 7 people",
    "separated",
)
CHI2_95 = stats.chi2.ppf(0.95, 1)


@dataclass(frozen=True)
class Study:
    """Counts, shape (people, cells); cells are of the first and the second level in turn."""

    felt: Array
    trials: Array

    @property
    def sides(self) -> Array:
        """1/2 at the first level, -1/2 at the second."""
        return np.tile([0.5, -0.5], self.felt.shape[1] // 2)

    def rows(self) -> tuple[BinomialRows, Array, bool]:
        """The rows as the analysis takes them, the contrast's weights, and whether they are penalised."""
        people, cells = self.felt.shape
        kept = (self.trials > 0).ravel()
        cell = np.tile(np.arange(cells), people)[kept]
        who = np.unique(np.repeat(np.arange(people), cells)[kept], return_inverse=True)[1]
        seen, place = np.unique(cell, return_inverse=True)
        rows = BinomialRows(
            self.felt.ravel()[kept].astype(float),
            self.trials.ravel()[kept].astype(float),
            np.eye(len(seen))[place],
            np.column_stack([np.ones(len(cell)), self.sides[cell]]),
            who,
        )
        first = self.sides[seen] > 0
        weights = np.where(first, 1 / max(1, first.sum()), -1 / max(1, (~first).sum()))
        separated = is_separated(rows)
        return (penalised(rows) if separated else rows), weights, separated


def draw(kind: str, generator: np.random.Generator, *, small: bool) -> Study:
    """Draw a study of a kind; a small one has 2 to 6 conditions and at most 20 people."""
    people = int(generator.integers(4, 21 if small else 41))
    cells = 2 * int(generator.integers(1, 4 if small else 13))
    trials = int(generator.integers(4, 21))
    sds, correlation = np.array([1.0, 0.8]), generator.uniform(-0.6, 0.6)
    base, effect = generator.normal(0, 1, cells), generator.choice([0.0, 1.0])
    if kind == "near 0 or 1":
        base = generator.choice([-3.0, 3.0]) + 0.5 * base
    elif kind == "few trials":
        trials = int(generator.integers(1, 4))
    elif kind == "no variance":
        sds = np.array([generator.choice([0.0, 1.0]), 0.0])
    elif kind == "correlation 1":
        correlation = generator.choice([-1.0, 1.0])
    elif kind == "large effect":
        effect = 3.0
    elif kind == "people far apart":
        sds = generator.uniform(1.5, 5.0, 2)
    elif kind == "4 to 7 people":
        people = int(generator.integers(4, 8))
    numbers = np.full((people, cells), trials)
    if kind == "unbalanced":
        numbers = generator.integers(1, 21, (people, cells))
    elif kind == "missing cells":
        numbers = np.where(generator.random((people, cells)) < 0.3, 0, trials)
    normal = generator.normal(size=(people, 2))
    slopes = correlation * normal[:, 0] + math.sqrt(1 - correlation**2) * normal[:, 1]
    sides = np.tile([0.5, -0.5], cells // 2)
    logits = base + sds[0] * normal[:, :1] + (effect + sds[1] * slopes[:, None]) * sides
    felt = generator.binomial(numbers, expit(logits))
    if kind == "separated":
        felt[:, 0] = numbers[:, 0] if base[0] > 0 else 0
    return Study(felt, numbers)


@dataclass
class Tally:
    """What became of the studies of a kind."""

    agree: int = 0
    compared: int = 0
    causes: Counter[str] = field(default_factory=Counter)
    worst: float = 0.0
    which: str = ""

    def add(self, name: str, differences: dict[str, float]) -> None:
        """Count a study by its differences, each in units of what is tolerated."""
        largest = max(differences, key=lambda each: differences[each])
        self.compared += 1
        self.agree += differences[largest] <= 1
        if differences[largest] > self.worst:
            self.worst, self.which = differences[largest], f"{name} {largest}"


Check = Callable[[Study, np.random.Generator], dict[str, float] | str]


def main() -> None:
    """Print agreement."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=[*CHECKS, "laplace"], default=[*CHECKS, "laplace"])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    asked = parser.parse_args()
    print("worst: largest difference in units of what is tolerated, in which study (its number) and quantity")
    for model in asked.only:
        for kind in asked.kinds:
            started_s = time.process_time()
            if model == "laplace":
                tally = against_r(kind, asked.studies, asked.seed)
            else:
                tally = against(CHECKS[model], kind, asked.studies, asked.seed)
            share = f"{tally.agree}/{tally.compared} agree" if tally.compared else "none compared"
            causes = "; ".join(f"{count} {cause}" for cause, count in tally.causes.most_common())
            print(
                f"{model}, {kind}: {share}, worst {tally.worst:.2g} ({tally.which}) "
                f"[{causes}] {time.process_time() - started_s:.0f} s",
                flush=True,
            )


def against(check: Check, kind: str, studies: int, seed: int) -> Tally:
    """Check random studies of a kind."""
    tally = Tally()
    for number in range(studies):
        generator = np.random.default_rng([seed, KINDS.index(kind), number])
        found = check(draw(kind, generator, small=True), generator)
        if isinstance(found, str):
            tally.causes[found] += 1
        else:
            tally.add(str(number), found)
    return tally


# The mixed model, against a likelihood of its own.


class Dense:
    """The likelihood by an even grid over each person's random effects, placed once and wide."""

    def __init__(self, rows: BinomialRows, parameters: Array, *, probit: bool) -> None:
        self.probit = probit
        people = int(rows.participant.max()) + 1
        longest = int(np.bincount(rows.participant).max())
        self.count = rows.fixed.shape[1]
        self.y, self.n = np.zeros((2, people, longest))
        self.x, self.z = np.zeros((people, longest, self.count)), np.zeros((people, longest, 2))
        for person in range(people):
            mine = rows.participant == person
            long = int(mine.sum())
            self.y[person, :long], self.n[person, :long] = rows.felt[mine], rows.trials[mine]
            self.x[person, :long], self.z[person, :long] = rows.fixed[mine], rows.random[mine]
        even = np.linspace(-6.0, 6.0, 41)
        grid = np.stack([each.ravel() for each in np.meshgrid(even, even)], axis=1)
        wide = np.sinh(0.5 * grid) / 0.5
        log_cells = 2 * math.log(even[1] - even[0]) + np.log(np.cosh(0.5 * grid)).sum(axis=1)
        base, effects = self._parts(parameters)
        frames = [self._frame(*each) for each in zip(self.y, self.n, base, effects, strict=True)]
        self.places = np.stack([mode + wide @ spread.T for mode, spread in frames])
        scales = np.array([math.log(abs(np.linalg.det(spread))) for _, spread in frames])
        self.offsets = (
            log_cells + scales[:, None] - math.log(2 * math.pi) - 0.5 * (self.places**2).sum(axis=2)
        )

    def __call__(self, parameters: Array) -> float:
        """Return the log likelihood without binomial coefficients."""
        base, effects = self._parts(parameters)
        predictors = base[:, None] + self.places @ effects.transpose(0, 2, 1)
        logs = self._logs(self.y[:, None], self.n[:, None], predictors).sum(axis=2) + self.offsets
        return float(logsumexp(logs, axis=1).sum())

    def _parts(self, parameters: Array) -> tuple[Array, Array]:
        a, b, c = parameters[self.count :]
        return self.x @ parameters[: self.count], self.z @ np.array([[a, 0.0], [b, c]])

    def _logs(self, y: Array, n: Array, predictors: Array) -> Array:
        """Return the log likelihood of each row."""
        logs: Array = (
            y * log_ndtr(predictors) + (n - y) * log_ndtr(-predictors)
            if self.probit
            else y * predictors - n * np.logaddexp(0, predictors)
        )
        return logs

    def _frame(self, y: Array, n: Array, base: Array, effects: Array) -> tuple[Array, Array]:
        """Return a person's mode, and a factor of the inverse curvature there."""

        def height(u: Array) -> float:
            return 0.5 * float(u @ u) - float(self._logs(y, n, base + effects @ u).sum())

        mode = optimize.minimize(height, np.zeros(2), method="BFGS").x
        return mode, np.linalg.cholesky(np.linalg.inv(-numeric_hessian(lambda u: -height(u), mode, 1e-3)))


def check_mixed(study: Study, generator: np.random.Generator) -> dict[str, float] | str:
    """Compare estimates, standard error and p with the dense likelihood, and look for a higher maximum."""
    rows, weights, _ = study.rows()
    if not {-1, 1} <= set(np.sign(weights)):
        return "a side has no trials"
    probit = bool(generator.random() < 0.25)
    link: Link = PROBIT if probit else LOGIT
    tested = fit_nested(rows, weights[None], link=link)
    if not isinstance(tested, Nested):
        return tested
    basis = null_space(weights[None])
    fewer = BinomialRows(rows.felt, rows.trials, rows.fixed @ basis, rows.random, rows.participant)
    places = [
        np.concatenate([fit.coefficients, fit.factor[np.tril_indices(2)]])
        for fit in (tested.full, tested.reduced)
    ]
    dense, dense_fewer = Dense(rows, places[0], probit=probit), Dense(fewer, places[1], probit=probit)
    logs = dense(places[0]), dense_fewer(places[1])
    higher = max(
        higher_maximum(rows, places[0], logs[0], link, probit, generator),
        higher_maximum(fewer, places[1], logs[1], link, probit, generator),
    )
    statistic = max(0.0, 2 * (logs[0] - logs[1]))
    count = len(weights)
    error = standard_error(dense, places[0], np.concatenate([weights, np.zeros(3)]))
    own_error = math.sqrt(weights @ tested.full.covariance @ weights)
    return {
        "log likelihood": abs(tested.full.log_likelihood - logs[0]) / 1e-3,
        "chi2": abs(tested.statistic - statistic) / max(2e-3, 1e-3 * statistic),
        "standard error": abs(own_error / error - 1) / 0.01 if math.isfinite(error) else 0.0,
        "slope": abs(slope_left(dense, places[0], count)) / 2e-2,
        "higher maximum": higher / 2e-3,
    }


def higher_maximum(
    rows: BinomialRows, at: Array, value: float, link: Link, probit: bool, generator: np.random.Generator
) -> float:
    """Return by how much scipy's searches from two other starts get higher, by the dense likelihood there."""
    count = rows.fixed.shape[1]
    likelihood = Marginal(rows, 25, link)

    def loss(x: Array) -> tuple[float, Array]:
        found = likelihood.derivatives(np.clip(x, -30, 30))
        return -found.value, -found.gradient

    higher = 0.0
    for sign in (-1.0, 1.0):
        start = at.copy()
        deviation = max(0.5, math.hypot(*start[count + 1 :])) * generator.uniform(0.5, 2)
        start[:count] += generator.normal(0, 1, count)
        start[count:] = [max(0.4, start[count]), sign * 0.9 * deviation, 0.45 * deviation]
        search = optimize.minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": 60})
        if -search.fun > value + 1e-3 and np.abs(search.x).max() < 25:
            higher = max(higher, Dense(rows, search.x, probit=probit)(search.x) - value)
    return higher


def slope_left(function: Callable[[Array], float], at: Array, count: int) -> float:
    """Return the largest slope of the likelihood by a fixed effect, in units of log likelihood a logit."""
    moves = 1e-3 * np.eye(len(at))[:count]
    return max(abs(function(at + move) - function(at - move)) / 2e-3 for move in moves)


def numeric_hessian(function: Callable[[Array], float], at: Array, step: float) -> Array:
    """Return the matrix of second differences."""
    size = len(at)
    moves = step * np.eye(size)
    middle = function(at)
    single = [(function(at + move), function(at - move)) for move in moves]
    found = np.empty((size, size))
    for i in range(size):
        found[i, i] = (single[i][0] + single[i][1] - 2 * middle) / step**2
        for j in range(i):
            both = function(at + moves[i] + moves[j]) + function(at - moves[i] - moves[j])
            mixed = both - sum(single[i]) - sum(single[j]) + 2 * middle
            found[i, j] = found[j, i] = mixed / (2 * step**2)
    return found


def standard_error(function: Callable[[Array], float], at: Array, weights: Array) -> float:
    """Return the standard error of a weighted sum by the numeric Hessian; NaN where that is no maximum's."""
    values, vectors = np.linalg.eigh(-numeric_hessian(function, at, 2e-3))
    kept = values > 1e-4
    variance = float(((weights @ vectors[:, kept]) ** 2 / values[kept]).sum())
    return math.sqrt(variance) if (values > -1e-2).all() else math.nan


# The same approximation by R's packages.

R_SCRIPT = """
suppressMessages({library(lme4); library(glmmTMB)})
all <- read.csv(commandArgs(TRUE)[1])
tight <- glmerControl(optimizer = "bobyqa", optCtrl = list(maxfun = 2e4, rhoend = 1e-8),
  tolPwrss = 1e-10, calc.derivs = FALSE, check.conv.singular = "ignore")
quiet <- function(x) suppressWarnings(suppressMessages(tryCatch(x, error = function(e) NULL)))
for (k in unique(all$study)) {
  d <- all[all$study == k, ]
  d$participant <- factor(d$participant)
  X <- as.matrix(d[, grep("^x", names(d))])
  X <- X[, colSums(is.na(X)) == 0, drop = FALSE]
  half <- cbind(d$felt, d$trials - d$felt)
  for (model in c("full", "reduced")) {
    Z <- if (model == "full") X else X[, -1, drop = FALSE]
    one <- quiet(glmer(half ~ 0 + Z + (1 + slope | participant), d, binomial, control = tight))
    two <- quiet(glmmTMB(half ~ 0 + Z + (1 + slope | participant), d, binomial))
    if (!is.null(one)) cat(k, model, "glmer", as.numeric(logLik(one)), fixef(one)[[1]], NA, "\\n")
    if (!is.null(two)) cat(k, model, "glmmTMB", as.numeric(logLik(two)), fixef(two)$cond[[1]],
      sqrt(vcov(two)$cond[1, 1]), "\\n")
  }
}
"""


def against_r(kind: str, studies: int, seed: int) -> Tally:
    """Compare Laplace's approximation with glmer and glmmTMB: estimate, standard error, likelihood ratio."""
    tally = Tally()
    if shutil.which("Rscript") is None:
        tally.causes["Rscript is not installed"] += studies
        return tally
    drawn = {}
    for number in range(studies):
        generator = np.random.default_rng([seed, KINDS.index(kind), number])
        rows, weights, separated = draw(kind, generator, small=False).rows()
        if separated or not {-1, 1} <= set(np.sign(weights)):  # R takes whole numbers of answers alone
            tally.causes["separated, or a side has no trials"] += 1
        else:
            drawn[number] = rows, weights
    theirs = r_fits(drawn)
    for number, (rows, weights) in drawn.items():
        tested = fit_nested(rows, weights[None], nodes=1)
        if not isinstance(tested, Nested):
            tally.causes[tested] += 1
            continue
        constant = (
            gammaln(rows.trials + 1) - gammaln(rows.felt + 1) - gammaln(rows.trials - rows.felt + 1)
        ).sum()
        found = [theirs[number, model] for model in ("full", "reduced") if (number, model) in theirs]
        if len(found) < 2:
            tally.causes["R has no fit"] += 1
            continue
        full, reduced = (max(fits.values(), key=lambda fit: fit[0]) for fits in found)
        own, error = (
            float(weights @ tested.full.coefficients),
            math.sqrt(weights @ tested.full.covariance @ weights),
        )
        lower = max(
            full[0] - constant - tested.full.log_likelihood,
            reduced[0] - constant - tested.reduced.log_likelihood,
        )
        ours_higher = min(
            tested.full.log_likelihood + constant - full[0],
            tested.reduced.log_likelihood + constant - reduced[0],
        )
        differences = {"log likelihood under theirs": max(0.0, lower) / 5e-3}
        if (
            abs(ours_higher) < 5e-3
            and lower < 5e-3
            and tested.full.log_likelihood + constant - full[0] < 5e-3
        ):
            differences["estimate, in standard errors"] = abs(own - full[1]) / error / 0.02
            differences["chi2"] = abs(tested.statistic - 2 * (full[0] - reduced[0])) / 0.02
            if math.isfinite(full[2]):
                differences["standard error"] = abs(full[2] / error - 1) / 0.02
        else:
            tally.causes["ours is higher than both"] += lower < 5e-3
        tally.add(str(number), differences)
    return tally


def r_fits(
    drawn: dict[int, tuple[BinomialRows, Array]],
) -> dict[tuple[int, str], dict[str, tuple[float, float, float]]]:
    """Let R fit all studies in one process; the first fixed effect is the contrast."""
    with tempfile.TemporaryDirectory() as folder:
        table, script = Path(folder, "studies.csv"), Path(folder, "fit.R")
        script.write_text(R_SCRIPT)
        widest = max(len(weights) for _, weights in drawn.values())
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            names = [f"x{place}" for place in range(widest)]
            writer.writerow(["study", "participant", "felt", "trials", "slope", *names])
            for number, (rows, weights) in drawn.items():
                basis = np.column_stack([weights / (weights @ weights), null_space(weights[None])])
                design = rows.fixed @ basis
                for row in range(len(design)):
                    blank = ["NA"] * (widest - design.shape[1])
                    counts = int(rows.felt[row]), int(rows.trials[row]), rows.random[row, 1]
                    writer.writerow([number, rows.participant[row], *counts, *design[row], *blank])
        done = subprocess.run(
            ["Rscript", str(script), str(table)], capture_output=True, text=True, check=True
        )
    found: dict[tuple[int, str], dict[str, tuple[float, float, float]]] = {}
    for line in done.stdout.splitlines():
        number_text, model, package, *numbers = line.split()
        values = tuple(math.nan if each in ("NA", "NaN") else float(each) for each in numbers)
        if math.isfinite(values[0]):
            found.setdefault((int(number_text), model), {})[package] = (values[0], values[1], values[2])
    return found


# The other models.


def check_gee(study: Study, generator: np.random.Generator) -> dict[str, float] | str:
    """Compare with statsmodels on single answers."""
    import statsmodels.api as sm

    rows, weights, separated = study.rows()
    if separated or not {-1, 1} <= set(np.sign(weights)):
        return "separated, or a side has no trials"
    fit = fit_gee(rows)
    if fit is None:
        return "ours has no solution"
    counts = rows.trials.astype(int)
    felt = np.concatenate(
        [np.repeat([1.0, 0.0], [int(y), n - int(y)]) for y, n in zip(rows.felt, counts, strict=True)]
    )
    model = sm.GEE(
        felt,
        np.repeat(rows.fixed, counts, axis=0),
        groups=np.repeat(rows.participant, counts),
        family=sm.families.Binomial(),
        cov_struct=sm.cov_struct.Exchangeable(),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            theirs = {
                kind: model.fit(cov_type=kind, maxiter=200, ctol=1e-9) for kind in ("robust", "bias_reduced")
            }
        except (np.linalg.LinAlgError, ValueError, ZeroDivisionError) as error:
            return f"statsmodels: {type(error).__name__}"
    plain, corrected = fit.covariance("none"), fit.covariance("mancl_derouen")
    if plain is None or corrected is None:
        return "a participant alone determines a coefficient"
    if not theirs["robust"].converged:
        return "statsmodels did not converge"
    own_error = math.sqrt(weights @ plain @ weights)
    differences = {
        "estimate, in standard errors": abs(weights @ (fit.coefficients - theirs["robust"].params))
        / max(own_error, 1e-3)
        / 0.01
    }
    for name, own, kind in (("plain error", plain, "robust"), ("corrected error", corrected, "bias_reduced")):
        other = math.sqrt(max(0.0, weights @ theirs[kind].cov_params() @ weights))
        differences[name] = abs(math.sqrt(weights @ own @ weights) - other) / max(other, 1e-3) / 0.01
    return differences


def check_conditional(study: Study, generator: np.random.Generator) -> dict[str, float] | str:
    """Compare with the likelihood by plain convolution over conditions, its search and numeric Hessian."""
    felt, trials = study.felt.astype(float), study.trials.astype(float)
    cells = felt.shape[1]
    design = null_space(np.ones((1, cells)))
    fit = fit_conditional(felt, trials, design)
    if fit is None:
        return "no finite estimate"

    def value(coefficients: Array) -> float:
        logits = design @ coefficients
        total = 0.0
        for y, n in zip(study.felt, study.trials, strict=True):
            ways = np.ones(1)
            for cell in range(cells):
                answers = np.arange(n[cell] + 1)
                log_ways = gammaln(n[cell] + 1) - gammaln(answers + 1) - gammaln(n[cell] - answers + 1)
                ways = np.convolve(ways, np.exp(log_ways + answers * logits[cell]))
            total += float(y @ logits) - math.log(ways[int(y.sum())])
        return total

    def loss(coefficients: Array) -> float:
        return -value(coefficients)

    search = optimize.minimize(loss, np.zeros(cells - 1), method="BFGS", options={"gtol": 1e-7})
    covariance = np.linalg.inv(-numeric_hessian(value, search.x, 1e-3))
    errors = np.sqrt(np.diag(covariance))
    return {
        "estimate, in standard errors": float((np.abs(fit.coefficients - search.x) / errors).max()) / 0.005,
        "standard error": float(np.abs(np.sqrt(np.diag(fit.covariance)) / errors - 1).max()) / 0.005,
        "log likelihood": abs(fit.log_likelihood - value(fit.coefficients)) / 1e-6,
    }


def check_firth(study: Study, generator: np.random.Generator) -> dict[str, float] | str:
    """Compare with scipy's search of the penalised likelihood, free, at zero and at the interval's ends."""
    rows, weights, separated = Study(study.felt[:8], study.trials[:8]).rows()
    if separated:
        rows = BinomialRows(
            np.round(rows.felt), np.round(rows.trials), rows.fixed, rows.random, rows.participant
        )
    if not {-1, 1} <= set(np.sign(weights)):
        return "a side has no trials"
    people = np.eye(int(rows.participant.max()) + 1)[rows.participant][:, 1:]
    design = np.column_stack([people, rows.fixed])
    padded = np.concatenate([np.zeros(people.shape[1]), weights])
    effect = firth_effect(rows.felt, rows.trials, design, padded)
    if effect is None:
        return "people and conditions cannot be told apart"

    def loss(x: Array, basis: Array, offset: Array) -> float:
        predictors = design @ (offset + basis @ x)
        p = expit(predictors)
        information = design.T @ ((rows.trials * p * (1 - p))[:, None] * design)
        penalty = np.linalg.slogdet(information)[1] / 2
        return -float((rows.felt * predictors - rows.trials * np.logaddexp(0, predictors)).sum() + penalty)

    def lowest(basis: Array, offset: Array) -> tuple[float, Array]:
        found = optimize.minimize(
            loss, np.zeros(basis.shape[1]), (basis, offset), method="BFGS", options={"gtol": 1e-6}
        )
        return float(found.fun), offset + basis @ found.x

    everything, others = np.eye(len(padded)), null_space(padded[None])
    free, place = lowest(everything, np.zeros(len(padded)))
    at_zero = lowest(others, np.zeros(len(padded)))[0]
    ends = [
        2 * (lowest(others, end * padded / (padded @ padded))[0] - free) - CHI2_95
        for end in (effect.interval.low, effect.interval.high)
    ]
    return {
        "estimate, in standard errors": abs(effect.logits - padded @ place) / effect.standard_error / 0.01,
        "chi2": abs(effect.statistic - 2 * (at_zero - free)) / 1e-3,
        "profile at the interval's ends": max(map(abs, ends)) / 1e-3,
    }


def check_beta_binomial(study: Study, generator: np.random.Generator) -> dict[str, float] | str:
    """Compare with scipy's betabinom: a grid, then a search; the interval's ends by the profile there."""
    counts = [(int(y), int(n)) for y, n in zip(study.felt[:, 0], study.trials[:, 0], strict=True)]
    fit = fit_beta_binomial(counts)
    if fit is None:
        return "all answers are the same"
    felt, trials = np.array([c for c in counts if c[1]]).T

    def value(logit_mean: float, log_size: float) -> float:
        mean, size = expit(logit_mean), math.exp(log_size)
        logs = stats.betabinom.logpmf(felt, trials, mean * size, (1 - mean) * size)
        return float(logs.sum())

    def profile(logit_mean: float) -> float:
        sizes = np.linspace(-12, 14, 53)
        best = sizes[np.argmax([value(logit_mean, each) for each in sizes])]
        found = optimize.minimize_scalar(
            lambda x: -value(logit_mean, x), bounds=(best - 0.5, best + 0.5), method="bounded"
        )
        binomial = float(stats.binom.logpmf(felt, trials, expit(logit_mean)).sum())
        return max(-float(found.fun), binomial)

    grid = np.linspace(-12, 12, 97)
    coarse = grid[np.argmax([profile(each) for each in grid])]
    best = optimize.minimize_scalar(
        lambda x: -profile(x),
        bounds=(coarse - 0.25, coarse + 0.25),
        method="bounded",
        options={"xatol": 1e-7},
    )
    pooled = felt.sum() / trials.sum()
    ratio = 2 * (-best.fun - float(stats.binom.logpmf(felt, trials, pooled).sum()))
    inside = [end for end in (fit.interval.low, fit.interval.high) if 1e-5 < end < 1 - 1e-5]
    lost = [2 * (-best.fun - profile(math.log(end / (1 - end)))) - CHI2_95 for end in inside]
    own = profile(math.log(fit.mean / (1 - fit.mean)))
    return {
        "log likelihood": (-best.fun - own) / 1e-4,
        "p": abs(fit.p_overdispersion - stats.chi2.sf(max(0.0, ratio), 1) / 2) / 1e-3,
        "profile at the interval's ends": max(map(abs, lost), default=0.0) / 5e-3,
    }


CHECKS: dict[str, Check] = {
    "mixed": check_mixed,
    "gee": check_gee,
    "conditional": check_conditional,
    "firth": check_firth,
    "beta_binomial": check_beta_binomial,
}

if __name__ == "__main__":
    main()
