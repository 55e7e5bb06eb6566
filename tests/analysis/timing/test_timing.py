"""Timing: what is measured, what is only counted, and what virtual time cannot tell."""

import statistics
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from autd_analysis.data.foreign.columns import KNOWN
from autd_analysis.data.foreign.request import TableRequest
from autd_analysis.data.foreign.tables import read_tables
from autd_analysis.data.trials import Trials, read_trials
from autd_analysis.report.figure_options import DEFAULT
from autd_analysis.report.style import figure_style
from autd_analysis.study import analyse
from autd_analysis.timing import TIMING
from autd_analysis.timing.figure import draw_timing
from autd_analysis.timing.numbers import (
    disturbances,
    onset_times,
    response_times,
    response_times_over_participants,
    timing,
)
from autd_analysis.timing.words import timing_sentences

from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer

HEADER = (
    "participant,clothing,trial_type,trial_status,response,response_time,onset_lateness,silent_before,"
    "emitting_after,presses_before_onset,presses_late,underruns"
)
ROWS = (
    "a,inner,stimulus,complete,felt,0.4,0.0002,0.1,0.002,0,0,0",
    "a,inner,stimulus,complete,felt,0.6,0.0010,0.1,0.003,1,0,0",
    "a,inner,stimulus,complete,felt,1.0,0.0011,0.2,0.004,0,2,0",
    "a,outer,stimulus,complete,not_felt,n/a,0.0300,0.3,n/a,0,0,3",
    "b,inner,stimulus,complete,felt,0.5,0.0001,0.1,0.002,0,0,0",
    "b,outer,stimulus,complete,felt,0.9,0.0004,0.1,0.002,0,0,0",
    "b,outer,stimulus,interrupted,n/a,n/a,0.9000,0.1,n/a,5,5,5",
    "b,n/a,catch,complete,felt,0.2,0.8000,0.1,n/a,2,0,0",
    "b,inner,practice,complete,felt,0.1,0.7000,0.1,0.002,4,4,4",
)


def read(tmp_path: Path, rows: Sequence[str] = ROWS, header: str = HEADER) -> Trials:
    path = tmp_path / "trials.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    columns = {name: name for name in header.split(",") if name in KNOWN or name == "clothing"}
    return read_tables([path], TableRequest(columns))


def test_onsets_are_those_of_complete_stimuli(tmp_path: Path) -> None:
    lateness, margin, silent, emitting = onset_times(read(tmp_path))
    assert lateness.values_s == (0.0001, 0.0002, 0.0004, 0.001, 0.0011, 0.03)
    assert (lateness.trials, lateness.late) == (6, 2)
    assert lateness.median_s == pytest.approx(0.0007)
    assert (margin.trials, margin.median_s, margin.note) == (0, None, "not recorded")
    assert (silent.trials, emitting.trials) == (6, 5)


def test_disturbances_are_counted_in_catch_trials_too_but_not_in_practice(tmp_path: Path) -> None:
    before, late, underruns = disturbances(read(tmp_path))
    assert (before.trials, before.trials_with, before.total) == (7, 2, 3)
    assert (late.trials_with, late.total) == (1, 2)
    assert (underruns.trials_with, underruns.total) == (1, 3)


def test_response_times_are_those_of_felt_stimuli(tmp_path: Path) -> None:
    trials = read(tmp_path)
    times = {
        (each.participant, each.condition): each for each in response_times(trials, trials.design.factors)
    }
    inner, outer = (("clothing", "inner"),), (("clothing", "outer"),)
    assert times["a", inner].values_s == (0.4, 0.6, 1.0)
    assert times["a", inner].quartiles_s == pytest.approx(
        statistics.quantiles((0.4, 0.6, 1.0), n=4, method="inclusive")
    )
    assert times["a", outer].quartiles_s is None
    assert times["b", outer].values_s == (0.9,)
    over_inner, over_outer = response_times_over_participants(tuple(times.values()))
    assert over_inner.mean_s == pytest.approx((0.6 + 0.5) / 2)
    assert (over_inner.participants, over_inner.trials) == (2, 4)
    # t(1) quantile 12.706, standard error 0.05
    assert over_inner.interval_s is not None
    assert over_inner.interval_s.high == pytest.approx(0.55 + 12.7062 * 0.05, abs=1e-4)
    assert over_inner.interval_s.low == 0
    assert (over_outer.mean_s, over_outer.interval_s, over_outer.participants) == (0.9, None, 1)


def test_in_words(tmp_path: Path) -> None:
    onsets, bracket, disturbed = timing_sentences(timing(read(tmp_path)))
    assert onsets == "2 of 6 onsets were later than 1 ms; the largest lateness was 30 ms."
    assert bracket == (
        "The array was read back as silent 100 ms before the onset (median) and as emitting 2 ms after it."
    )
    assert disturbed == (
        "In 7 trials: a press before the onset in 2, a press after the response window in 1, a gap in the "
        "masking noise in 1."
    )


def test_virtual_time_says_nothing_of_lateness(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), simulated=True)
    virtual = onset_times(read_trials(writer.folder))[0]
    assert (virtual.trials, virtual.note) == (0, "not measured: the sessions ran in virtual time")
    writer.add("02", chest_answer(CHEST_COUNTS[1]), simulated=False)
    mixed = onset_times(read_trials(writer.folder))[0]
    assert (mixed.trials, mixed.late, mixed.note) == (60, 0, "60 trial(s) in virtual time left out")


def test_a_table_without_any_timing_has_no_figure(tmp_path: Path) -> None:
    trials = read(tmp_path, ["a,inner,felt", "a,outer,not_felt"], "participant,clothing,response")
    results = analyse(trials, only=["timing"])
    assert list(TIMING.figures(results[TIMING], results)) == []
    assert [times.note for times in onset_times(trials)] == ["not recorded"] * 4
    assert all(count.total is None for count in disturbances(trials))
    assert timing_sentences(timing(trials)) == ("Onset lateness was not recorded.",)


def test_the_figure_shows_every_onset_and_every_response_time(tmp_path: Path) -> None:
    trials = read(tmp_path)
    with figure_style():
        figure = draw_timing(timing(trials), trials, DEFAULT)
    lateness, times, _ = figure.axes
    steps = np.asarray(lateness.get_lines()[0].get_xdata(), dtype=float)
    assert sorted(set(steps)) == pytest.approx([0.1, 0.2, 0.4, 1.0, 1.1, 30])
    participants = [sorted(set(np.asarray(line.get_xdata()))) for line in times.get_lines()]
    assert participants == [[0.4, 0.6, 1.0], [0.5, 0.9], [0.4, 0.5, 0.6, 0.9, 1.0]]
    assert "Median response time (s)" in [text.get_text() for text in figure.texts]
    words = " ".join(text.get_text() for text in figure.texts)
    assert "Response times of 5 felt stimuli (n = 2)" in words
    assert "2 of 6 onsets were later than 1 ms" in words
