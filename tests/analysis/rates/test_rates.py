"""Rates per participant and over participants, and what is undefined."""

import statistics
from collections.abc import Mapping
from fractions import Fraction

import pytest
from autd_analysis.data.trials import read_trials
from autd_analysis.rates import RATES
from autd_analysis.rates.numbers import detection_rates, false_alarm_rates, marginal_rates, over_participants
from autd_analysis.study import analyse
from scipy import stats

from autd_trials.protocol.schema import Level
from autd_trials.testing.recorded import Answer, StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_protocol


def test_rates_are_those_that_were_written(chest: StudyWriter) -> None:
    rates = detection_rates(read_trials(chest.folder))
    assert len(rates) == 8 * 6
    for rate in rates:
        levels = dict(rate.condition)
        cell = ("inner", "inner_outer").index(str(levels["clothing"])) * 3
        cell += (25.0, 50.0, 100.0).index(float(levels["modulation_hz"]))
        felt = CHEST_COUNTS[int(rate.participant) - 1][cell]
        assert (rate.felt, rate.n, rate.rate) == (felt, 10, Fraction(felt, 10))
        assert rate.interval is not None
        assert rate.interval.low <= felt / 10 <= rate.interval.high


def test_over_participants_is_the_mean_of_their_rates_with_a_t_interval(chest: StudyWriter) -> None:
    rates = over_participants(detection_rates(read_trials(chest.folder)))
    inner_25 = rates[0]
    values = [counts[0] / 10 for counts in CHEST_COUNTS]
    low, high = stats.t.interval(0.95, 7, loc=statistics.fmean(values), scale=stats.sem(values))
    assert inner_25.condition == (("modulation_hz", 25.0), ("clothing", "inner"))
    assert inner_25.mean == pytest.approx(statistics.fmean(values))
    assert inner_25.interval is not None
    assert (inner_25.interval.low, inner_25.interval.high) == pytest.approx((low, high))
    assert (inner_25.participants, inner_25.felt, inner_25.n) == (8, sum(c[0] for c in CHEST_COUNTS), 80)


def test_participants_count_the_same_whatever_their_number_of_trials(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(within={}, between={}, comparisons=(), repetitions=10)
    writer.add("01", lambda conditions, repetition: True)
    writer.add("02", lambda conditions, repetition: False, trials=2)
    (rate,) = over_participants(detection_rates(read_trials(writer.folder)))
    assert rate.mean == 0.5
    assert (rate.felt, rate.n) == (10, 12)


@pytest.mark.parametrize("felt", [True, False])
def test_all_felt_or_none_has_no_interval_over_participants(writer: StudyWriter, felt: bool) -> None:
    for participant in ("01", "02", "03"):
        writer.add(participant, lambda conditions, repetition: felt)
    results = analyse(writer.folder)
    assert all(rate.mean == float(felt) and rate.interval is None for rate in results[RATES].conditions)
    for one in results[RATES].participants:
        assert one.interval is not None
        assert one.interval.high - one.interval.low == pytest.approx(0.2775, abs=1e-4)


def test_a_missing_cell_has_no_rate_and_is_not_zero(writer: StudyWriter) -> None:
    writer.add("01", lambda conditions, repetition: True)
    writer.add("02", lambda conditions, repetition: True, trials=30)
    rates = detection_rates(read_trials(writer.folder))
    missing = [rate for rate in rates if rate.n == 0]
    assert len(missing) == 3
    assert all(rate.rate is None and rate.interval is None for rate in missing)
    assert [rate.participants for rate in over_participants(rates)] == [2, 1, 2, 1, 2, 1]


def test_one_trial_is_enough_for_a_rate(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(within={}, between={}, comparisons=(), repetitions=1)
    writer.add("01", lambda conditions, repetition: True)
    results = analyse(writer.folder)
    (rate,) = results[RATES].conditions
    assert (rate.mean, rate.interval, rate.participants) == (1.0, None, 1)
    (one,) = results[RATES].participants
    assert one.interval is not None
    assert one.interval.low == pytest.approx(0.2065, abs=1e-4)


def test_without_catch_trials_the_false_alarm_rate_is_undefined(chest: StudyWriter) -> None:
    assert false_alarm_rates(read_trials(chest.folder)) is None
    results = analyse(chest.folder)
    assert results[RATES].false_alarms is None
    assert results[RATES].participant_false_alarms is None


def with_false_alarms(count: int) -> Answer:
    """All stimuli felt, and so many catch trials of an outer block, twice as many of an inner one."""

    def answer(conditions: Mapping[str, Level | None], repetition: int) -> bool:
        if conditions["modulation_hz"] is not None:
            return True
        return repetition < (2 * count if conditions["clothing"] == "inner" else count)

    return answer


def test_false_alarms_are_counted_per_kind_of_block_and_over_all(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(catch_trials=4)
    writer.add("01", with_false_alarms(1))
    writer.add("02", with_false_alarms(0))
    rates = analyse(writer.folder, only=["rates"])[RATES]
    assert rates.false_alarms is not None
    by_condition = {rate.condition: rate for rate in rates.false_alarms}
    inner, outer, both = (
        by_condition[(("clothing", "inner"),)],
        by_condition[(("clothing", "inner_outer"),)],
        by_condition[()],
    )
    assert (inner.mean, outer.mean, both.mean) == (0.25, 0.125, 0.1875)
    assert (both.felt, both.n) == (3, 16)
    # Catch trials do not touch the detection rates.
    assert all(rate.mean == 1 and rate.n == 20 for rate in rates.conditions)


def test_marginal_rates_weigh_cells_the_same(writer: StudyWriter) -> None:
    # Inner: 60 trials of which all felt at 25 Hz and none elsewhere; one block is cut short.
    writer.add("01", lambda conditions, repetition: conditions["modulation_hz"] == 25.0, trials=32)
    trials = read_trials(writer.folder)
    rates = detection_rates(trials)
    clothing = trials.design.factor("clothing")
    inner, outer = marginal_rates(rates, [clothing])
    assert inner.rate == Fraction(1, 3)
    assert outer.rate is None  # no trial at 100 Hz there
    assert (outer.felt, outer.n) == (1, 2)
    assert marginal_rates(rates, trials.design.factors) == rates
