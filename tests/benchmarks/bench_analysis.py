"""How fast studies are tested and analysed; all figures in one run.

``python tests/benchmarks/bench_analysis.py``. Where Rscript and lme4 are installed (Debian: r-base-core,
r-cran-lme4), glmer fits the same studies in the same run. How often tests find what is not there is another
question: ``make statistics``.
"""

import csv
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

sys.path.insert(0, str(Path(__file__).parents[2]))

from autd_analysis.comparisons.numbers import planned_comparisons
from autd_analysis.data.design import conditions, protocol_design
from autd_analysis.data.trial_table import TrialRow
from autd_analysis.data.trials import Trials, data_frame
from autd_analysis.models.glmm import DEFAULT_NODES, BinomialRows, fit_glmm
from autd_analysis.power.model import StudyModel, study_model
from autd_analysis.power.run import Question, power_analysis
from autd_analysis.study import analyse

from autd_trials.protocol.load import find_protocol, load_protocol

STUDIES = 2000
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
taken <- system.time(fits <- lapply(parts, fit))
cat(as.character(packageVersion("lme4")), taken[["user.self"]] + taken[["sys.self"]], sapply(fits, fixef))
"""


def main() -> None:
    """Print speeds."""
    model = chest_model()
    compare_with_glmer(model)
    time_sign_flip_power(model)
    time_planned_tests(model)
    time_everything(model)
    time_demo()


def chest_model() -> StudyModel:
    """Return the paper's design, felt at .65 and .45; people differ by 1 logit, and by 0.57 in each cell."""
    protocol = load_protocol(find_protocol("chest"))
    cells = conditions(protocol_design(protocol).factors)
    rates = {cell: 0.65 if ("clothing", "inner") in cell else 0.45 for cell in cells}
    return study_model(protocol, rates, (1.0, 0.8 / math.sqrt(2)))


def time_sign_flip_power(model: StudyModel) -> None:
    """Simulate and test studies on one core."""
    question = Question((8,), 40_000, ("sign_flip",))
    power_analysis(model, Question((8,), 500, ("sign_flip",)))
    start_s = time.process_time()
    power_analysis(model, question)
    rate = question.studies / (time.process_time() - start_s)
    print(
        f"power by sign-flip, simulation, 3 comparisons, and as many without a difference: {rate:,.0f} "
        "studies/s a core (limit 50,000)"
    )


def compare_with_glmer(model: StudyModel) -> None:
    """Fit studies of 480 trials by our quadrature (the default) and Laplace's approximation, and glmer's."""
    generator = np.random.default_rng(1)
    counts = model.answers(model.people(STUDIES_OF_GLMER, 8, generator), generator)
    studies = [rows(study) for study in counts]
    quadrature_ms, quadrature = timed_fits(studies, DEFAULT_NODES)
    laplace_ms, laplace = timed_fits(studies, 1)
    print(
        f"mixed model, 480 trials: {quadrature_ms:.1f} ms a fit by quadrature, {laplace_ms:.1f} ms by Laplace"
    )
    if shutil.which("Rscript") is None:
        print("  glmer: not compared, as Rscript is not installed")
        return
    done = run_glmer(counts)
    if done.returncode:
        print(f"  glmer: not compared: {done.stderr.strip().splitlines()[-1]}")
        return
    version, seconds, *estimates = done.stdout.split()
    glmer_ms = 1000 * float(seconds) / len(studies)
    glmer = np.array(estimates, float).reshape(len(studies), -1)
    print(
        f"  glmer (lme4 {version}): {glmer_ms:.0f} ms a fit, {glmer_ms / quadrature_ms:.0f} times as long as "
        f"the default (limit 10); largest difference of estimates {np.abs(laplace - glmer).max():.1e} by the "
        f"same approximation, {np.abs(quadrature - glmer).max():.1e} by quadrature"
    )


def timed_fits(studies: list[BinomialRows], nodes: int) -> tuple[float, np.ndarray]:
    """Return the CPU time of a fit in ms and the estimates, shape (studies, cells)."""
    fit_glmm(studies[0], nodes)
    start_s = time.process_time()
    fits = [fit_glmm(study, nodes) for study in studies]
    each_ms = 1000 * (time.process_time() - start_s) / len(studies)
    assert all(fit.converged for fit in fits)
    return each_ms, np.array([fit.coefficients for fit in fits])


