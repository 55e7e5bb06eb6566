"""Thresholds of adaptive studies: of simulated people whose thresholds are known, and of tracks by hand."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.data.trials import Trials, read_trials
from autd_analysis.detectability import DETECTABILITY
from autd_analysis.interactions import INTERACTIONS
from autd_analysis.models import MODELS
from autd_analysis.order import ORDER
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.writing import write_results
from autd_analysis.results import Results
from autd_analysis.sensitivity import SENSITIVITY
from autd_analysis.study import analyse
from autd_analysis.subject import Subject
from autd_analysis.thresholds import THRESHOLDS
from autd_analysis.thresholds.comparisons import compared_thresholds
from autd_analysis.thresholds.numbers import Threshold, over_participants, thresholds
from scipy import stats

from autd_trials.cli import main
from autd_trials.errors import UsageError
from autd_trials.participants.simulated import SimulatedParticipant
from autd_trials.participants.traits import FULL_DRIVE_FORCE_MN
from autd_trials.protocol.method import Range, Staircase
from autd_trials.protocol.schema import Comparison
from autd_trials.session.events import SessionStart

STAIRCASE = Staircase(
    kind="staircase", varies="drive", range=Range(smallest=0.125, largest=1.0, levels=4), start=1.0
)
CLOTHING = StudyFactor("clothing", ("inner", "both"), {}, within_block=False)
HZ = StudyFactor("modulation_hz", (50.0, 100.0), {}, within_block=True)
COMPARISON = Comparison(factor="clothing", first="inner", second="both", at_each="modulation_hz")
DESIGN = Design("made", None, (HZ, CLOTHING), (COMPARISON,), STAIRCASE)


def trials_of(tracks: list[tuple[str, str, float, str, str]]) -> Trials:
    """Trials from (participant, session, Hz, clothing, answers as + and -), at a staircase's levels."""
    rows = []
    for participant, session, hz, clothing, felt in tracks:
        place = 3
        for number, answer in enumerate(felt):
            rows.append(
                {
                    "participant": participant,
                    "session": session,
                    "trial": number,
                    "trial_type": "stimulus",
                    "felt": answer == "+",
                    "used": True,
                    "modulation_hz": hz,
                    "clothing": clothing,
                    "drive": STAIRCASE.levels[place],
                }
            )
            place = max(0, place - 1) if answer == "+" else min(3, place + 1)
    return Trials(DESIGN, pd.DataFrame(rows), simulated=True, warnings=(), inputs=())


