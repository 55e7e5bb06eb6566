"""What is written: tables, JSON, figure, a valid BIDS derivative; and the words for the terminal."""

import csv
import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.comparisons.figure import draw_comparisons
from autd_analysis.rates import RATES
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.summary import plain_words
from autd_analysis.report.writing import results_json, write_results
from autd_analysis.results import Results
from autd_analysis.study import analyse
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from autd_trials.errors import DeviceError
from autd_trials.testing.recorded import Answer, StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol
from tests.conftest import program

TABLES = (
    "rates",
    "rates_by_participant",
    "comparisons",
    "false_alarms",
    "false_alarms_by_participant",
    "timing",
    "response_times",
    "response_times_by_participant",
    "psychometric",
    "psychometric_by_participant",
)


LOOKED_AT = FigureOptions(formats=("svg",))
"""The one format of figures in which words can be looked for; writing all three takes most of the time."""


def always(felt: bool) -> Answer:
    return lambda conditions, repetition: felt


def table(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / f"{name}.tsv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def result_figure(results: Results) -> Figure:
    return draw_comparisons(results[COMPARISONS], results[RATES], results, FigureOptions())


def figure_words(study: Path) -> str:
    figure = result_figure(analyse(study, only=["rates", "comparisons"]))
    texts = [text.get_text() for text in figure.texts]
    for axes in figure.axes:
        texts += [axes.get_xlabel(), axes.get_ylabel(), axes.get_title(loc="left")]
        texts += [label.get_text() for label in axes.get_xticklabels()]
        legend = axes.get_legend()
        texts += [text.get_text() for text in legend.get_texts()] if legend else []
    return "\n".join(texts)


@dataclass(frozen=True)
class Written:
    """The chest study of `CHEST_COUNTS`, analysed and written once for the tests that only look."""

    study: Path
    folder: Path
    files: tuple[Path, ...]


@pytest.fixture(scope="module")
def written(recorded_chest: Path, tmp_path_factory: pytest.TempPathFactory) -> Written:
    study = tmp_path_factory.mktemp("study") / "chest"
    shutil.copytree(recorded_chest, study)
    folder = study / "derivatives" / "analysis"
    return Written(study, folder, write_results(analyse(study), folder).files)


def test_everything_is_written_and_named(written: Written) -> None:
    out, files = written.folder, written.files
    assert set(files) == set(out.iterdir())
    assert {file.name for file in files} >= {f"{name}.tsv" for name in TABLES}
    assert (out / "rates.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "rates.pdf").read_bytes().startswith(b"%PDF")
    assert "<svg" in (out / "rates.svg").read_text()


def test_the_same_study_gives_the_same_bytes(written: Written, tmp_path: Path) -> None:
    for one, two in zip(written.files, write_results(analyse(written.study), tmp_path).files, strict=True):
        assert one.read_bytes() == two.read_bytes(), one.name
        # The two were made within seconds, so look for time stamps too.
        assert b"CreationDate" not in one.read_bytes()
        assert b"dc:date" not in one.read_bytes()


def test_tables_say_n_method_interval_and_origin(written: Written) -> None:
    rates = table(written.folder, "rates")
    assert len(rates) == 6
    assert rates[0]["modulation_hz"] == "25"
    assert rates[0]["clothing"] == "inner"
    assert float(rates[0]["rate"]) == pytest.approx(0.5125)
    assert rates[0]["participants"] == "8"
    assert "t interval over participants" in rates[0]["interval"]
    single = table(written.folder, "rates_by_participant")
    assert len(single) == 48
    assert "Wilson" in single[0]["interval"]
    compared = table(written.folder, "comparisons")
    assert [row["at"] for row in compared] == [f"modulation_hz {hz}" for hz in (25, 50, 100)]
    assert float(compared[2]["sign_flip_least_p"]) == 2 / 256
    assert float(compared[2]["t"]) == pytest.approx(5.773503)
    for name in TABLES:
        assert all(row["simulated"] == "yes" for row in table(written.folder, name))
        assert table(written.folder, name)
    readme = (written.folder / "README.md").read_text()
    assert readme.startswith("SIMULATED PARTICIPANTS")
    for name in TABLES:
        for column in table(written.folder, name)[0]:
            assert f"`{column}`" in readme


def test_undefined_is_said_and_never_zero(written: Written) -> None:
    (row,) = table(written.folder, "false_alarms")
    assert row["rate"] == "n/a"
    assert row["notes"] == "undefined: the study has no catch trials"
    assert "nan" not in (written.folder / "results.json").read_text().lower()


def test_json_has_all_that_the_tables_have(written: Written) -> None:
    content = json.loads(json.dumps(results_json(analyse(written.study)), allow_nan=False))
    assert content["simulated"] is True
    assert (content["participants"], content["sessions"], content["trials"]) == (8, 8, 480)
    assert content["comparisons"][0]["mean_difference"] == 0.35
    assert content["rates"][0]["modulation_hz"] == 25.0
    assert len(content["inputs"]) == 16
    assert all(len(digest) == 64 for digest in content["inputs"].values())


def test_a_study_of_people_is_nowhere_called_simulated(writer: StudyWriter, tmp_path: Path) -> None:
    for participant, counts in enumerate(CHEST_COUNTS[:3], start=1):
        writer.add(f"{participant:02}", chest_answer(counts), simulated=False)
    results = analyse(writer.folder)
    write_results(results, tmp_path, LOOKED_AT)
    assert all(row["simulated"] == "no" for row in table(tmp_path, "rates"))
    assert "SIMULATED" not in plain_words(results) + figure_words(writer.folder)
    assert "SIMULATED" not in (tmp_path / "README.md").read_text()


def test_the_figure_says_what_one_must_know(written: Written) -> None:
    words = figure_words(written.study)
    for expected in (
        "8 participants, 480 trials",
        "SIMULATED PARTICIPANTS",
        "Detection rate (felt / trials)",
        "Modulation frequency (Hz)",
        "inner_outer",
        "95% t interval",
        "n = 8",
        "Holm: p adjusted over 3 tests",
        "the false-alarm rate is undefined",
        ".008",
        "5.77 (7)",
    ):
        assert expected in words


def dots(axes: Axes) -> list[list[float]]:
    """The heights of the participants' dots, a list for each column."""
    points = [column for column in axes.collections if isinstance(column, PathCollection)]
    return [[round(float(y), 6) for y in np.asarray(column.get_offsets())[:, 1]] for column in points]


def test_the_figure_shows_every_participant_in_every_condition(written: Written) -> None:
    rates, differences = result_figure(analyse(written.study, only=["comparisons"])).axes
    in_file_order = [(0, 3), (1, 4), (2, 5)]
    assert dots(rates) == [
        [counts[cell] / 10 for counts in CHEST_COUNTS] for pair in in_file_order for cell in pair
    ]
    assert dots(differences) == [
        [round((counts[inner] - counts[outer]) / 10, 6) for counts in CHEST_COUNTS]
        for inner, outer in in_file_order
    ]


@pytest.mark.parametrize("felt", [True, False])
def test_all_or_none_felt_can_be_written(writer: StudyWriter, tmp_path: Path, felt: bool) -> None:
    for participant in ("01", "02", "03"):
        writer.add(participant, always(felt))
    results = analyse(writer.folder)
    write_results(results, tmp_path, LOOKED_AT)
    assert {row["rate"] for row in table(tmp_path, "rates")} == {str(int(felt))}
    assert {row["t_p"] for row in table(tmp_path, "comparisons")} == {"n/a"}
    assert "the t test and the t interval are not defined" in plain_words(results)


def test_one_participant_one_trial_no_factors(writer: StudyWriter, tmp_path: Path) -> None:
    writer.protocol = chest_protocol(within={}, between={}, comparisons=(), repetitions=1)
    writer.add("01", always(True))
    results = analyse(writer.folder)
    write_results(results, tmp_path, LOOKED_AT)
    (row,) = table(tmp_path, "rates")
    assert (row["rate"], row["interval_low"], row["participants"]) == ("1", "n/a", "1")
    words = plain_words(results)
    assert "1 simulated participant(s)" in words
    assert "plans no comparison" in words


def test_catch_trials_are_shown_and_written(writer: StudyWriter, tmp_path: Path) -> None:
    writer.protocol = chest_protocol(catch_trials=5)
    for participant in ("01", "02"):
        writer.add(participant, lambda conditions, repetition: repetition == 0)
    results = analyse(writer.folder)
    write_results(results, tmp_path, LOOKED_AT)
    rows = table(tmp_path, "false_alarms")
    assert [row["clothing"] for row in rows] == ["inner", "inner_outer", "n/a"]
    assert {row["rate"] for row in rows} == {"0.2"}
    assert len(table(tmp_path, "false_alarms_by_participant")) == 6
    assert "catch trials" in figure_words(writer.folder)
    assert "undefined" not in figure_words(writer.folder)
    assert "False-alarm rate (catch trials answered as felt" in plain_words(results)


def test_only_catch_trials_answered_can_be_written(writer: StudyWriter, tmp_path: Path) -> None:
    writer.protocol = chest_protocol(catch_trials=5, repetitions=1)
    for participant in ("01", "02"):
        writer.add(
            participant,
            lambda conditions, repetition: False if conditions["modulation_hz"] is None else None,
        )
    write_results(analyse(writer.folder), tmp_path, LOOKED_AT)
    assert {row["rate"] for row in table(tmp_path, "rates")} == {"n/a"}
    assert {row["rate"] for row in table(tmp_path, "false_alarms")} == {"0"}


def test_warnings_reach_words_json_and_readme(writer: StudyWriter, tmp_path: Path) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), trials=25)
    writer.add("02", chest_answer(CHEST_COUNTS[1]))
    results = analyse(writer.folder)
    write_results(results, tmp_path, LOOKED_AT)
    assert results.remarks
    for warning in results.remarks:
        assert warning in plain_words(results)
        assert warning in results_json(results)["warnings"]
        assert warning in (tmp_path / "README.md").read_text()


def test_the_folder_is_a_valid_bids_derivative(written: Written) -> None:
    done = subprocess.run(
        [program("bids-validator-deno"), str(written.folder), "--format", "json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert issues == []


def test_a_folder_that_cannot_be_written_is_said(chest: StudyWriter, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DeviceError, match="cannot write the results"):
        write_results(analyse(chest.folder), tmp_path / "file" / "analysis")
