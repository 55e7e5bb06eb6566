"""How fast studies are tested, and how often a test finds what is not there.

``python tests/benchmarks/bench_analysis.py [studies for the mixed model's false positives]`` (2000; 4
minutes). Where Rscript and lme4 are installed (Debian: r-base-core, r-cran-lme4), glmer fits the same studies
in the same run.
"""

import csv
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2]))

from analysis.design import protocol_design
from analysis.models.glmm import BinomialRows, fit_glmm
from analysis.power.model import GivenRates, StudyModel, study_model
from analysis.power.run import Question, TestName, power_analysis
from autd_trials.protocol.load import find_protocol, load_protocol_with_sha256

STUDIES_OF_GLMER = 20
GLMER = """
suppressMessages(library(lme4))
d <- read.csv(commandArgs(TRUE)[1])
d$cell <- factor(d$cell)
d$participant <- factor(d$participant)
parts <- split(d, d$study)
model <- cbind(felt, 10 - felt) ~ 0 + cell + (1 + slope | participant)
fit <- function(part) suppressWarnings(suppressMessages(glmer(model, part, binomial)))
invisible(fit(parts[[1]]))
taken <- system.time(for (part in parts) fit(part))
cat(taken[["user.self"]] + taken[["sys.self"]], as.character(packageVersion("lme4")))
"""


def main() -> None:
    """Print speeds and the table of false positives."""
    model = chest_model(0.65, 0.45)
    compare_with_glmer(model)
    question = Question((8,), 40_000, ("sign_flip",))
    power_analysis(model, Question((8,), 500, ("sign_flip",)))
    start_s = time.process_time()
    power_analysis(model, question)
    rate = question.studies / (time.process_time() - start_s)
    print(f"power by sign-flip, simulation, 3 comparisons and false positives: {rate:,.0f} studies/s a core")
    time_default_analysis(model)
    print_false_positives(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)


def chest_model(inner: float, both: float) -> StudyModel:
    """The paper's design with given rates; people differ by 1 logit, and by 0.57 in each cell.

    So the difference of two cells has a standard deviation of 0.8 logits over people.
    """
    protocol = load_protocol_with_sha256(find_protocol("chest"))[0]
    model = study_model(protocol, None, (0, 0))
    rates = np.array([inner if ("clothing", "inner") in cell else both for cell in model.cells])
    population = GivenRates(rates, common_sd=1.0, cell_sd=0.8 / np.sqrt(2))
    return StudyModel(protocol_design(protocol), model.cells, 10, model.contrasts, population)


def compare_with_glmer(model: StudyModel) -> None:
    """Fit studies of 480 trials by our quadrature and by glmer's Laplace approximation."""
    generator = np.random.default_rng(1)
    counts = model.answers(model.people(STUDIES_OF_GLMER, 8, generator), generator)
    studies = [rows(study) for study in counts]
    fit_glmm(studies[0])
    start_s = time.process_time()
    fits = [fit_glmm(study) for study in studies]
    ours_ms = 1000 * (time.process_time() - start_s) / len(studies)
    converged = sum(fit.converged for fit in fits)
    print(f"mixed model, 480 trials: {ours_ms:.1f} ms a fit, {converged} of {len(fits)} converged")
    if shutil.which("Rscript") is None:
        print("  glmer: not compared, as Rscript is not installed")
        return
    with tempfile.TemporaryDirectory() as folder:
        table, script = Path(folder, "studies.csv"), Path(folder, "glmer.R")
        script.write_text(GLMER)
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["study", "participant", "cell", "slope", "felt"])
            for number, study in enumerate(counts):
                for person, cells in enumerate(study):
                    for cell, felt in enumerate(cells):
                        writer.writerow([number, person, cell, 0.5 - cell % 2, felt])
        done = subprocess.run(
            ["Rscript", str(script), str(table)], capture_output=True, text=True, check=False
        )
    if done.returncode:
        print(f"  glmer: not compared: {done.stderr.strip().splitlines()[-1]}")
        return
    seconds, version = done.stdout.split()
    theirs_ms = 1000 * float(seconds) / len(studies)
    print(
        f"  glmer (lme4 {version}): {theirs_ms:.0f} ms a fit; ours is {theirs_ms / ours_ms:.0f} times as fast"
    )


def rows(study: np.ndarray) -> BinomialRows:
    """Return the rows of one study's counts, shape (participants, cells)."""
    people, cells = study.shape
    cell = np.tile(np.arange(cells), people)
    return BinomialRows(
        felt=study.ravel().astype(float),
        trials=np.full(study.size, 10.0),
        fixed=np.eye(cells)[cell],
        random=np.column_stack([np.ones(study.size), 0.5 - cell % 2]),
        participant=np.repeat(np.arange(people), cells),
    )


def time_default_analysis(model: StudyModel, studies: int = 100) -> None:
    """Put studies through all tests of the default analysis on all cores; false positives double the work."""
    tests: tuple[TestName, ...] = ("sign_flip", "paired_t", "mixed_model")
    start_s = time.perf_counter()
    power_analysis(model, Question((8,), studies, tests), jobs=-1)
    taken_s = (time.perf_counter() - start_s) / 2
    print(
        f"2000 studies through the default tests: {2000 / studies * taken_s:.0f} s on {os.cpu_count()} cores"
    )


def print_false_positives(mixed_studies: int) -> None:
    """Print how often a difference is found where there is none, at the level 0.05."""
    table = Table("rates", "participants", "test", "studies", "found at .05", "95 % interval", box=None)
    for rate in (0.5, 0.8, 0.95):
        for participants in (8, 16):
            for tests, studies in ((("sign_flip", "paired_t"), 10_000), (("mixed_model",), mixed_studies)):
                chosen: tuple[TestName, ...] = tests  # type: ignore[assignment]
                for row in power_analysis(
                    chest_model(rate, rate), Question((participants,), studies, chosen), jobs=-1
                ):
                    if "100" not in row.comparison or row.power_interval is None:
                        continue
                    low, high = row.power_interval.low, row.power_interval.high
                    cells = (f"{rate:g}", str(participants), row.test, str(studies), f"{row.power:.4f}")
                    table.add_row(*cells, f"{low:.4f} to {high:.4f}")
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
