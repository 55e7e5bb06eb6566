"""Power analyses: against known power, the same whatever divides the work, false positives told."""

from pathlib import Path

import numpy as np
import pytest
from autd_analysis.data.design import protocol_design
from autd_analysis.power.model import Counts, GivenRates, StudyModel, read_rates, study_model
from autd_analysis.power.run import PowerRow, Question, TestName, power_analysis
from scipy import stats
from scipy.special import logit

from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison, Protocol
from tests.analysis.conftest import chest_protocol

FAST: tuple[TestName, ...] = ("sign_flip", "paired_t")


def chest(**changes: object) -> Protocol:
    return chest_protocol(**changes)  # type: ignore[arg-type]


def given_model(inner: float, both: float, cell_sd: float = 0.5) -> StudyModel:
    design = protocol_design(chest())
    model = study_model(chest(), None, (0, 0))
    rates = np.array([inner if ("clothing", "inner") in cell else both for cell in model.cells])
    return StudyModel(design, model.cells, 10, model.contrasts, GivenRates(rates, 1.0, cell_sd))


def simulated(model: StudyModel, studies: int, participants: int, seed: int) -> Counts:
    generator = np.random.default_rng(seed)
    return model.answers(model.people(studies, participants, generator), generator)


def rows_of(rows: list[PowerRow], test: str) -> list[PowerRow]:
    return [row for row in rows if row.test == test]


def test_the_power_of_the_t_test_is_the_known_one() -> None:
    """Differences of rates are nearly normal here, so that the noncentral t distribution tells the power."""
    model = given_model(0.55, 0.4)
    (row, *_) = rows_of(power_analysis(model, Question((12,), 4000, FAST)), "paired_t")
    counts = simulated(model, 20_000, 12, seed=5)
    differences = (counts[..., 0] - counts[..., 1]).astype(float)
    nc = differences.mean() / differences.std() * np.sqrt(12)
    critical = stats.t.ppf(0.975, 11)
    expected = stats.nct.sf(critical, 11, nc) + stats.nct.cdf(-critical, 11, nc)
    assert row.power == pytest.approx(expected, abs=0.03)
    assert row.power_interval is not None
    assert row.power_interval.low < row.power < row.power_interval.high


def test_without_a_difference_the_level_holds_and_nothing_is_found_more_often() -> None:
    rows = power_analysis(given_model(0.5, 0.5), Question((8,), 3000, FAST))
    for row in rows:
        limit = 0.05 + 4 * np.sqrt(0.05 * 0.95 / 3000)
        assert row.power < limit
        assert row.false_positives < limit
    assert max(row.false_positives for row in rows_of(rows, "paired_t")) > 0.03


def test_four_people_can_never_reach_5_percent_by_sign_flip() -> None:
    rows = power_analysis(given_model(0.9, 0.1), Question((4,), 500, FAST))
    assert all(row.power == 0 for row in rows_of(rows, "sign_flip"))
    assert all(row.power > 0.9 for row in rows_of(rows, "paired_t"))


def test_more_people_find_more_in_narrower_intervals() -> None:
    rows = rows_of(power_analysis(given_model(0.6, 0.45), Question((6, 12, 24), 1000, FAST)), "sign_flip")
    firsts = [row for row in rows if "25" in row.comparison]
    assert firsts[0].power < firsts[1].power < firsts[2].power
    widths = [row.interval_width for row in firsts if row.interval_width is not None]
    assert widths[0] > widths[1] > widths[2]


def test_each_test_has_the_width_of_its_own_interval() -> None:
    model = given_model(0.6, 0.4)
    rows = power_analysis(model, Question((8,), 50, (*FAST, "mixed_model")))
    t_row, mixed_row = (rows_of(rows, test)[0] for test in ("paired_t", "mixed_model"))
    assert t_row.interval_width is not None
    assert mixed_row.interval_width is not None
    assert t_row.interval_width < 1 < mixed_row.interval_width, "rates, and logits"
    assert t_row.interval != mixed_row.interval


def test_people_without_a_difference_keep_their_slopes() -> None:
    model = given_model(0.8, 0.3)
    generator = np.random.default_rng(2)
    people = model.people(4000, 8, generator)
    null = model.without_difference(people, model.contrasts[0], generator)
    (first,), (second,) = model.contrasts[0].first, model.contrasts[0].second
    slopes = logit(people[..., first]) - logit(people[..., second])
    null_slopes = logit(null[..., 0, 0]) - logit(null[..., 1, 0])
    assert null_slopes.mean() == pytest.approx(0, abs=4 * slopes.std() / np.sqrt(slopes.size))
    assert null_slopes.std() == pytest.approx(slopes.std(), rel=0.02)
    assert null[..., 0, 0].mean() - null[..., 1, 0].mean() == pytest.approx(0, abs=0.01)