def made(db: dict[str, float | int]) -> list[Threshold]:
    """Thresholds in dB by "participant clothing Hz"; +1 and -1 (whole numbers) lie beyond the levels."""
    found = []
    for name, value in db.items():
        participant, clothing, hz = name.split()
        beyond = value if isinstance(value, int) else 0
        found.append(
            Threshold(
                participant=participant,
                condition=(("modulation_hz", float(hz)), ("clothing", clothing)),
                threshold=None if beyond else 10 ** (value / 20),
                rate=0.5,
                spread_db=None,
                trials=40,
                beyond=beyond,
                note=None,
            )
        )
    return found


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped threshold study over 8 simulated participants."""
    folder = tmp_path_factory.mktemp("threshold")
    assert main(["run", "chest-threshold", "--simulate", "8", "--seed", "1", "--data", str(folder)]) == 0
    return folder / "chest-threshold"


@pytest.fixture(scope="module")
def results(study: Path) -> Results:
    """Its results."""
    return analyse(study)


def true_db(start: SessionStart, hz: float) -> float:
    """Return the drive in dB at which a simulated participant's stimulus is felt half the time, by the model.

    With jitter and guesses aside d' equals the criterion there.
    """
    from datetime import UTC, datetime

    from autd_trials.clock import VirtualClock

    plan = start.plan
    person = SimulatedParticipant(
        VirtualClock(datetime.now(UTC)), seed=plan.seed, place=plan.place, session=plan.session
    )
    traits = person.traits
    force_mn = traits.criterion * traits.threshold_mn(hz) / 1.65
    return 10 * math.log10(force_mn / (FULL_DRIVE_FORCE_MN * 10 ** (traits.inner_loss_db / 10)))


def test_simulated_peoples_thresholds_are_found(study: Path, results: Results) -> None:
    """Within 3 of the posterior's standard deviations in every track, and without bias over them.

    A Weibull function is fitted to a normal one with a guess rate of its own, so a small bias is allowed.
    """
    from autd_analysis.data.sessions import read_sessions

    starts = {session.start.participant: session.start for session in read_sessions(study)[0]}
    errors = []
    for found in results[THRESHOLDS].participants:
        hz = dict(found.condition)["modulation_hz"]
        assert isinstance(hz, float)
        if found.db is not None:
            errors.append((found.db - true_db(starts[found.participant], hz), found.spread_db))
    assert len(errors) > 10
    assert all(spread is not None and abs(error) < 3 * spread for error, spread in errors)
    assert abs(np.mean([error for error, _ in errors])) < 0.75
    for found in results[THRESHOLDS].participants:
        if found.beyond == 1:
            assert true_db(starts[found.participant], 50.0) > -2


def test_the_studys_rates_are_not_compared_and_it_says_why(results: Results) -> None:
    without: tuple[Subject[Any], ...] = (COMPARISONS, INTERACTIONS, ORDER, DETECTABILITY, MODELS, SENSITIVITY)
    for subject in without:
        assert results.get(subject) is None
        assert "adaptive method" in getattr(results, subject.name).summary
    assert any("compare thresholds, not rates" in warning for warning in results.remarks)
    (comparison,) = results[THRESHOLDS].comparisons
    assert comparison.higher_first >= 6, "the model needs twice the force at 50 Hz"
    assert comparison.higher_second == 0
    assert comparison.interval is not None
    assert comparison.interval.low < 10 * math.log10(2) < comparison.interval.high


def test_the_tables_have_every_track(results: Results, tmp_path: Path) -> None:
    write_results(results, tmp_path, FigureOptions(formats=("svg",)))
    lines = (tmp_path / "thresholds_by_participant.tsv").read_text().splitlines()
    assert len(lines) == 1 + 8 * 2
    assert len((tmp_path / "thresholds.tsv").read_text().splitlines()) == 1 + 2
    assert len((tmp_path / "threshold_comparisons.tsv").read_text().splitlines()) == 1 + 1


def test_power_is_not_simulated_for_it() -> None:
    from autd_analysis.power.model import study_model

    from autd_trials.protocol.load import find_protocol, load_protocol

    with pytest.raises(UsageError, match="chosen by an adaptive method"):
        study_model(load_protocol(find_protocol("chest-threshold")), None, (0, 0))


def test_a_level_that_is_no_number_is_refused_with_its_line(study: Path) -> None:
    table = next(study.glob("sub-sim01/ses-01/beh/*_events.tsv"))
    text = table.read_text()
    lines = text.splitlines()
    column = lines[0].split("\t").index("drive")
    row = next(n for n, line in enumerate(lines) if "\tstimulus\t" in line)
    cells = lines[row].split("\t")
    cells[column] = "much"
    lines[row] = "\t".join(cells)
    table.write_text("\n".join(lines) + "\n")
    try:
        with pytest.raises(UsageError, match=rf"events\.tsv:{row + 1}: drive is 'much'"):
            read_trials(study)
    finally:
        table.write_text(text)


def found_in(trials: Trials) -> tuple[Threshold, ...]:
    assert trials.design.method is not None
    return thresholds(trials, trials.design.method)


def test_sessions_are_averaged_in_db_and_a_track_is_one_sessions() -> None:
    felt = "++-+-+-"  # turns at 1/4, 1/2, 1/4, 1/2, 1/4; the first is left out
    high = "+-+-+-"  # turns at 1/2, 1, 1/2, 1, 1/2
    found = found_in(trials_of([("1", "01", 50.0, "inner", felt), ("1", "02", 50.0, "inner", high)]))
    told = [each for each in found if each.trials]
    assert [each.trials for each in told] == [13]
    assert told[0].db == pytest.approx(20 * (7 * math.log10(1 / 8) / 2 + 6 * math.log10(1 / 2) / 2) / 13)
    assert [each.note for each in found if not each.trials] == [
        "0 reversals with the final steps; a threshold needs 4"
    ] * 3


def test_a_session_that_was_broken_off_hides_no_threshold_of_another() -> None:
    whole = found_in(trials_of([("1", "01", 50.0, "inner", "+-+-+-")]))
    found = found_in(trials_of([("1", "01", 50.0, "inner", "+-+-+-"), ("1", "02", 50.0, "inner", "+")]))
    assert found[0].threshold == whole[0].threshold
    assert found[0].note is not None
    assert "1 session(s) that determine no threshold are excluded" in found[0].note


def test_a_run_without_a_threshold_is_counted_as_undetermined() -> None:
    found = found_in(trials_of([("1", "01", 50.0, "inner", "+-+-+-"), ("2", "01", 50.0, "inner", "++++")]))
    (group,) = (each for each in over_participants(found) if each.participants)
    assert (group.participants, group.undetermined) == (1, 1)
    assert group.interval is None


def test_differences_are_tested_as_by_scipy() -> None:
    inner, both = [-9.0, -7.5, -6.0, -8.0, -4.0], [-5.0, -4.0, -4.5, -2.0, -3.0]
    found = made(
        {f"{n} inner 50": value for n, value in enumerate(inner)}
        | {f"{n} both 50": value for n, value in enumerate(both)}
    )
    at_50, at_100 = compared_thresholds(found, DESIGN)
    expected = stats.ttest_rel(inner, both)
    assert at_50.paired_t is not None
    assert at_50.paired_t.t == pytest.approx(expected.statistic)
    assert at_50.paired_t.p == pytest.approx(expected.pvalue)
    interval = expected.confidence_interval()
    assert at_50.interval is not None
    assert (at_50.interval.low, at_50.interval.high) == pytest.approx((interval.low, interval.high))
    assert at_50.mean_db == pytest.approx(np.mean(np.subtract(inner, both)))
    assert at_50.sign_flip is not None
    assert at_50.sign_flip.p == 2 / 2**5
    assert at_50.sign_p == pytest.approx(stats.binomtest(0, 5).pvalue)
    assert at_50.paired_t_holm == 2 * at_50.paired_t.p, "two were planned, though one could not be tested"
    assert (at_100.mean_db, at_100.paired_t, at_100.sign_p) == (None, None, None)


def test_a_threshold_beyond_the_levels_is_higher_than_one_that_is_told() -> None:
    found = made(
        {
            "1 inner 50": -6.0,
            "1 both 50": 1,  # over the largest: both is higher
            "2 inner 50": -1,
            "2 both 50": -3.0,  # under the smallest: both is higher
            "3 inner 50": 1,
            "3 both 50": 1,  # not known
            "4 inner 50": -2.0,
            "4 both 50": -4.0,
            "5 inner 50": -1,
            "5 both 50": 1,
        }
    )
    at_50 = compared_thresholds(found, DESIGN)[0]
    assert (at_50.higher_first, at_50.higher_second) == (1, 3)
    assert at_50.sign_p == pytest.approx(stats.binomtest(1, 4).pvalue)
    assert [participant for participant, _ in at_50.differences_db] == ["4"]
    assert at_50.undetermined == 4


def test_equal_thresholds_are_not_testable() -> None:
    found = made({f"{n} {wear} 50": -3.0 for n in range(4) for wear in ("inner", "both")})
    at_50 = compared_thresholds(found, DESIGN)[0]
    assert at_50.mean_db == 0
    assert at_50.paired_t is None
    assert at_50.interval is None
    assert at_50.sign_p is None


def test_many_participants_have_an_exact_test() -> None:
    """24 of 24 higher: no sum of the 2^24 sign patterns is larger, and one other is as large."""
    found = made(
        {f"{n} inner 50": -3.0 - n / 7 for n in range(24)} | {f"{n} both 50": -9.0 - n / 3 for n in range(24)}
    )
    at_50 = compared_thresholds(found, DESIGN)[0]
    assert at_50.sign_flip is not None
    assert at_50.sign_flip.p == 2 / 2**24
