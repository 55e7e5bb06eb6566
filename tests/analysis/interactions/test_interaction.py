"""Interaction and trend of the planned comparisons."""

import itertools

import numpy as np
import pytest
from autd_analysis.interactions import INTERACTIONS
from autd_analysis.interactions.numbers import Interactions
from autd_analysis.study import analyse
from scipy import stats
from statsmodels.stats.multivariate import test_mvmean as mvmean

from autd_trials.protocol.schema import Comparison
from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol

DIFFERENCES = np.array([[row[cell] - row[cell + 3] for cell in range(3)] for row in CHEST_COUNTS]) / 10


def test_the_chest_studys_interaction_against_statsmodels_and_enumeration(chest: StudyWriter) -> None:
    (found,) = analyse(chest.folder, only=["interactions"])[INTERACTIONS].interactions
    expected = mvmean(DIFFERENCES[:, 1:] - DIFFERENCES[:, :1])
    assert found.f == pytest.approx(float(expected.statistic))
    assert found.f_p == pytest.approx(float(expected.pvalue))
    assert found.t2 == pytest.approx(float(expected.t2))
    assert found.df == (2, 6)
    centred = DIFFERENCES - DIFFERENCES.mean(axis=1, keepdims=True)
    lengths = [((np.array(signs) @ centred) ** 2).sum() for signs in itertools.product((1, -1), repeat=8)]
    assert found.sign_flip_p == pytest.approx(np.mean(np.array(lengths) >= lengths[0] - 1e-12))
    assert found.sign_flip_floor == 2 / 2**8


def test_two_levels_make_it_a_paired_t_test_of_the_difference_of_differences(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(within={"modulation_hz": (25.0, 100.0)})
    for number, row in enumerate(CHEST_COUNTS, start=1):
        wanted = {("inner", 25.0): row[0], ("inner", 100.0): row[2], ("inner_outer", 25.0): row[3]}
        wanted |= {("inner_outer", 100.0): row[5]}
        writer.add(
            f"{number:02}",
            lambda levels, k, wanted=wanted: k < wanted[levels["clothing"], levels["modulation_hz"]],  # type: ignore[misc]
        )
    (found,) = analyse(writer.folder, only=["interactions"])[INTERACTIONS].interactions
    expected = stats.ttest_1samp(DIFFERENCES[:, 2] - DIFFERENCES[:, 0], 0)
    assert found.f == pytest.approx(float(expected.statistic) ** 2)
    assert found.f_p == pytest.approx(float(expected.pvalue))


def test_the_trend_is_the_mean_slope_over_octaves(chest: StudyWriter) -> None:
    (found,) = analyse(chest.folder, only=["interactions"])[INTERACTIONS].trends
    slopes = [np.polyfit(np.log2([25, 50, 100]), row, 1)[0] for row in DIFFERENCES]
    expected = stats.ttest_1samp(slopes, 0)
    assert found.unit == "octave"
    assert found.mean == pytest.approx(np.mean(slopes))
    assert found.paired_t is not None
    assert found.paired_t.p == pytest.approx(float(expected.pvalue))
    assert found.interval is not None
    interval = expected.confidence_interval(0.95)
    assert (found.interval.low, found.interval.high) == pytest.approx((interval.low, interval.high))


def of_everybody(writer: StudyWriter, counts: tuple[int, ...], people: int) -> Interactions:
    for number in range(1, people + 1):
        writer.add(f"{number:02}", chest_answer(counts))
    return analyse(writer.folder, only=["interactions"])[INTERACTIONS]


def test_people_without_any_interaction_show_none(writer: StudyWriter) -> None:
    (found,) = of_everybody(writer, (8, 9, 10, 5, 6, 7), 6).interactions
    assert (found.f, found.f_p) == (None, None)
    assert found.sign_flip_p == 1


def test_too_few_people_are_not_tested(writer: StudyWriter) -> None:
    results = of_everybody(writer, (8, 9, 10, 5, 6, 7), 1)
    assert (results.interactions[0].f_p, results.interactions[0].sign_flip_p) == (None, None)
    assert results.trends[0].interval is None


def test_a_comparison_over_all_levels_has_neither(writer: StudyWriter) -> None:
    overall = Comparison(factor="clothing", first="inner", second="inner_outer")
    writer.protocol = chest_protocol(comparisons=(overall,))
    results = of_everybody(writer, (8, 9, 10, 5, 6, 7), 3)
    assert results.interactions == ()
    assert results.trends == ()


def test_people_who_share_an_interaction_have_no_f_and_an_exact_p(writer: StudyWriter) -> None:
    """All of six people the same: their contrasts do not vary, in spite of rounding; 2 of 2^6 patterns."""
    (found,) = of_everybody(writer, (9, 9, 10, 2, 5, 9), 6).interactions
    assert (found.f, found.f_p) == (None, None)
    assert found.sign_flip_p == 2 / 2**6
