"""The planned comparisons of a study."""

from fractions import Fraction

import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.study import analyse
from scipy import stats
from statsmodels.stats.multitest import multipletests

from autd_trials.protocol.schema import Comparison
from autd_trials.testing.recorded import Answer, StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol


def test_the_chest_study_against_scipy_and_statsmodels(chest: StudyWriter) -> None:
    results = analyse(chest.folder, only=["comparisons"])[COMPARISONS]
    assert [result.contrast.at for result in results] == [
        (("modulation_hz", hz),) for hz in (25.0, 50.0, 100.0)
    ]
    expected_p = []
    for cell, result in enumerate(results):
        inner = [counts[cell] / 10 for counts in CHEST_COUNTS]
        outer = [counts[cell + 3] / 10 for counts in CHEST_COUNTS]
        expected = stats.ttest_rel(inner, outer)
        low, high = expected.confidence_interval(0.95)
        expected_p.append(float(expected.pvalue))
        assert result.paired_t is not None
        assert result.paired_t.t == pytest.approx(float(expected.statistic))
        assert result.paired_t.p == pytest.approx(float(expected.pvalue))
        assert result.interval is not None
        assert (result.interval.low, result.interval.high) == pytest.approx((low, high))
        assert result.mean == pytest.approx(sum(inner) / 8 - sum(outer) / 8)
        assert result.sign_flip is not None
        assert result.sign_flip.p == result.sign_flip.floor == 2 / 256
        assert result.sign_flip_holm == 3 * 2 / 256
        assert (result.sign_flip_tests, result.paired_t_tests) == (3, 3)
    adjusted = [result.paired_t_holm for result in results]
    assert adjusted == pytest.approx(list(multipletests(expected_p, method="holm")[1]))


def test_the_difference_is_first_minus_second(writer: StudyWriter) -> None:
    backwards = Comparison(factor="clothing", first="inner_outer", second="inner", at_each="modulation_hz")
    writer.protocol = chest_protocol(comparisons=(backwards,))
    writer.add("01", chest_answer(CHEST_COUNTS[0]))
    result = analyse(writer.folder, only=["comparisons"])[COMPARISONS][0]
    (difference,) = result.differences
    assert (difference.participant, difference.value) == ("01", Fraction(1, 10) - Fraction(5, 10))
    assert result.mean == pytest.approx(-0.4)


def constant(inner: int, outer: int) -> Answer:
    return chest_answer((inner, inner, inner, outer, outer, outer))


def test_constant_differences_are_not_testable_by_t(writer: StudyWriter) -> None:
    for participant in range(1, 6):
        writer.add(f"{participant:02}", constant(8, 3))
    for result in analyse(writer.folder, only=["comparisons"])[COMPARISONS]:
        assert result.mean == 0.5
        assert result.paired_t is None
        assert result.paired_t_holm is None
        assert result.paired_t_tests == 0
        assert result.interval is None
        assert result.sign_flip is not None
        assert result.sign_flip.p == 2 / 32
        assert any("t test and the t interval are not defined" in note for note in result.notes)


def test_no_difference_at_all(writer: StudyWriter) -> None:
    for participant in range(1, 5):
        writer.add(f"{participant:02}", constant(participant, participant))
    for result in analyse(writer.folder, only=["comparisons"])[COMPARISONS]:
        assert result.mean == 0
        assert result.sign_flip is not None
        assert (result.sign_flip.p, result.sign_flip.floor) == (1, 1)
        assert result.sign_flip_holm == 1
        assert result.paired_t is None


def test_one_participant_is_not_testable(writer: StudyWriter) -> None:
    writer.add("01", constant(8, 3))
    for result in analyse(writer.folder, only=["comparisons"])[COMPARISONS]:
        assert result.participants == 1
        assert result.mean == 0.5
        assert (result.sd, result.interval, result.sign_flip, result.paired_t) == (None,) * 4
        assert result.notes == ("not testable with 1 participant(s)",)


def test_tests_that_cannot_be_made_do_not_count_in_holm(writer: StudyWriter) -> None:
    # At 25 Hz all differences are equal, so that only two t tests remain.
    for participant, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(f"{participant:02}", chest_answer((5, *counts[1:3], 2, *counts[4:])))
    at_25, at_50, at_100 = analyse(writer.folder, only=["comparisons"])[COMPARISONS]
    assert at_25.paired_t is None
    assert at_50.paired_t is not None
    assert at_100.paired_t is not None
    assert (at_50.paired_t_tests, at_50.sign_flip_tests) == (2, 3)
    assert at_50.paired_t_holm == pytest.approx(2 * at_50.paired_t.p)
    assert at_100.paired_t_holm == pytest.approx(at_100.paired_t.p)


def test_participants_without_both_rates_are_left_out_and_named(writer: StudyWriter) -> None:
    for participant, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(f"{participant:02}", chest_answer(counts), trials=31 if participant == 3 else None)
    at_25, at_50, at_100 = analyse(writer.folder, only=["comparisons"])[COMPARISONS]
    assert at_25.participants == 8
    assert (at_50.participants, at_100.participants) == (7, 7)
    assert at_50.notes[0] == "without a rate in both conditions: sub-03"
    assert "03" not in {difference.participant for difference in at_50.differences}


def test_nobody_with_both_rates(writer: StudyWriter) -> None:
    for participant in ("01", "02"):
        writer.add(participant, constant(8, 3), trials=30)
    for result in analyse(writer.folder, only=["comparisons"])[COMPARISONS]:
        assert result.participants == 0
        assert (result.mean, result.sign_flip, result.paired_t) == (None,) * 3


def test_a_comparison_over_all_levels_averages_the_cells(writer: StudyWriter) -> None:
    overall = Comparison(factor="clothing", first="inner", second="inner_outer")
    writer.protocol = chest_protocol(comparisons=(overall,))
    for participant, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(f"{participant:02}", chest_answer(counts))
    (result,) = analyse(writer.folder, only=["comparisons"])[COMPARISONS]
    assert result.contrast.at == ()
    for difference in result.differences:
        counts = CHEST_COUNTS[int(difference.participant) - 1]
        assert difference.value == Fraction(sum(counts[:3]) - sum(counts[3:]), 30)


def test_one_family_over_several_planned_comparisons(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(
        comparisons=(
            Comparison(factor="clothing", first="inner", second="inner_outer", at_each="modulation_hz"),
            Comparison(factor="modulation_hz", first=100.0, second=25.0, at_each="clothing"),
        )
    )
    for participant, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(f"{participant:02}", chest_answer(counts))
    results = analyse(writer.folder, only=["comparisons"])[COMPARISONS]
    assert len(results) == 5

    def p(result: ComparisonResult) -> float:
        assert result.paired_t is not None
        return result.paired_t.p

    adjusted = list(multipletests([p(result) for result in results], method="holm")[1])
    assert [result.paired_t_holm for result in results] == pytest.approx(adjusted)
    assert all(result.paired_t_tests == 5 for result in results)