def run_glmer(counts: np.ndarray) -> subprocess.CompletedProcess[str]:
    """Let glmer fit the same studies."""
    with tempfile.TemporaryDirectory() as folder:
        table, script = Path(folder, "studies.csv"), Path(folder, "glmer.R")
        script.write_text(GLMER)
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["study", "participant", "cell", "slope", "felt"])
            for (number, person, cell), felt in np.ndenumerate(counts):
                writer.writerow([number, person, cell, 0.5 - cell % 2, felt])
        command = ["Rscript", str(script), str(table)]
        return subprocess.run(command, capture_output=True, text=True, check=False)


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


def time_planned_tests(model: StudyModel) -> None:
    """Put studies through the planned comparisons with all their tests, on all cores."""
    generator = np.random.default_rng(2)
    counts = model.answers(model.people(STUDIES, 8, generator), generator)
    start_s = time.perf_counter()
    Parallel(n_jobs=-1)(delayed(planned_tests)(model, study) for study in counts)
    taken_s = time.perf_counter() - start_s
    print(
        f"{STUDIES} studies through the planned comparisons (sign-flip, t, Wilcoxon, Bayes factor, mixed "
        f"model, Holm): {taken_s:.0f} s on {os.cpu_count()} cores (limit 90 s)"
    )


def planned_tests(model: StudyModel, counts: np.ndarray) -> None:
    """Test one study."""
    planned_comparisons(model.rates(counts), model.design)


def time_everything(model: StudyModel, studies: int = 100) -> None:
    """Put some studies through all that `analyse` computes, files aside, and say what 2000 would take."""
    generator = np.random.default_rng(3)
    counts = model.answers(model.people(studies, 8, generator), generator)
    trials = [trials_of(model, study) for study in counts]
    analyse(trials[0])
    start_s = time.perf_counter()
    Parallel(n_jobs=-1)(delayed(analyse_without_files)(each) for each in trials)
    each_s = (time.perf_counter() - start_s) / studies
    print(
        f"all that analyse computes, psychometric functions with 400 resamples included: {1000 * each_s:.0f} "
        f"ms a study on {os.cpu_count()} cores, so {STUDIES * each_s:.0f} s for {STUDIES}"
    )


def analyse_without_files(trials: Trials) -> None:
    """Analyse one study."""
    analyse(trials)


def trials_of(model: StudyModel, counts: np.ndarray) -> Trials:
    """Return one study's trials, those of a block in plain order."""
    rows = [
        TrialRow(
            participant=f"{person:02d}",
            session="01",
            block=1 + (dict(cell)["clothing"] != "inner"),
            trial=place * model.trials + number,
            attempt=1,
            trial_type="stimulus",
            trial_status="complete",
            felt=number < felt,
            response_time_s=None,
            levels=dict(cell),
        )
        for person, row in enumerate(counts)
        for place, (cell, felt) in enumerate(zip(model.cells, row, strict=True))
        for number in range(model.trials)
    ]
    return Trials(model.design, data_frame(rows, model.design), simulated=True, warnings=(), inputs=())


def time_demo() -> None:
    """Analyse the demo's study as a person does: start-up, figures and report included."""
    program = str(Path(sys.executable).with_name("autd-trials"))
    with tempfile.TemporaryDirectory() as folder:
        silently([program, "run", "chest", "--simulate", "8", "--seed", "1", "--data", folder])
        times_s = []
        for _ in range(3):
            start_s = time.perf_counter()
            silently([program, "analyse", f"{folder}/chest"])
            times_s.append(time.perf_counter() - start_s)
    print(f"autd-trials analyse on the demo study: {min(times_s):.1f} s, best of 3 (limit 5 s)")


def silently(command: list[str]) -> None:
    """Run a program and wait for its end."""
    subprocess.run(command, capture_output=True, check=True)


if __name__ == "__main__":
    main()
