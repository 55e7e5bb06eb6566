"""The pooled tests against R, SciPy, statsmodels, and by hand; and that they are warned of."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from autd_analysis.sensitivity import SENSITIVITY
from autd_analysis.sensitivity.pooled import (
    Stratum,
    chi_squared_p,
    cmh_exact_p,
    cmh_p,
    common_odds_ratio,
    mcnemar_p,
)
from autd_analysis.study import analyse
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.contingency_tables import StratifiedTable, mcnemar

from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol

REFERENCE = Path(__file__).parents[1] / "reference" / "tables.csv"  # R 4.2.2, mantelhaen.test


def r_strata() -> dict[str, tuple[list[Stratum], dict[str, float]]]:
    found: dict[str, tuple[list[Stratum], dict[str, float]]] = {}
    with REFERENCE.open(newline="") as file:
        for row in csv.DictReader(file):
            strata, values = found.setdefault(row["study"], ([], {}))
            first = int(row["first_felt"]), int(row["first_n"])
            strata.append((first, (int(row["second_felt"]), int(row["second_n"]))))
            values |= {name: float(row[name]) for name in ("cmh_p", "exact_p", "odds_ratio", "low", "high")}
    return found


@pytest.mark.parametrize("study", ["chest", "small", "equal"])
def test_cmh_equals_r(study: str) -> None:
    strata, expected = r_strata()[study]
    assert cmh_p(strata) == pytest.approx(expected["cmh_p"], rel=1e-6)
    assert cmh_exact_p(strata) == pytest.approx(expected["exact_p"], rel=1e-6)


counts = st.integers(1, 12).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(counts, counts)
@settings(max_examples=100, deadline=None)
def test_one_stratum_is_fishers_test_and_chi_squared_is_scipys(
    first: tuple[int, int], second: tuple[int, int]
) -> None:
    table = np.array([[first[0], first[1] - first[0]], [second[0], second[1] - second[0]]])
    exact, chi = cmh_exact_p([(first, second)]), chi_squared_p((first, second))
    if 0 < first[0] + second[0] < first[1] + second[1]:
        assert exact == pytest.approx(stats.fisher_exact(table).pvalue, rel=1e-9)
        assert chi == pytest.approx(stats.chi2_contingency(table, correction=False).pvalue, rel=1e-9)
    else:
        assert exact is None
        assert chi is None


@given(st.lists(st.tuples(counts, counts), min_size=1, max_size=6))
@settings(max_examples=100, deadline=None)
def test_the_common_odds_ratio_and_its_interval_are_statsmodels(strata: list[Stratum]) -> None:
    ratio, interval = common_odds_ratio(strata)
    if ratio is None or interval is None:
        return
    tables = [np.array([[a, n - a], [b, m - b]], float) for (a, n), (b, m) in strata]
    expected = StratifiedTable(tables)
    assert ratio == pytest.approx(float(expected.oddsratio_pooled))
    assert (interval.low, interval.high) == pytest.approx(
        tuple(map(float, expected.oddsratio_pooled_confint()))
    )


@given(st.integers(0, 15), st.integers(0, 15))
@settings(max_examples=60, deadline=None)
def test_mcnemar_equals_statsmodels_and_mid_p_its_definition(only_first: int, only_second: int) -> None:
    found = mcnemar_p(only_first, only_second)
    if only_first + only_second == 0:
        assert found is None
        return
    assert found is not None
    exact = mcnemar(np.array([[3, only_first], [only_second, 4]]), exact=True).pvalue
    assert found[0] == pytest.approx(exact)
    pairs, fewer = only_first + only_second, min(only_first, only_second)
    below = sum(math.comb(pairs, k) for k in range(fewer)) / 2**pairs
    at = math.comb(pairs, fewer) / 2**pairs
    assert found[1] == pytest.approx(min(1 - at * (only_first == only_second), 2 * below + at), abs=1e-9)


def test_mcnemar_published_example() -> None:
    # Fagerland, Lydersen and Laake (2013), table 1 and section "Examples": 1 and 7 discordant pairs give an
    # exact p of .070 and a mid-p of .039.
    found = mcnemar_p(1, 7)
    assert found == pytest.approx((0.0703, 0.0391), abs=5e-5)


def test_a_study_is_pooled_with_a_warning(chest: StudyWriter) -> None:
    results = analyse(chest.folder, only=["sensitivity"])
    (made,) = (table for table in results.tables if table.name == "pooled")
    assert "these p are too small" in made.about
    at_25 = results[SENSITIVITY].pooled[0]
    inner, outer = (sum(row[cell] for row in CHEST_COUNTS) for cell in (0, 3))
    assert (at_25.felt_first, at_25.n_first, at_25.felt_second, at_25.n_second) == (inner, 80, outer, 80)
    table = np.array([[inner, 80 - inner], [outer, 80 - outer]])
    assert at_25.fisher_p == pytest.approx(stats.fisher_exact(table).pvalue)
    assert at_25.odds_ratio_interval is not None
    assert at_25.odds_ratio is not None
    assert at_25.odds_ratio_interval.low < at_25.odds_ratio < at_25.odds_ratio_interval.high
    assert at_25.mcnemar_p is None  # ten answers each, so that there are no pairs


def test_single_answers_are_pairs(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(repetitions=1)
    for number in range(1, 11):
        writer.add(f"{number:02}", chest_answer((1, 1, 1, int(number > 8), 1, int(number == 1))))
    at_25, at_50, _ = analyse(writer.folder, only=["sensitivity"])[SENSITIVITY].pooled
    assert at_25.mcnemar_p == pytest.approx(2 / 2**8)
    assert at_25.mcnemar_mid_p == pytest.approx(1 / 2**8)
    assert at_25.odds_ratio is None
    assert (at_50.mcnemar_p, at_50.cmh_p, at_50.cmh_exact_p, at_50.fisher_p) == (None,) * 4


def test_pooled_tests_find_what_is_not_there_where_people_differ() -> None:
    """What the warning says: with slopes of 0.8 logits over people, more than 5 % of null studies."""
    generator = np.random.default_rng(11)
    found = 0
    studies = 600
    for _ in range(studies):
        people = generator.standard_normal(8)[:, None] + np.outer(generator.normal(0, 0.8, 8), (0.5, -0.5))
        felt = generator.binomial(10, 1 / (1 + np.exp(-people)))
        p = cmh_p([((int(a), 10), (int(b), 10)) for a, b in felt])
        found += p is not None and p < 0.05
    assert found / studies > 0.08
