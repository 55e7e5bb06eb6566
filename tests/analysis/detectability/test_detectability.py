"""d' and criterion."""

from fractions import Fraction

import numpy as np
import pytest
from autd_analysis.detectability.numbers import detectability, over_participants
from autd_analysis.rates.numbers import ParticipantRate
from autd_analysis.study import analyse
from scipy.stats import norm

from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import chest_protocol


def rate(participant: str, felt: int, n: int, **condition: str) -> ParticipantRate:
    its_rate = Fraction(felt, n) if n else None
    return ParticipantRate(participant, tuple(condition.items()), felt, n, its_rate, None)


def test_d_prime_has_the_log_linear_correction() -> None:
    """Hautus (1995): (hits + 1/2) / (n + 1), (false alarms + 1/2) / (m + 1)."""
    (found,) = (
        detectability([rate("01", 8, 10, clothing="inner")], [rate("01", 1, 6, clothing="inner")]) or ()
    )
    z_hit, z_false = norm.ppf(8.5 / 11), norm.ppf(1.5 / 7)
    assert found.d_prime == pytest.approx(z_hit - z_false)
    assert found.criterion == pytest.approx(-(z_hit + z_false) / 2)
    variance = (8.5 / 11) * (2.5 / 11) / (10 * norm.pdf(z_hit) ** 2)
    variance += (1.5 / 7) * (5.5 / 7) / (6 * norm.pdf(z_false) ** 2)
    assert found.standard_error == pytest.approx(variance**0.5)


@pytest.mark.parametrize(("hits", "false_alarms", "sign"), [(10, 0, 1), (0, 6, -1), (5, 3, 0)])
def test_rates_of_zero_and_one_stay_finite(hits: int, false_alarms: int, sign: int) -> None:
    (found,) = detectability([rate("01", hits, 10)], [rate("01", false_alarms, 6)]) or ()
    assert sign * found.d_prime > 0 if sign else abs(found.d_prime) < 1e-9


def test_intervals_are_those_of_the_spread_of_repeated_studies() -> None:
    """Of d' and of the criterion, over 4000 simulated participants with 60 stimuli and 60 catch trials."""
    generator = np.random.default_rng(4)
    hits, alarms = generator.binomial(60, norm.cdf(0.8), 4000), generator.binomial(60, norm.cdf(-0.7), 4000)
    found = detectability(
        [rate(str(number), int(count), 60) for number, count in enumerate(hits)],
        [rate(str(number), int(count), 60) for number, count in enumerate(alarms)],
    )
    assert found is not None
    covered = np.mean([each.interval.low <= 1.5 <= each.interval.high for each in found])
    assert 0.93 < covered < 0.975
    criterion = np.mean(
        [each.criterion_interval.low <= -0.05 <= each.criterion_interval.high for each in found]
    )
    assert 0.93 < criterion < 0.975
    assert {(each.stimuli, each.catch_trials) for each in found} == {(60, 60)}


def test_conditions_go_with_the_catch_trials_of_their_block() -> None:
    rates = [rate("01", 8, 10, clothing=clothing, modulation_hz="25") for clothing in ("inner", "both")]
    catch = [rate("01", 0, 6, clothing="inner"), rate("01", 6, 6, clothing="both")]
    inner, both = detectability(rates, catch) or ()
    assert inner.d_prime > 1 > 0 > both.d_prime


def test_who_lacks_trials_is_left_out_and_without_catch_trials_nothing_is_defined() -> None:
    rates = [rate("01", 8, 10), rate("02", 0, 0), rate("03", 5, 10)]
    catch = [rate("01", 1, 6), rate("02", 1, 6), rate("03", 0, 0)]
    found = detectability(rates, catch)
    assert [each.participant for each in found or ()] == ["01"]
    assert detectability(rates, None) is None


def test_means_over_participants() -> None:
    found = detectability([rate("01", 8, 10), rate("02", 5, 10)], [rate("01", 1, 6), rate("02", 1, 6)]) or ()
    (group,) = over_participants(found)
    assert group.d_prime == pytest.approx((found[0].d_prime + found[1].d_prime) / 2)
    assert group.participants == 2
    assert group.interval is not None


def test_a_study_without_catch_trials_says_undefined_and_one_with_them_gives_d_prime(
    writer: StudyWriter,
) -> None:
    writer.add("01", lambda _condition, repetition: repetition < 5)
    tables = {table.name: table for table in analyse(writer.folder).tables}
    (row,) = tables["detectability"].rows
    assert "no catch trials" in str(row["notes"])


def test_a_study_with_catch_trials_gives_d_prime_in_every_condition(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(catch_trials=6)
    writer.add(
        "01", lambda condition, repetition: condition.get("modulation_hz") is not None and repetition < 8
    )
    tables = {table.name: table for table in analyse(writer.folder).tables}
    rows = tables["detectability_by_participant"].rows
    assert len(rows) == 6
    assert all(float(str(row["d_prime"])) > 0 for row in rows)
