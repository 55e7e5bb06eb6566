"""Power, false positives and interval widths over simulated studies of several sizes."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import Interval, t_quantile, wilson_interval
from autd_analysis.models.cells import NoModel
from autd_analysis.models.planned import mixed_model_test
from autd_analysis.power.fast import paired_t_p, rejected, sign_flip_p
from autd_analysis.power.model import CellContrast, Counts, StudyModel

TestName = Literal["sign_flip", "paired_t", "mixed_model"]

_CHUNK = {"sign_flip": 500, "paired_t": 500, "mixed_model": 25}

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PowerRow:
    """What became of the studies of one size, for one comparison and test.

    Attributes
    ----------
    participants, comparison, test
        Which.
    studies
        How many were simulated.
    power, power_interval
        Share that found a difference at the level alpha, and its Wilson 95 % Monte Carlo interval.
    power_holm
        The same after Holm's adjustment over all planned comparisons.
    false_positives, false_positives_interval
        The same as power in studies without a difference: the same people with the same slopes, but for their
        mean.
    not_tested
        Share in which the test could not be made; they count as not found.
    interval_width, interval
        Mean width of the 95 % interval that goes with the test, and which interval it is: Student's t of the
        difference of rates, or Wald's of the difference in logits. Studies that gave none are left out.
    """

    participants: int
    comparison: str
    test: TestName
    studies: int
    power: float
    power_interval: Interval | None
    power_holm: float
    false_positives: float
    false_positives_interval: Interval | None
    not_tested: float
    interval_width: float | None
    interval: str


@dataclass(frozen=True)
class Question:
    """What is asked.

    Attributes
    ----------
    participants
        Sizes of studies.
    studies
        How many of each size.
    tests
        Which tests.
    alpha
        Level of significance.
    seed
        Of everything; the numbers do not depend on how the work is divided.
    """

    participants: tuple[int, ...]
    studies: int
    tests: tuple[TestName, ...]
    alpha: float = 0.05
    seed: int = 1


INTERVALS: dict[TestName, str] = {
    "sign_flip": "t, difference of rates",
    "paired_t": "t, difference of rates",
    "mixed_model": "Wald, logits",
}

Progress = Callable[[float], None]


def power_analysis(
    model: StudyModel, question: Question, *, jobs: int = 1, progress: Progress = lambda _share: None
) -> list[PowerRow]:
    """Simulate and test studies, on several cores or, inside a joblib backend, on a cluster.

    Parameters
    ----------
    model
        What is simulated.
    question
        What is asked.
    jobs
        Processes; -1 for all cores.
    progress
        Told how far it is, 0 to 1.
    """
    from joblib import Parallel, delayed

    size = min(_CHUNK[test] for test in question.tests)
    starts = range(0, question.studies, size)
    work = [
        (participants, number, min(size, question.studies - start))
        for participants in question.participants
        for number, start in enumerate(starts)
    ]
    model.mean_logits  # noqa: B018 - known before the model goes to the workers
    tallies: dict[int, list[_Tally]] = {participants: [] for participants in question.participants}
    run = Parallel(n_jobs=jobs, return_as="generator")
    results: Iterable[_Tally] = run(delayed(_chunk)(model, question, *each) for each in work)
    for done, (each, tally) in enumerate(zip(work, results, strict=True), start=1):
        tallies[each[0]].append(tally)
        progress(done / len(work))
    return [
        row for participants in question.participants for row in _rows(model, question, participants, tallies)
    ]


@dataclass(frozen=True, eq=False)
class _Tally:
    """Counts over a chunk, and sums of the intervals' widths with their number; shape (tests, contrasts)."""

    found: Counts
    found_holm: Counts
    false_positives: Counts
    not_tested: Counts
    widths: Array
    intervals: Counts


def _chunk(model: StudyModel, question: Question, participants: int, number: int, studies: int) -> _Tally:
    sequence = np.random.SeedSequence(question.seed, spawn_key=(participants, number))
    generator = np.random.default_rng(sequence)
    people = model.people(studies, participants, generator)
    counts = model.answers(people, generator)
    p, widths = _tested(model, counts, question.tests, model.contrasts)
    null = np.concatenate(
        [
            _tested(
                model, _null_counts(model, people, counts, contrast, generator), question.tests, [contrast]
            )[0]
            for contrast in model.contrasts
        ],
        axis=-1,
    )
    adjusted = _holm(p)
    return _Tally(
        found=rejected(p, question.alpha).sum(axis=1),
        found_holm=rejected(adjusted, question.alpha).sum(axis=1),
        false_positives=rejected(null, question.alpha).sum(axis=1),
        not_tested=np.isnan(p).sum(axis=1),
        widths=np.nansum(widths, axis=1),
        intervals=(~np.isnan(widths)).sum(axis=1),
    )


