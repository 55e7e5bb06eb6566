"""The figure of psychometric functions shows everybody, the group, and the threshold's interval."""

from pathlib import Path

import numpy as np
import pytest
from autd_analysis.psychometric import PSYCHOMETRIC
from autd_analysis.psychometric.figure import draw_psychometric
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.report.style import figure_style, save_figure
from autd_analysis.report.writing import write_results
from autd_analysis.results import Results
from autd_analysis.study import analyse
from matplotlib.collections import LineCollection, PathCollection

from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol


@pytest.fixture(scope="module")
def results(recorded_chest: Path) -> Results:
    return analyse(recorded_chest)


def test_a_panel_for_each_clothing_shows_every_rate_with_its_number_of_trials(results: Results) -> None:
    figure = draw_psychometric(results, results[PSYCHOMETRIC][0], DEFAULT)
    panels, strips = figure.axes, [text.get_text() for text in figure.texts]
    assert {"Clothing: inner", "Clothing: inner_outer", "Modulation frequency (Hz)"} < {*strips}
    for first, axes in zip((0, 3), panels, strict=True):
        dots = [each for each in axes.collections if isinstance(each, PathCollection)]
        heights = [np.asarray(each.get_offsets())[:, 1].round(6).tolist() for each in dots]
        assert heights == [[count / 10 for count in counts[first : first + 3]] for counts in CHEST_COUNTS]
        assert {float(size) for each in dots for size in each.get_sizes()} == {16.0}


def test_the_group_has_a_curve_through_its_marker_and_an_interval(results: Results) -> None:
    found = results[PSYCHOMETRIC][0]
    for axes, group in zip(draw_psychometric(results, found, DEFAULT).axes, found.groups, strict=True):
        assert group.mixed is not None
        (thick,) = [line for line in axes.lines if line.get_linewidth() == 2]
        (marker,) = [line for line in axes.lines if line.get_markersize() == 7]
        x, y = float(marker.get_xdata()[0]), float(marker.get_ydata()[0])  # type: ignore[index,arg-type]
        assert x == pytest.approx(group.mixed.threshold)
        assert y == pytest.approx(0.49)  # halfway between a guess rate of 0 and a lapse rate of 0.02
        curve_x, curve_y = (np.asarray(each, float) for each in thick.get_data())
        assert np.interp(x, curve_x, curve_y) == pytest.approx(y, abs=0.005)
        (bar,) = [each for each in axes.collections if isinstance(each, LineCollection)]
        ends = np.asarray(bar.get_segments()[0])[:, 0]
        low, high = axes.get_xlim()
        assert group.mixed.interval.low is not None
        assert group.mixed.interval.high is not None
        assert ends == pytest.approx(
            [max(low, group.mixed.interval.low), min(high, group.mixed.interval.high)]
        )


def test_only_functions_that_answers_tell_are_drawn(results: Results) -> None:
    found = results[PSYCHOMETRIC][0]
    for axes, group in zip(draw_psychometric(results, found, DEFAULT).axes, found.groups, strict=True):
        people = [each for each in found.participants if each.condition == group.condition]
        thin = [line for line in axes.lines if line.get_linewidth() == 0.6]
        assert len(thin) == sum(each.curve.slope is not None for each in people) == 7


def test_the_same_results_give_the_same_files(results: Results, tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    for folder in (one, other):
        folder.mkdir()
        with figure_style():
            figure = draw_psychometric(results, results[PSYCHOMETRIC][0], DEFAULT)
            files = save_figure(figure, folder, "psychometric", ("png", "svg", "pdf"))
        assert [file.name for file in files] == ["psychometric.png", "psychometric.svg", "psychometric.pdf"]
    for file in one.iterdir():
        assert file.read_bytes() == (other / file.name).read_bytes()


def test_several_factors_have_a_figure_each(writer: StudyWriter, tmp_path: Path) -> None:
    writer.protocol = chest_protocol(
        within={"modulation_hz": (25.0, 50.0, 100.0), "drive": (0.25, 0.5, 1.0)},
        between={},
        comparisons=(),
        repetitions=4,
    )
    for person in ("01", "02"):
        writer.add(
            person,
            lambda conditions, repetition: repetition < 4 * float(conditions["drive"] or 0),
        )
    names = {
        file.stem
        for file in write_results(analyse(writer.folder), tmp_path, FigureOptions(formats=("svg",))).files
        if file.suffix == ".svg"
    }
    assert names == {"rates", "psychometric_modulation_hz", "psychometric_drive", "timing"}


@pytest.mark.parametrize("felt", [True, False])
def test_all_or_none_felt_can_be_drawn(writer: StudyWriter, felt: bool) -> None:
    writer.add("01", chest_answer([10 * felt] * 6))
    results = analyse(writer.folder)
    for axes in draw_psychometric(results, results[PSYCHOMETRIC][0], DEFAULT).axes:
        assert len(axes.lines) == 0