def test_the_numbers_do_not_depend_on_the_workers() -> None:
    model, question = given_model(0.6, 0.4), Question((5, 8), 1300, FAST, seed=3)
    alone = power_analysis(model, question, jobs=1)
    assert power_analysis(model, question, jobs=2) == alone
    assert power_analysis(model, Question((5, 8), 1300, FAST, seed=4)) != alone


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_numbers() -> None:
    import joblib
    from distributed import Client, LocalCluster

    model, question = given_model(0.6, 0.4), Question((8,), 1300, FAST)
    cluster = LocalCluster(n_workers=2, processes=False, dashboard_address=None)  # type: ignore[no-untyped-call]
    with cluster, Client(cluster), joblib.parallel_config(backend="dask"):  # type: ignore[no-untyped-call]
        shared = power_analysis(model, question, jobs=-1)
    assert shared == power_analysis(model, question)


def test_the_mixed_model_is_one_of_the_tests() -> None:
    rows = power_analysis(given_model(0.7, 0.35), Question((8,), 25, ("mixed_model",)))
    assert len(rows) == 3
    assert all(0.3 < row.power <= 1 for row in rows)


def test_holm_never_finds_more() -> None:
    rows = power_analysis(given_model(0.6, 0.45), Question((10,), 1000, FAST))
    assert all(row.power_holm <= row.power for row in rows)
    assert any(row.power_holm < row.power for row in rows)


def test_progress_goes_up_to_the_end() -> None:
    told: list[float] = []
    power_analysis(given_model(0.6, 0.4), Question((5, 8), 1000, FAST), progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1


def test_the_assumed_population_answers_as_its_single_participants() -> None:
    """Rates over people drawn as arrays, against people drawn one by one with every trial's own jitter."""
    from autd_trials.participants.population import Presented, detection_probabilities
    from autd_trials.participants.traits import ParticipantTraits

    worn = Presented(1.0, 25.0, ("inner",)), Presented(1.0, 100.0, ("inner", "outer"))
    presented = [*worn, Presented(0.0, 50.0, ())]
    array = detection_probabilities(presented, (4000,), np.random.default_rng(1))
    generator = np.random.default_rng(2)
    singles = np.zeros((800, 3))
    for person in range(len(singles)):
        traits = ParticipantTraits.draw(generator)
        for column, each in enumerate(presented):
            force_mn = traits.force_mn(each.drive, each.layers)
            answers = [traits.answer(force_mn, each.modulation_hz, generator) for _ in range(10)]
            singles[person, column] = np.mean([answer is not None for answer in answers])
    assert singles.mean(axis=0) == pytest.approx(array.mean(axis=0), abs=0.04)
    answers_vary = (array * (1 - array)).mean(axis=0) / 10
    between = np.sqrt(np.maximum(singles.var(axis=0) - answers_vary, 0))
    assert between[:2] == pytest.approx(array[:, :2].std(axis=0), abs=0.04)


def write_rates(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(["modulation_hz,clothing,rate", *lines]) + "\n")
    return path


def test_given_rates_are_read_by_condition(tmp_path: Path) -> None:
    lines = [f"{hz},{worn},0.{hz // 25}" for hz in (25, 50, 100) for worn in ("inner", "inner_outer")]
    rates = read_rates(write_rates(tmp_path / "r.csv", lines), protocol_design(chest()))
    assert rates[("modulation_hz", 50.0), ("clothing", "inner")] == 0.2
    model = study_model(chest(), rates, (0.0, 0.0))
    counts = simulated(model, 500, 8, seed=1)
    assert counts.mean(axis=(0, 1)) / 10 == pytest.approx([0.1, 0.1, 0.2, 0.2, 0.4, 0.4], abs=0.01)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["25,inner,0.5"], "no rate for modulation_hz 25, clothing inner_outer; "),
        (["26,inner,0.5"], r"r\.csv:2: modulation_hz is '26'"),
        (["25,inner,1"], r"r\.csv:2: rate is '1'"),
        (["25,inner,x"], r"r\.csv:2: rate is 'x'"),
        (["25,inner,0.5", "25,inner,0.6"], r"r\.csv:3: modulation_hz 25, clothing inner has a rate already"),
    ],
)
def test_wrong_rates_are_told(tmp_path: Path, lines: list[str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        read_rates(write_rates(tmp_path / "r.csv", lines), protocol_design(chest()))


def test_a_protocol_without_comparisons_and_unknown_clothing_are_refused() -> None:
    with pytest.raises(UsageError, match="plans no comparison"):
        study_model(chest(comparisons=()), None, (0, 0))
    coat = Comparison(factor="clothing", first="inner", second="coat", at_each=None)
    with pytest.raises(UsageError, match="how much clothing 'coat' lets through"):
        study_model(chest(between={"clothing": ("inner", "coat")}, comparisons=(coat,)), None, (0, 0))