def _tested(
    model: StudyModel, counts: Counts, tests: Sequence[TestName], contrasts: Sequence[CellContrast]
) -> tuple[Array, Array]:
    """Return p and the width of the interval of each test, study and contrast; NaN where there is none."""
    p, widths = np.empty((2, len(tests), len(counts), len(contrasts)))
    for column, contrast in enumerate(contrasts):
        differences = _differences(counts, contrast)
        trials = model.trials * len(contrast.first)
        for row, test in enumerate(tests):
            if test == "mixed_model":
                found = [_mixed_model(model, each, contrast) for each in counts]
                p[row, :, column], widths[row, :, column] = np.array(found).T
                continue
            p[row, :, column] = (
                sign_flip_p(differences, trials) if test == "sign_flip" else paired_t_p(differences)
            )
            widths[row, :, column] = _t_widths(differences / trials)
    return p, widths


def _null_counts(
    model: StudyModel,
    people: Array,
    counts: Counts,
    contrast: CellContrast,
    generator: np.random.Generator,
) -> Counts:
    """Return counts of the same people in whom the compared cells do not differ on average."""
    answers = model.answers(model.without_difference(people, contrast, generator), generator)
    found = counts.copy()
    found[..., list(contrast.first)], found[..., list(contrast.second)] = (
        answers[..., 0, :],
        answers[..., 1, :],
    )
    return found


def _differences(counts: Counts, contrast: CellContrast) -> Counts:
    first, second = counts[..., list(contrast.first)], counts[..., list(contrast.second)]
    differences: Counts = first.sum(axis=-1) - second.sum(axis=-1)
    return differences


def _mixed_model(model: StudyModel, counts: Counts, contrast: CellContrast) -> tuple[float, float]:
    """Return p and width for one study's counts, shape (participants, cells)."""
    test = mixed_model_test(model.rates(counts), contrast.contrast)
    if isinstance(test, NoModel):
        return np.nan, np.nan
    return test.p, test.interval.high - test.interval.low


def _holm(p: Array) -> Array:
    """Adjust over the contrasts of every test and study; `basics.adjustment.holm` does one family.

    There as here a test that could not be made (NaN) counts: the family is what was planned.
    """
    order = np.argsort(p, axis=-1)  # NaN last
    ascending = np.take_along_axis(p, order, axis=-1)
    contrasts = p.shape[-1]
    stepped = np.minimum(ascending * (contrasts - np.arange(contrasts)), 1.0)
    adjusted = np.empty_like(p)
    np.put_along_axis(adjusted, order, np.maximum.accumulate(stepped, axis=-1), axis=-1)
    return adjusted


def _t_widths(differences: Array) -> Array:
    """Return the widths of the studies' t intervals; NaN where all differences are equal."""
    participants = differences.shape[1]
    sds = differences.std(axis=1, ddof=1)
    widths = 2 * t_quantile(participants - 1) * sds / np.sqrt(participants)
    return np.where(np.ptp(differences, axis=1) > 0, widths, np.nan)


def _rows(
    model: StudyModel, question: Question, participants: int, tallies: dict[int, list[_Tally]]
) -> Iterable[PowerRow]:
    mine = tallies[participants]
    for column, contrast in enumerate(model.contrasts):
        for row, test in enumerate(question.tests):
            found, found_holm, false, untested, intervals = (
                int(sum(getattr(tally, name)[row, column] for tally in mine))
                for name in ("found", "found_holm", "false_positives", "not_tested", "intervals")
            )
            width = sum(float(tally.widths[row, column]) for tally in mine)
            yield PowerRow(
                participants=participants,
                comparison=contrast.name,
                test=test,
                studies=question.studies,
                power=found / question.studies,
                power_interval=wilson_interval(found, question.studies),
                power_holm=found_holm / question.studies,
                false_positives=false / question.studies,
                false_positives_interval=wilson_interval(false, question.studies),
                not_tested=untested / question.studies,
                interval_width=width / intervals if intervals else None,
                interval=INTERVALS[test],
            )
