"""All trials of a study are written as one table with a column of participants, each column described."""

import json
from pathlib import Path

from autd_analysis.data.trials import read_trials
from autd_analysis.data.trials_tsv import trial_columns, trials_sidecar, trials_tsv
from autd_analysis.reading import read_table
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.writing import write_results
from autd_analysis.study import analyse

from autd_trials.testing.recorded import StudyWriter


def test_all_trials_of_a_study_are_one_table_that_is_read_again(chest: StudyWriter, tmp_path: Path) -> None:
    trials = read_trials(chest.folder)
    path = tmp_path / "trials.tsv"
    path.write_text(trials_tsv(trials))
    header = path.read_text().splitlines()[0].split("\t")
    assert header[:2] == ["participant", "session"]
    assert {"modulation_hz", "clothing", "response", "response_time", "onset_lateness", "used"} <= set(header)
    assert set(trials_sidecar(trials)) == set(header)
    names = ("participant", "session", "trial", "block", "trial_type", "trial_status", "response")
    again = read_table(path, columns={name: name for name in (*names, "clothing", "modulation_hz")})
    assert again.participants == trials.participants
    for name in ("participant", "trial", "felt", "clothing", "modulation_hz"):
        assert again.table[name].tolist() == trials.table[name].tolist()


def test_results_have_all_trials_and_say_what_their_columns_are(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("who,felt,amp\n" + "".join(f"P1,{n % 2},{n % 3}\n" for n in range(12)))
    trials = read_table(path, columns="participant=who,response=felt,amp")
    folder = tmp_path / "out"
    write_results(analyse(trials), folder, FigureOptions(formats=("svg",)))
    lines = (folder / "trials.tsv").read_text().splitlines()
    assert len(lines) == 13
    assert json.loads((folder / "trials.json").read_text())["amp"]["Description"]
    assert "### trials.tsv" in (folder / "README.md").read_text()
    assert "response_time" not in [column.name for column in trial_columns(trials)]
